// Errors and times of find_motion on simulated pairs of hand-held frames: shifts to 40 px, rotations to 1.5 degrees,
// 2 e- read noise. Errors are those of the nodes, for one axis, against the true motion.
//   measure align waves [PAIRS]     generated scenes, 768 x 512
//   measure align pictures [PAIRS]  testdata/pictures, of which frames are crops with a sub-pixel motion
//   measure align times [WIDTH HEIGHT [THREADS]]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "capture/file/picture_source.h"
#include "isp/merge/align/align.h"
#include "tests/bench/measure/measure.h"
#include "tests/sensor_bench/picture_raw.h"
#include "tests/support/moving_scene.h"

namespace {

using namespace lowlux;
using namespace lowlux::test;

struct Pair {
  int width;
  int height;
  View view;
};

Pair drawn_pair(int width, int height, std::mt19937& random) {
  const auto drawn = [&](double most) { return std::uniform_real_distribution<double>(-most, most)(random); };
  const double dx = drawn(40), dy = drawn(40), turn = drawn(1.5) * std::numbers::pi / 180;
  return {width, height, rigid_view(width, height, dx, dy, turn)};
}

struct Sums {
  int pairs = 0;
  int found = 0;
  double errors = 0;
  double predicted = 0;
  double largest = 0;
};

void add_pair(const Light& light, const Pair& pair, double mean_e, std::uint32_t index, Executor& executor,
              Sums& sums) {
  const Exposure first{.mean_e = mean_e, .frame = 2 * index}, second{.mean_e = mean_e, .frame = 2 * index + 1};
  const View still = [](Position p) { return p; };
  const Plane<float> a = expose(light, still, pair.width, pair.height, first, executor);
  const Plane<float> b = expose(light, pair.view, pair.width, pair.height, second, executor);
  const merge::AlignReference reference(frame_view(a, first), executor);
  const merge::Motion motion = merge::find_motion(reference, frame_view(b, second), 1, {}, executor);
  ++sums.pairs;
  if (!motion.found) return;
  ++sums.found;
  const double error = rms_error_px(motion, pair.view, pair.width, pair.height);
  sums.errors += error * error;
  sums.largest = std::max(sums.largest, error);
  sums.predicted += motion.standard_error_px * motion.standard_error_px;
}

void print_row(const char* name, double mean_e, const Sums& s) {
  const double n = std::max(1, s.found);
  std::printf("%-16s %6g e-  found %3d of %3d  rms %.4f px  largest %.4f px  predicted %.4f px\n", name, mean_e,
              s.found, s.pairs, std::sqrt(s.errors / n), s.largest, std::sqrt(s.predicted / n));
}

constexpr double means_e[] = {0.3, 1, 4, 20, 100, 1000};

void print_waves(int pairs, Executor& executor) {
  for (const double mean_e : means_e) {
    Sums sums;
    std::mt19937 random(1);
    for (int i = 0; i < pairs; ++i) {
      const WaveScene scene(static_cast<std::uint64_t>(100 + i), 0.4);
      const Light light = [&](Position p, CfaColour c) { return scene.at(p, c); };
      add_pair(light, drawn_pair(768, 512, random), mean_e, static_cast<std::uint32_t>(i), executor, sums);
    }
    print_row("waves", mean_e, sums);
  }
}

/// Light of a picture between its pixels, by cubic convolution; X, Y and Z stand for the three colours.
class PictureScene {
 public:
  PictureScene(const SceneLinear& xyz, int margin) : xyz_(xyz), margin_(margin) {
    double sum = 0;
    for (std::size_t i = 0; i < xyz.plane[1].size(); ++i) sum += static_cast<double>(xyz.plane[1].data()[i]);
    scale_ = static_cast<double>(xyz.plane[1].size()) / sum;
  }
  double at(Position p, CfaColour colour) const {
    const Plane<float>& plane = xyz_.plane[static_cast<std::size_t>(colour)];
    const double x = p.x + margin_, y = p.y + margin_, left = std::floor(x), upper = std::floor(y);
    double sum = 0;
    for (int j = -1; j <= 2; ++j) {
      for (int i = -1; i <= 2; ++i) {
        const int column = std::clamp(static_cast<int>(left) + i, 0, plane.width() - 1);
        const int row = std::clamp(static_cast<int>(upper) + j, 0, plane.height() - 1);
        sum += weight(x - left - i) * weight(y - upper - j) * static_cast<double>(plane.at(column, row));
      }
    }
    return std::max(0.0, scale_ * sum);
  }

