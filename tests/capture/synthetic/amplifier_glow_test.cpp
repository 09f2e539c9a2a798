#include "isp/model/sensor/amplifier_glow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "capture/synthetic/block_levels.h"
#include "isp/model/colour/colorimetry.h"
#include "tests/support/sensor_frames.h"

// Amplifier glow of simulated frames against G t exp(-d / (l D)), in frames of drawn sizes.
namespace lowlux::capture {
namespace {

using isp::Effect;
using isp::NoiseSourceSet;

/// A sensor that reads one code for an electron, with a glow, and a frame of it.
struct Case {
  SensorModel sensor;
  test::Flat flat;

  double mean_e(int x, int y) const {
    const double right = x + 0.5 - sensor.glow_position[0] * flat.width;
    const double down = y + 0.5 - sensor.glow_position[1] * flat.height;
    const double length_px = sensor.glow_length * std::hypot(flat.width, flat.height);
    return flat.exposure.time_s * sensor.glow_e_per_s * std::exp(-std::hypot(right, down) / length_px);
  }
  double electrons(const Plane<float>& dn, int x, int y) const { return dn.at(x, y) - sensor.black_level_dn; }
};

Case draw_case(std::uint32_t seed) {
  std::mt19937 generator(seed);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator);
  };
  Case c;
  c.sensor.full_well_e = 60000;
  c.sensor.bits = 16;
  c.sensor.black_level_dn = 1000;
  c.sensor.white_level_dn = 65535;
  c.sensor.glow_e_per_s = between(2, 200);
  c.sensor.glow_position = {between(-0.5, 1.5), between(-0.5, 1.5)};
  c.sensor.glow_length = between(0.1, 1);
  c.flat.width = 2 * static_cast<int>(between(60, 180)) + 1;
  c.flat.height = 2 * static_cast<int>(between(60, 180)) + 1;
  c.flat.exposure = {between(0.5, 20), between(-20, 60)};
  c.flat.seed = seed;
  return c;
}

TEST(AmplifierGlow, HasMeanAndVarianceOfItsLawAtEveryTemperature) {
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    const Case c = draw_case(seed);
    const Plane<float> dn = test::flat_dn(c.sensor, {Effect::amplifier_glow}, c.flat);
    // Of z = (N - m) / sqrt(m), N ~ Poisson(m): E z = 0, E z^2 = 1, Var z^2 = 2 + 1 / m. Means below 1 e- are left out.
    double n = 0, sum = 0, square = 0, variance = 0;
    for (int y = 0; y < dn.height(); ++y) {
      for (int x = 0; x < dn.width(); ++x) {
        const double m = c.mean_e(x, y), difference = c.electrons(dn, x, y) - m;
        if (m < 1) continue;
        ++n;
        sum += difference / std::sqrt(m);
        square += difference * difference / m;
        variance += 2 + 1 / m;
      }
    }
    ASSERT_GT(n, 1000) << seed;
    EXPECT_NEAR(sum / n, 0, 5 / std::sqrt(n)) << seed;
    EXPECT_NEAR(square / n, 1, 5 * std::sqrt(variance) / n) << seed;
  }
}

TEST(AmplifierGlow, AddsToOtherChargeAndIsFollowedByTheFullWell) {
  Case c = draw_case(7);
  c.sensor.glow_e_per_s = 1000 / c.flat.exposure.time_s;
  c.sensor.glow_position = {0.5, 0.5};
  c.sensor.glow_length = 10;  // nearly even: at least 950 of 1000 e-
  c.flat.rate_e_per_s = 500 / c.flat.exposure.time_s;
  const auto mean_of = [&] {
    return test::moments_of(test::samples_of(
        test::flat_dn(c.sensor, {Effect::amplifier_glow, Effect::photon_noise, Effect::clipping}, c.flat)));
  };
  double glow_e = 0;
  for (int y = 0; y < c.flat.height; ++y) {
    for (int x = 0; x < c.flat.width; ++x) glow_e += c.mean_e(x, y) / (c.flat.width * c.flat.height);
  }
  const test::SampleMoments sum = mean_of();
  EXPECT_NEAR(sum.mean - c.sensor.black_level_dn, 500 + glow_e, 5 * sum.mean_error);
  c.sensor.full_well_e = 300;
  EXPECT_EQ(mean_of().mean, 1300);
  EXPECT_EQ(mean_of().variance, 0);
}

