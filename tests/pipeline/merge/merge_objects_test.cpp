#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/pipeline/merge/merge_bursts.h"

namespace lowlux::isp {
namespace {

using test::Burst;

constexpr double hidden_px = 1000;  // offset of what an object hides in frame 0, in the scene

/// Describes a square that moves in front of the scene at a constant speed.
struct MovingObject {
  double left, top;  // in frame 0
  double side;
  double dx, dy;  // from frame to frame
  double gain;    // of its light over that of the part of the scene that it shows
  int frames;
  double level_e, read_noise_e;

  bool contains(double x, double y, int index) const {
    const double u = x - left - index * dx, v = y - top - index * dy;
    return u >= 0 && v >= 0 && u < side && v < side;
  }
  bool passes(double x, double y) const {
    for (int i = 1; i < frames; ++i) {
      if (contains(x, y, i)) return true;
    }
    return false;
  }
};

MovingObject drawn(std::mt19937_64& draw) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double side = 6 * std::pow(10, unit(draw)), speed = 0.2 * std::pow(100, unit(draw)),
               way = 2 * std::numbers::pi * unit(draw);
  return {.left = 16 + unit(draw) * (224 - side),
          .top = 16 + unit(draw) * (160 - side),
          .side = side,
          .dx = speed * std::cos(way),
          .dy = speed * std::sin(way),
          .gain = std::exp2(2 * unit(draw) - 1),
          .frames = 3 << static_cast<int>(3 * unit(draw)),
          .level_e = 3 * std::pow(20, unit(draw)),
          .read_noise_e = 1 + 3 * unit(draw)};
}

Burst burst_of(const MovingObject& object) {
  Burst burst{.mean_e = object.level_e, .read_noise_e = object.read_noise_e};
  const double level_e = object.level_e;
  burst.scene = [object, level_e](double x, double y, int colour) {
    if (x >= hidden_px) return test::smooth_scene(x - hidden_px, y, colour, level_e);
    if (!object.contains(x, y, 0)) return test::smooth_scene(x, y, colour, level_e);
    return object.gain * test::smooth_scene(0.8 * x + 70, 0.8 * y + 30, colour, level_e);
  };
  burst.position = [object](int index, double x, double y) {
    if (object.contains(x, y, index)) return std::array{x - index * object.dx, y - index * object.dy};
    return std::array{object.contains(x, y, 0) ? x + hidden_px : x, y};
  };
  return burst;
}

struct Errors {
  double object = 0, passed = 0, still = 0;  // sums of squares
  double passed_count = 0;
};

Errors errors_of(const RawFrame& frame, const Burst& burst, const MovingObject& object) {
  Errors out;
  for (int y = 0; y < burst.height; ++y) {
    for (int x = 0; x < burst.width; ++x) {
      const double squared = std::pow(Burst::signal_e(frame, x, y) - burst.truth_e(x, y), 2);
      const bool own = object.contains(x, y, 0), passed = !own && object.passes(x, y);
      (own ? out.object : passed ? out.passed : out.still) += squared;
      out.passed_count += passed ? 1 : 0;
    }
  }
  return out;
}

double gain_db(double before, double after) { return 10 * std::log10(before / after); }

TEST(MergeObjects, AreNoWorseThanInTheReferenceAtAnySpeedAndSize) {
  std::mt19937_64 draw(2611);
  double small = 0, passed = 0;
  for (int i = 0; i < 40; ++i) {
    const MovingObject object = drawn(draw);
    SCOPED_TRACE(testing::Message() << object.frames << " frames, side " << object.side << " px, speed "
                                    << std::hypot(object.dx, object.dy) << " px, gain " << object.gain << ", "
                                    << object.level_e << " e-, read noise " << object.read_noise_e << " e-");
    const Burst burst = burst_of(object);
    const Errors one = errors_of(burst.frame(0), burst, object);
    const MergedRaw merged = burst.merged(object.frames, {.alignment = MergeAlignment::none, .reference = 0});
    const Errors all = errors_of(merged.frame, burst, object);
    const double gain = gain_db(one.object, all.object);
    if (object.side > 16) {
      EXPECT_GT(gain, -0.1);  // codes of 16 bits, and frames that match by chance
    } else {
      small += gain;  // fewer sites than two blocks: differences of about one standard deviation are not always found
    }
    if (all.passed_count > 0) passed += gain_db(one.passed, all.passed);
    EXPECT_GT(gain_db(one.still, all.still), gain_db(object.frames, 1) - 1.5);
  }
  EXPECT_GT(small, 0);
  EXPECT_GT(passed, 0);
}

}  // namespace
}  // namespace lowlux::isp
