#include "isp/merge/stars/drizzle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "tests/merge/drizzle_frames.h"
#include "tests/support/peak_memory.h"

namespace lowlux::merge::drizzle_test {
namespace {

using namespace star_testing;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

TEST(Drizzle, EqualsTheSumOverSamplesInDouble) {
  Draw draw(3);
  for (int trial = 0; trial < 24; ++trial) {
    const int side = 5 + static_cast<int>(draw.uniform(0, 40)), height = trial % 2 == 0 ? side : 47;
    const int width = trial % 2 == 0 ? side : 23;  // quarter turns keep a square
    const DrizzleOptions options{draw.uniform(1, 3), draw.uniform(0.3, 1)};
    const int output_width = static_cast<int>(std::ceil(width * options.scale));
    const int output_height = static_cast<int>(std::ceil(height * options.scale));
    DrizzleReference expected(output_width, output_height);
    Drizzle drizzle(width, height, options);
    InlineExecutor one;
    for (int k = 0; k < 3; ++k) {
      const int quarters = trial % 2 == 0 ? static_cast<int>(draw.uniform(0, 4)) : 0;
      const double dx = draw.uniform(-3, 3), dy = draw.uniform(-3, 3);
      const auto phase = static_cast<BayerPhase>(static_cast<int>(draw.uniform(0, 4)));
      Plane<float> frame(width, height);
      for (std::size_t i = 0; i < frame.size(); ++i)
        frame.data()[i] = draw.uniform() < 0.05 ? nan : static_cast<float>(draw.uniform(-5, 100));
      expected.add(frame, phase, quarters, dx, dy, options, 1 / 6.5);
      drizzle.add({.frame = view(frame, phase),
                   .motion = moved(width, height, 90 * quarters, dx, dy),
                   .level_e = {2.5, 2.5, 2.5, 2.5}},
                  one);
    }
    const DrizzleImage image = drizzle.finish(one);
    ASSERT_EQ(image.width, output_width);
    ASSERT_EQ(image.height, output_height);
    for (int c = 0; c < 3; ++c) {
      double empty = 0;
      for (int y = 0; y < output_height; ++y) {
        for (int x = 0; x < output_width; ++x) {
          const std::size_t k = static_cast<std::size_t>(y) * static_cast<std::size_t>(output_width) + x;
          const auto colour = static_cast<std::size_t>(c);
          const double weight = expected.weight[colour][k], mean = expected.value[colour][k] / weight;
          const double got = static_cast<double>(image.weight(c).at(x, y));
          EXPECT_NEAR(got, weight, 2e-5) << trial;  // single precision of places: 1e-6 px of a drop of 0.3 px
          empty += got > 0 ? 0 : 1;
          if (weight < 0.01) continue;
          EXPECT_NEAR(static_cast<double>(image.value_e(c).at(x, y)), mean, 0.02) << trial;
          const double variance = expected.squares[colour][k] / (weight * weight) * (std::max(mean, 0.0) + 4);
          EXPECT_NEAR(static_cast<double>(image.variance_e2(c).at(x, y)), variance, 2e-3 * variance) << trial;
        }
      }
      EXPECT_NEAR(image.empty_fraction[static_cast<std::size_t>(c)], empty / (output_width * output_height), 1e-12);
    }
  }
}

TEST(Drizzle, ConstantFramesGiveConstantsWhateverTheMotion) {
  constexpr int width = 331, height = 270;
  const Plane<float> frame = constant(width, height, 137.25F);
  Draw draw(4);
  InlineExecutor one;
  for (const DrizzleOptions options : {DrizzleOptions{1, 1}, {1.5, 0.7}, {2, 0.4}, {3, 1}}) {
    Drizzle drizzle(width, height, options);
    for (int k = 0; k < 6; ++k) {
      const Motion motion = moved(width, height, draw.uniform(-180, 180), draw.uniform(-90, 90), draw.uniform(-90, 90));
      drizzle.add({.frame = view(frame), .motion = motion}, one);
    }
    const DrizzleImage image = drizzle.finish(one);
    for (int c = 0; c < 3; ++c) {
      for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
          const float expected = image.weight(c).at(x, y) > 0 ? 137.25F : 0.0F;
          ASSERT_NEAR(image.value_e(c).at(x, y), expected, 2e-5F * 137.25F);
          ASSERT_TRUE(std::isfinite(image.variance_e2(c).at(x, y)));
        }
      }
    }
  }
}