 private:
  static double weight(double t) {
    const double a = std::fabs(t);
    if (a < 1) return (1.5 * a - 2.5) * a * a + 1;
    return a < 2 ? ((-0.5 * a + 2.5) * a - 4) * a + 2 : 0;
  }
  const SceneLinear& xyz_;
  int margin_;
  double scale_ = 1;
};

void print_pictures(int pairs, Executor& executor) {
  constexpr int margin = 56;
  for (const char* name : clean_pictures) {
    auto picture = capture::read_picture(std::string(LOWLUX_TESTDATA "/pictures/") + name, executor);
    if (!picture) {
      std::printf("%s cannot be read\n", name);
      continue;
    }
    const PictureScene scene(picture->xyz, margin);
    const Light light = [&](Position p, CfaColour c) { return scene.at(p, c); };
    const int width = picture->xyz.plane[0].width() - 2 * margin, height = picture->xyz.plane[0].height() - 2 * margin;
    for (const double mean_e : means_e) {
      Sums sums;
      std::mt19937 random(2);
      for (int i = 0; i < pairs; ++i) {
        add_pair(light, drawn_pair(width, height, random), mean_e, static_cast<std::uint32_t>(i), executor, sums);
      }
      print_row(name, mean_e, sums);
    }
  }
}

void print_motion_times(int width, int height, int threads) {
  PoolExecutor executor(threads);
  std::mt19937 random(3);
  const WaveScene scene(7, 0.4, 0.15, 16);
  const Light light = [&](Position p, CfaColour c) { return scene.at(p, c); };
  const Pair pair = drawn_pair(width, height, random);
  for (const double mean_e : means_e) {
    const Exposure first{.mean_e = mean_e, .frame = 0}, second{.mean_e = mean_e, .frame = 1};
    const Plane<float> a = expose(
        light, [](Position p) { return p; }, width, height, first, executor);
    const Plane<float> b = expose(light, pair.view, width, height, second, executor);
    Plane<float> copy = a.clone();
    std::optional<merge::AlignReference> reference;
    std::vector<Task> tasks{{"copy", [&] { std::copy_n(b.data(), b.size(), copy.data()); }},
                            {"reference", [&] { reference.emplace(frame_view(a, first), executor); }},
                            {"frame", [&] { merge::find_motion(*reference, frame_view(b, second), 1, {}, executor); }}};
    time_in_turn(tasks, 7);
    const double megapixels = 1e-6 * width * height;
    std::printf("%d x %d, %d threads, %6g e-: reference %.2f, frame %.2f, copy of a frame %.2f ms/MP\n", width, height,
                threads, mean_e, tasks[1].median_wall_ms() / megapixels, tasks[2].median_wall_ms() / megapixels,
                tasks[0].median_wall_ms() / megapixels);
  }
}

}  // namespace

int lowlux::test::measure_align(Arguments& arguments) {
  const std::string what = arguments.one_of({"waves", "pictures", "times"});
  PoolExecutor executor(2);
  if (what == "times") {
    const int width = arguments.next(4000, 1), height = arguments.next(3000, 1), threads = arguments.next(2, 1);
    arguments.end();
    print_motion_times(width, height, threads);
    return 0;
  }
  const int pairs = arguments.next(what == "waves" ? 16 : 8, 1);
  arguments.end();
  what == "waves" ? print_waves(pairs, executor) : print_pictures(pairs, executor);
  return 0;
}