TEST(AmplifierGlow, WithoutItItsPlaceAndLengthDoNotMatterAndLeftOutItIsAbsent) {
  Case c = draw_case(8);
  c.flat.rate_e_per_s = 5;
  c.sensor.read_noise_e = 2;
  const auto bytes = [&](NoiseSourceSet kept) { return test::samples_of(test::flat_dn(c.sensor, kept, c.flat)); };
  const auto left_out = bytes(NoiseSourceSet::all().without(Effect::amplifier_glow));
  EXPECT_NE(bytes(NoiseSourceSet::all()), left_out);
  c.sensor.glow_e_per_s = 0;
  EXPECT_EQ(bytes(NoiseSourceSet::all()), left_out);
  c.sensor.glow_position = {1, 1};
  c.sensor.glow_length = 0.1;
  EXPECT_EQ(bytes(NoiseSourceSet::all()), left_out);
}

TEST(AmplifierGlow, LevelsOfBlocksAddUpToTheFrames) {
  for (std::uint32_t seed = 11; seed <= 14; ++seed) {
    const Case c = draw_case(seed);
    const Plane<float> dark = test::filled(c.flat.width, c.flat.height, 0);
    const auto blocks = block_levels({c.sensor, c.flat.exposure, BayerPhase::rggb, dark.view()});
    double sum = 0, square = 0, least = 1e9, peak = 0;
    double block_sum = 0, block_square = 0, block_least = 1e9, block_peak = 0;
    for (int y = 0; y < c.flat.height; ++y) {
      for (int x = 0; x < c.flat.width; ++x) {
        const double m = c.mean_e(x, y);
        sum += m;
        square += m * m;
        least = std::min(least, m);
        peak = std::max(peak, m);
      }
    }
    const int side = isp::effect_block, across = (c.flat.width + side - 1) / side;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const int x0 = static_cast<int>(i) % across * side, y0 = static_cast<int>(i) / across * side;
      const double n = std::min(side, c.flat.width - x0) * std::min(side, c.flat.height - y0);
      const isp::BlockLevel::Glow& glow = blocks[i].glow;
      block_sum += n * glow.mean_e;
      block_square += n * (glow.variance_e2 + glow.mean_e * glow.mean_e);
      block_least = std::min(block_least, glow.min_e);
      block_peak = std::max(block_peak, glow.peak_e);
    }
    EXPECT_NEAR(block_sum / sum, 1, 1e-9) << seed;
    EXPECT_NEAR(block_square / square, 1, 1e-9) << seed;
    EXPECT_NEAR(block_least / least, 1, 1e-9) << seed;
    EXPECT_NEAR(block_peak / peak, 1, 1e-9) << seed;
  }
}

// Half of the frame is so far from the source that its glow cannot be seen: only the other one needs it.
TEST(AmplifierGlow, IsSimulatedOnlyInTheBlocksThatShowIt) {
  Case c = draw_case(21);
  c.flat.width = 640;
  c.flat.height = 64;
  c.flat.exposure = {1, 20};
  c.sensor.read_noise_e = 3;
  c.sensor.glow_e_per_s = 100;
  c.sensor.glow_position = {0, 0.5};
  c.sensor.glow_length = 0.05;  // 32 px: less than 1e-4 e- from block 14 on
  const Plane<float> dark = test::filled(c.flat.width, c.flat.height, 0);
  const auto blocks = block_levels({c.sensor, c.flat.exposure, BayerPhase::rggb, dark.view()});
  const auto developing =
      isp::developing_of(c.sensor, c.flat.exposure, *isp::rgb_to_xyz(isp::primaries_rec709), {1, 1, 1}, blocks);
  const auto plan = isp::plan_noise_sources(c.sensor, c.flat.exposure, developing, blocks, {});
  const auto kept = [&](std::size_t block) {
    return plan.regions[plan.region_of_block[block]].kept.has(Effect::amplifier_glow);
  };
  EXPECT_TRUE(kept(0));
  EXPECT_TRUE(kept(1));
  for (std::size_t block = 14; block < 20; ++block) EXPECT_FALSE(kept(block)) << block;
}

}  // namespace
}  // namespace lowlux::capture