TEST(Drizzle, FluxIsConserved) {
  constexpr int width = 260, height = 240;
  Draw draw(5);
  InlineExecutor one;
  for (int trial = 0; trial < 12; ++trial) {
    const DrizzleOptions options{draw.uniform(1, 3), draw.uniform(0.2, 1)};
    const double scale = draw.uniform(0.98, 1.02);
    const Motion motion =
        moved(width, height, draw.uniform(-180, 180), draw.uniform(-9, 9), draw.uniform(-9, 9), scale);
    Plane<float> frame = constant(width, height, nan);
    std::array<double, 3> flux{}, samples{};
    for (int y = 60; y < 180; ++y) {
      for (int x = 70; x < 190; ++x) {
        frame.at(x, y) = static_cast<float>(draw.uniform(0, 1000));
        const auto c = static_cast<std::size_t>(colour_at(BayerPhase::grbg, x, y));
        flux[c] += static_cast<double>(frame.at(x, y)) * scale * scale;  // a pixel is 1 / scale^2 of the reference's
        samples[c] += 1;
      }
    }
    Drizzle drizzle(width, height, options);
    const DrizzleCounts counts = drizzle.add({.frame = view(frame, BayerPhase::grbg), .motion = motion}, one);
    EXPECT_EQ(counts.used, 120 * 120);
    const DrizzleImage image = drizzle.finish(one);
    for (int c = 0; c < 3; ++c) {
      double sum = 0, weight = 0;
      for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
          const double w = 4 * static_cast<double>(image.weight(c).at(x, y));
          sum += w * static_cast<double>(image.value_e(c).at(x, y));
          weight += w;
        }
      }
      const auto k = static_cast<std::size_t>(c);
      EXPECT_NEAR(weight, samples[k], 1e-6 * samples[k]) << trial;
      EXPECT_NEAR(sum, flux[k], 4e-6 * flux[k]) << trial;  // 1e-6, and the areas by displacements in single precision
    }
  }
}

TEST(Drizzle, RejectedSamplesDoNotCount) {
  constexpr int width = 100, height = 80;
  InlineExecutor one;
  Plane<float> frame = constant(width, height, 50);
  Plane<std::uint8_t> blocks(4, 3);
  std::fill_n(blocks.data(), blocks.size(), std::uint8_t{1});
  for (int y = 32; y < 64; ++y)
    for (int x = 64; x < 96; ++x) frame.at(x + 3, y + 5) = 7000;  // something that moved, in block (2, 1)
  for (int k = 0; k < 80; ++k) frame.at(10 + k, k) = std::numeric_limits<float>::quiet_NaN();  // a satellite's trail
  blocks.at(2, 1) = 0;
  const Motion motion = moved(width, height, 0, 3, 5);
  Drizzle drizzle(width, height, {1, 0.5});
  const DrizzleCounts counts =
      drizzle.add({.frame = view(frame), .motion = motion, .accepted = {blocks.view(), 32}}, one);
  constexpr int trail = 75;  // sites of it that lie within the output
  EXPECT_EQ(counts.used + counts.rejected, (width - 3) * (height - 5) - trail);
  EXPECT_GE(counts.rejected, 32 * 32 - 40);
  const DrizzleImage image = drizzle.finish(one);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) EXPECT_LE(image.value_e(c).at(x, y), 50.001F) << x << ", " << y;
  }
}

