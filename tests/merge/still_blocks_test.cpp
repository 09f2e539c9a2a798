#include "isp/merge/still_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "tests/merge/merge_scene.h"

namespace lowlux::merge::still_blocks_test {
namespace {

using test::dark_variance_e2;
using test::noisy_frame;

constexpr double read_noise_e = 2;

/// Three mosaics of a frame: as the reference has it, brought to its place, and as it is.
struct Scene {
  int width, height;
  std::function<double(double x, double y, int frame)> aligned;  // mean signal [e-]
  std::function<double(double x, double y, int frame)> unmoved;
};

Plane<float> drawn(const Scene& scene, const std::function<double(double, double, int)>& mean_e, int frame,
                   std::uint64_t seed) {
  Plane<float> mean(scene.width, scene.height);
  for (int y = 0; y < scene.height; ++y) {
    for (int x = 0; x < scene.width; ++x) mean.at(x, y) = static_cast<float>(mean_e(x, y, frame));
  }
  return noisy_frame(mean, 0, read_noise_e, seed, static_cast<std::uint32_t>(frame));
}

Plane<std::uint8_t> still_blocks(const Scene& scene, int frames, std::uint64_t seed, Executor& executor) {
  StillBlocks blocks(scene.width, scene.height);
  const Plane<float> reference = drawn(scene, scene.unmoved, 0, seed);
  for (int i = 1; i <= frames; ++i) {
    blocks.add(reference.view(), drawn(scene, scene.aligned, i, seed).view(),
               drawn(scene, scene.unmoved, i, seed + 1).view(), {dark_variance_e2(0, read_noise_e), 1}, executor);
  }
  return blocks.blocks();
}

double texture(double x, double y, double level) { return test::smooth_scene(x, y, 0, level); }

TEST(StillBlocks, WhereNothingCanBeSeenMoveWithTheScene) {
  InlineExecutor one;
  const std::uint64_t seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 draw(seed);
  for (int trial = 0; trial < 40; ++trial) {
    const double level = std::exp(std::uniform_real_distribution<double>(std::log(0.3), std::log(3000.0))(draw));
    const auto flat = [level](double, double, int) { return level; };
    const int frames = std::uniform_int_distribution<int>(1, 5)(draw);
    const Plane<std::uint8_t> found = still_blocks({320, 240, flat, flat}, frames, draw(), one);
    int still = 0;
    for (std::size_t i = 0; i < found.size(); ++i) still += found.data()[i];
    // 400 squares and their parents, at 5 standard deviations; 16 squares would be a false alarm of a whole parent.
    EXPECT_LT(still, 16) << level << " e-, " << frames << " frames";
  }
}

TEST(StillBlocks, ALandscapeStandsStillAndTheSkyMoves) {
  // The lower half is textured and stands still; the upper half has stars that move by 7 px from frame to frame, above
  // a gradient that stands still.
  const auto sky = [](double x, double y) {
    const double star_x = std::remainder(x, 24), star_y = std::remainder(y, 24);
    return 20 + 0.02 * x + 300 * std::exp(-(star_x * star_x + star_y * star_y) / 3);
  };
  Scene scene{.width = 384, .height = 256};
  scene.unmoved = [&](double x, double y, int frame) {
    return y < 128 ? sky(x - 7 * frame, y) + 0.14 * frame : texture(x, y, 20);
  };
  scene.aligned = [&](double x, double y, int frame) {
    const double u = x + 7 * frame;
    return y < 128 ? sky(x, y) : texture(u, y, 20);
  };
  PoolExecutor seven(7);
  InlineExecutor one;
  const Plane<std::uint8_t> found = still_blocks(scene, 4, 5, seven), again = still_blocks(scene, 4, 5, one);
  EXPECT_EQ(std::memcmp(found.data(), again.data(), found.size()), 0);
  for (int y = 0; y < found.height(); ++y) {
    for (int x = 0; x < found.width(); ++x) EXPECT_EQ(found.at(x, y), y < 16 ? 0 : 1) << x << ", " << y;
  }
}

TEST(StillBlocks, OneFrameWithASatelliteDecidesNothing) {
  const auto flat = [](double, double, int) { return 30.0; };
  Scene scene{192, 128, flat, flat};
  scene.aligned = [](double x, double y, int frame) { return frame == 2 && std::fabs(x - y) < 2 ? 2000.0 : 30.0; };
  InlineExecutor one;
  const Plane<std::uint8_t> found = still_blocks(scene, 5, 8, one);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found.data()[i], 0);
}

TEST(StillBlocks, FramesOfAnySizeAndWithoutValuesAreTaken) {
  InlineExecutor one;
  for (const auto& [width, height] : {std::array{1, 1}, {1, 100}, {3, 2}, {17, 31}, {40, 1}}) {
    StillBlocks blocks(width, height);
    EXPECT_EQ(blocks.blocks().width(), (width + 7) / 8);
    Plane<float> reference(width, height), nothing(width, height);
    std::fill_n(reference.data(), reference.size(), 5.0F);
    std::fill_n(nothing.data(), nothing.size(), std::numeric_limits<float>::quiet_NaN());
    blocks.add(reference.view(), reference.view(), nothing.view(), {dark_variance_e2(0, 1), 1}, one);
    const Plane<std::uint8_t> found = blocks.blocks();
    for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found.data()[i], 0);
  }
}

}  // namespace
}  // namespace lowlux::merge::still_blocks_test
