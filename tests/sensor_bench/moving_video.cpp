#include "tests/sensor_bench/moving_video.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>

#include "isp/base/cfa.h"
#include "isp/pipeline/render/noise_reducer.h"
#include "tests/sensor_bench/picture_raw.h"

namespace lowlux::test {
namespace {

constexpr int side = 256, object_side = 96, border = 8;
constexpr double read_noise_e = 2, lens_sigma_px = 0.9;
constexpr BayerPhase phase = BayerPhase::rggb;

struct Place {
  double x = 0, y = 0;
};

Place camera_at(VideoMotion motion, int frame) {
  const double t = frame;
  switch (motion) {
    case VideoMotion::drift:
      return {0.3 * t, -0.2 * t};
    case VideoMotion::pan:
      return {3.3 * t, 0.4 * t};
    case VideoMotion::hand_held:
      return {6 * std::sin(0.7 * t) + 2 * std::sin(2.1 * t + 1), 5 * std::cos(0.9 * t) + 1.5 * std::sin(2.9 * t)};
    default:
      return {};
  }
}

double object_left(int frame) { return 20 + 3.0 * frame; }
constexpr double object_top = 70;
bool in_object(VideoMotion motion, int frame, int x, int y) {
  const double left = object_left(frame);
  return motion == VideoMotion::object && x >= left && x < left + object_side && y >= object_top &&
         y < object_top + object_side;
}

/// Cubic convolution (Keys 1981, a = -1/2).
double cubic(const Plane<float>& plane, double x, double y) {
  const auto weights = [](double t) {
    return std::array{t * (-0.5 + t * (1 - 0.5 * t)), 1 + t * t * (-2.5 + 1.5 * t), t * (0.5 + t * (2 - 1.5 * t)),
                      t * t * (-0.5 + 0.5 * t)};
  };
  const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
  const auto of_x = weights(x - left), of_y = weights(y - top);
  double sum = 0;
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i) {
      const int u = std::clamp(left - 1 + i, 0, plane.width() - 1), v = std::clamp(top - 1 + j, 0, plane.height() - 1);
      sum += of_x[i] * of_y[j] * static_cast<double>(plane.at(u, v));
    }
  }
  return std::max(sum, 0.0);
}

Plane<float> light_of(const VideoScene& scene, VideoMotion motion, double mean_e, int frame) {
  const Place at = camera_at(motion, frame);
  const int left = (scene.rate_e[0].width() - side) / 2 - 20, top = (scene.rate_e[0].height() - side) / 2;
  Plane<float> out(side, side);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const Plane<float>& colour = scene.rate_e[static_cast<std::size_t>(colour_at(phase, x, y))];
      const double rate = in_object(motion, frame, x, y)
                              ? cubic(colour, 200 + x - object_left(frame), 300 + y - object_top)
                              : cubic(colour, left + x + at.x, top + y + at.y);
      out.at(x, y) = static_cast<float>(mean_e * rate);
    }
  }
  return out;
}

Plane<float> exposed(const Plane<float>& light, std::mt19937& random) {
  Plane<float> out(side, side);
  std::normal_distribution<double> read(0, read_noise_e);
  for (std::size_t i = 0; i < out.size(); ++i) {
    std::poisson_distribution<int> photons(std::max(static_cast<double>(light.data()[i]), 1e-9));
    out.data()[i] = static_cast<float>(photons(random) + read(random));
  }
  return out;
}

/// One way to reduce the noise of a video, and its squared errors.
class Way {
 public:
  Way(bool previous, bool compensates) : previous_(previous), compensates_(compensates), out_(side, side) {}

  void reduce(const Plane<float>& raw_e, bool is_first) {
    isp::NoiseReduction how;
    how.noise.variance_e2.fill(read_noise_e * read_noise_e);
    how.level = how.options.level = denoise::Level::standard;
    if (previous_) {
      how.temporal.emplace();
      how.temporal->restart = is_first;
      how.temporal->options.compensate_motion = compensates_;
    }
    const Rect all{0, 0, side, side};
    reducer_.run({all, all, side, side, phase}, how, raw_e.view(), out_.view());
  }
  void count(const Plane<float>& light, VideoMotion motion, double mean_e, int frame) {
    const auto code = [&](float e) {
      return std::pow(std::clamp(static_cast<double>(e) / (5 * mean_e), 0.0, 1.0), 1 / 2.2);
    };
    const bool moves = motion != VideoMotion::still && motion != VideoMotion::object;
    for (int y = border; y < side - border; ++y) {
      for (int x = border; x < side - border; ++x) {
        const std::size_t part = moves || in_object(motion, frame, x, y) ? 0 : 1;
        square_[part] += std::pow(code(out_.at(x, y)) - code(light.at(x, y)), 2);
        pixels_[part] += 1;
      }
    }
  }
  double db(std::size_t part) const { return pixels_[part] > 0 ? -10 * std::log10(square_[part] / pixels_[part]) : 0; }

 private:
  bool previous_;
  bool compensates_;
  InlineExecutor one_;
  isp::NoiseReducer reducer_{one_};
  Plane<float> out_;
  std::array<double, 2> square_{}, pixels_{};
};

}  // namespace

const char* name_of(VideoMotion motion) {
  return std::array{"still", "drift", "pan", "hand-held", "object"}[static_cast<std::size_t>(motion)];
}

Result<VideoScene> video_scene(const std::string& name, Executor& executor) {
  VideoScene out{name, {}};
  for (const BayerPhase of : {BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr}) {
    auto light = picture_light(name, executor, lens_sigma_px, of);
    if (!light) return tl::make_unexpected(light.error());
    const int width = light->rate_e.width(), height = light->rate_e.height();
    for (Plane<float>& plane : out.rate_e) {
      if (plane.empty()) plane = Plane<float>(width, height);
    }
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        out.rate_e[static_cast<std::size_t>(colour_at(of, x, y))].at(x, y) = light->rate_e.at(x, y);
      }
    }
  }
  return out;
}

VideoResult take_video(const VideoScene& scene, VideoMotion motion, double mean_e, int frames) {
  Way level(false, false), still(true, false), compensated(true, true);
  std::mt19937 random(7);
  for (int frame = 0; frame < frames; ++frame) {
    const Plane<float> light = light_of(scene, motion, mean_e, frame), raw_e = exposed(light, random);
    for (Way* way : {&level, &still, &compensated}) {
      way->reduce(raw_e, frame == 0);
      if (2 * frame >= frames) way->count(light, motion, mean_e, frame);
    }
  }
  const auto errors = [&](std::size_t part) {
    return VideoErrors{level.db(part), still.db(part), compensated.db(part)};
  };
  return {errors(0), errors(1)};
}

}  // namespace lowlux::test