TEST(Drizzle, AnyThreadsMakeTheSameBytes) {
  constexpr int width = 301, height = 640;
  const StarCamera camera{.width = width, .height = height};
  const Plane<float> frame = exposed(camera, {}, 3);
  for (const DrizzleOptions options : {DrizzleOptions{1, 0.8}, {2.3, 1}}) {
    std::vector<DrizzleImage> images;
    for (const int threads : {1, 2, 3, 7}) {
      PoolExecutor executor(threads);
      Drizzle drizzle(width, height, options);
      for (const double degrees : {1.0, 77.0, 180.0})
        drizzle.add({.frame = view_of(camera, frame), .motion = moved(width, height, degrees, 11.3, -7.7)}, executor);
      images.push_back(drizzle.finish(executor));
    }
    for (std::size_t k = 1; k < images.size(); ++k) {
      EXPECT_EQ(images[k].empty_fraction, images[0].empty_fraction);
      for (std::size_t c = 0; c < 3; ++c) {
        ASSERT_EQ(
            std::memcmp(images[k].rows[c].data(), images[0].rows[c].data(), images[0].rows[c].size() * sizeof(float)),
            0);
      }
    }
  }
}

TEST(Drizzle, OneFrameLeavesTheSitesOfOtherColoursEmpty) {
  const Plane<float> frame = constant(64, 48, 5);
  InlineExecutor one;
  Drizzle drizzle(64, 48, {});
  drizzle.add({.frame = view(frame), .motion = no_motion(64, 48)}, one);
  const DrizzleImage image = drizzle.finish(one);
  EXPECT_EQ(image.empty_fraction, (std::array<double, 3>{0.75, 0.5, 0.75}));
  EXPECT_EQ(image.value_e(0).at(0, 0), 5);
  EXPECT_EQ(image.variance_e2(0).at(0, 0), 9);
  EXPECT_EQ(image.weight(0).at(1, 0), 0);
  EXPECT_EQ(image.value_e(0).at(1, 0), 0);
}

TEST(Drizzle, AnySizeAndMotionIsHandled) {
  InlineExecutor one;
  Draw draw(8);
  for (const auto& [width, height] :
       std::vector<std::array<int, 2>>{{1, 1}, {1, 300}, {300, 1}, {2, 3}, {33, 32}, {65, 7}}) {
    const Plane<float> frame = constant(width, height, 5);
    for (int k = 0; k < 30; ++k) {
      const DrizzleOptions options{draw.uniform(1, 3), draw.uniform(0.05, 1)};
      Drizzle drizzle(width, height, options);
      Motion motion =
          moved(width, height, draw.uniform(-180, 180), draw.uniform(-1, 1) * width, draw.uniform(-1, 1) * height);
      if (k % 3 == 1) {  // no motion that could be inverted
        for (std::size_t i = 0; i < motion.dx_px.size(); ++i)
          motion.dx_px.data()[i] = static_cast<float>(draw.uniform(-100, 100));
      }
      if (k % 3 == 2) motion = moved(width, height, 0, 3e4, 0);  // out of view
      const DrizzleCounts counts = drizzle.add({.frame = view(frame), .motion = motion}, one);
      EXPECT_LE(counts.used, width * height);
      const DrizzleImage image = drizzle.finish(one);
      for (const double empty : image.empty_fraction) EXPECT_GE(empty, k % 3 == 2 ? 1 : 0);
      for (const Plane<float>& plane : image.rows)
        EXPECT_TRUE(std::all_of(plane.data(), plane.data() + plane.size(), [](float v) { return std::isfinite(v); }));
    }
  }
}

TEST(Drizzle, MemoryDoesNotGrowWithTheNumberOfFrames) {
  constexpr int width = 1500, height = 1000;
  constexpr DrizzleOptions options{1.5, 0.7};
  const Plane<float> frame = constant(width, height, 5);
  const auto peak = [&](int frames) {
    return test::peak_bytes([&] {
      InlineExecutor one;
      Drizzle drizzle(width, height, options);
      for (int k = 0; k < frames; ++k)
        drizzle.add({.frame = view(frame), .motion = moved(width, height, k, k, 0)}, one);
      EXPECT_LT(drizzle.finish(one).empty_fraction[1], 1);
    });
  };
  const std::int64_t none = test::peak_bytes([] {}), one = peak(1), many = peak(5);
  const std::int64_t stated = Drizzle::memory_bytes(width, height, options);
  EXPECT_EQ(stated, 36LL * 2250 * 1500);
  EXPECT_LT(one - none, stated + (8 << 20));
  EXPECT_LT(many - one, 4 << 20);
}

}  // namespace
}  // namespace lowlux::merge::drizzle_test
