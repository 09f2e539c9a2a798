// Errors of videos whose content moves: see denoise/README.md.
#include <array>
#include <cstdio>

#include "tests/bench/measure/measure.h"
#include "tests/sensor_bench/moving_video.h"

namespace {

using namespace lowlux;

constexpr std::array pictures{"kodim08.png", "kodim23.png", "StillLife.exr"};

void add(const test::VideoErrors& errors, std::array<double, 3>& sums) {
  sums[0] += errors.level_db / pictures.size();
  sums[1] += errors.still_db / pictures.size();
  sums[2] += errors.compensated_db / pictures.size();
}

void print(const char* name, double mean_e, const std::array<double, 3>& db) {
  std::printf("%-22s %5.0f %8.2f %8.2f %8.2f\n", name, mean_e, db[0], db[1], db[2]);
}

}  // namespace

int lowlux::test::measure_motion(Arguments& arguments) {
  const int frames = arguments.next(12, 4);
  arguments.end();
  InlineExecutor one;
  std::array<VideoScene, pictures.size()> scenes;
  for (std::size_t i = 0; i < pictures.size(); ++i) scenes[i] = value_of(video_scene(pictures[i], one));
  std::printf("PSNR [dB], mean of %zu pictures, read noise 2 e-, the last half of %d frames\n", pictures.size(),
              frames);
  std::printf("%-22s %5s %8s %8s %8s\n", "motion", "e-", "single", "previous", "moved");
  for (const VideoMotion motion : all_motions) {
    for (const double mean_e : {5.0, 20.0, 100.0, 500.0}) {
      std::array<double, 3> moving{}, rest{};
      for (const VideoScene& scene : scenes) {
        const VideoResult result = take_video(scene, motion, mean_e, frames);
        add(result.moving, moving);
        add(result.rest, rest);
      }
      if (motion != VideoMotion::still) print(name_of(motion), mean_e, moving);
      if (motion == VideoMotion::object) print("object, the rest", mean_e, rest);
      if (motion == VideoMotion::still) print("still", mean_e, rest);
    }
  }
  return 0;
}
