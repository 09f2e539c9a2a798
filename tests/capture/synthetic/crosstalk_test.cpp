#include "capture/synthetic/optics/crosstalk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "capture/synthetic/block_levels.h"
#include "isp/model/colour/colorimetry.h"
#include "tests/support/sensor_frames.h"

// Crosstalk of simulated frames against its kernel, in frames of drawn sizes.
namespace lowlux::capture::crosstalk_test {
namespace {

using isp::Effect;
using isp::NoiseSourceSet;

constexpr double float_error = 1e-5;  // relative: black level and a few roundings of 2^-24 each

SensorModel quiet_sensor(double crosstalk) {
  SensorModel s;
  s.full_well_e = 60000;
  s.bits = 16;
  s.white_level_dn = 65535;
  s.crosstalk = crosstalk;
  return s;
}

/// A frame of drawn size, fraction and colours of the mosaic.
struct Case {
  explicit Case(std::uint32_t seed) : generator(seed) {
    width = static_cast<int>(between(3, 90));
    height = static_cast<int>(between(3, 90));
    phase = static_cast<BayerPhase>(seed % 4);
    sensor = quiet_sensor(between(0, 0.2));
    rate = test::filled(width, height, 0);
  }
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator); }
  SensorFrame frame() const {
    return {.sensor = sensor,
            .phase = phase,
            .rate_e_per_s = rate.view(),
            .seed = 9,
            .masked_columns = masked,
            .blurred_e_per_s = blurred.view()};
  }
  Plane<float> electrons(NoiseSourceSet kept = {Effect::crosstalk}) const {
    InlineExecutor executor;
    Plane<float> out(width, height);
    read_out(frame(), test::plan_of(width, height, kept), executor, out.view());
    return out;
  }

  std::mt19937 generator;
  int width = 0, height = 0, masked = 0;
  BayerPhase phase = BayerPhase::rggb;
  SensorModel sensor;
  Plane<float> rate;
  Plane<float> blurred;  // empty: no lens blur
};

TEST(Crosstalk, MixesTheColoursOfEvenLightByItsMatrix) {
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    Case c(seed);
    const double f = c.sensor.crosstalk, r = c.between(1, 500), g = c.between(1, 500), b = c.between(1, 500);
    const std::array light{r, g, b};
    for (int y = 0; y < c.height; ++y) {
      for (int x = 0; x < c.width; ++x) {
        c.rate.at(x, y) = static_cast<float>(light[static_cast<std::size_t>(colour_at(c.phase, x, y))]);
      }
    }
    const std::array mixed{(1 - 4 * f) * r + 4 * f * g, (1 - 4 * f) * g + 2 * f * (r + b), (1 - 4 * f) * b + 4 * f * g};
    const Plane<float> out = c.electrons();
    for (int y = 1; y + 1 < c.height; ++y) {
      for (int x = 1; x + 1 < c.width; ++x) {
        const double expected = mixed[static_cast<std::size_t>(colour_at(c.phase, x, y))];
        ASSERT_NEAR(out.at(x, y), expected, float_error * 500) << seed << " " << x << " " << y;
      }
    }
  }
}

TEST(Crosstalk, LosesNoLightAtAnyBorder) {
  for (std::uint32_t seed = 11; seed <= 18; ++seed) {
    Case c(seed);
    c.masked = seed % 2 == 0 ? 2 : 0;
    double before = 0, after = 0, squares = 0;
    for (int y = 0; y < c.height; ++y) {
      for (int x = c.masked; x < c.width; ++x) {
        c.rate.at(x, y) = static_cast<float>(std::exp(c.between(0, 8)));
        before += c.rate.at(x, y);
        squares += c.rate.at(x, y) * c.rate.at(x, y);
      }
    }
    const Plane<float> out = c.electrons();
    for (int y = 0; y < c.height; ++y) {
      for (int x = 0; x < c.width; ++x) {
        after += out.at(x, y);
        EXPECT_GE(out.at(x, y), 0);
        EXPECT_TRUE(x >= c.masked || out.at(x, y) == 0) << "light-shielded";
      }
    }
    EXPECT_NEAR(after, before, float_error * std::sqrt(squares)) << seed;
  }
}

TEST(Crosstalk, MakesItsKernelOfABrightPixelWhereverItIs) {
  for (std::uint32_t seed = 21; seed <= 28; ++seed) {
    Case c(seed);
    c.masked = seed % 2 == 0 ? 2 : 0;
    const int left = c.masked, right = c.width - 1, bottom = c.height - 1;
    const int middle = static_cast<int>(c.between(left, right)), low = static_cast<int>(c.between(0, bottom));
    for (const auto& [x0, y0] : {std::pair{left, 0}, {right, bottom}, {middle, 0}, {left, low}, {middle, low}}) {
      std::fill_n(c.rate.data(), c.rate.size(), 0.0f);
      c.rate.at(x0, y0) = 1000;
      const Plane<float> out = c.electrons();
      int neighbours = 0;
      for (int y = 0; y < c.height; ++y) {
        for (int x = 0; x < c.width; ++x) {
          if (x == x0 && y == y0) continue;
          const bool next = x >= left && std::abs(x - x0) + std::abs(y - y0) == 1;
          neighbours += next ? 1 : 0;
          EXPECT_NEAR(out.at(x, y), next ? 1000 * c.sensor.crosstalk : 0, 1000 * float_error) << x << " " << y;
        }
      }
      EXPECT_NEAR(out.at(x0, y0), 1000 * (1 - neighbours * c.sensor.crosstalk), 1000 * float_error);
    }
  }
}

TEST(Crosstalk, LeavesCountsPoissonDistributedAndNeighboursIndependent) {
  Case c(31);
  c.width = 400;
  c.height = 300;
  c.sensor.crosstalk = 0.05;
  const double mean = 40, n = 400.0 * 300;
  c.rate = test::filled(c.width, c.height, static_cast<float>(mean));
  const Plane<float> out = c.electrons({Effect::crosstalk, Effect::photon_noise});
  const test::SampleMoments found = test::moments_of(test::samples_of(out));
  EXPECT_NEAR(found.mean, mean, 5 * found.mean_error);
  EXPECT_NEAR(found.variance, mean, 5 * found.variance_error);
  double across = 0, down = 0;
  for (int y = 0; y + 1 < c.height; ++y) {
    for (int x = 0; x + 1 < c.width; ++x) {
      across += (out.at(x, y) - mean) * (out.at(x + 1, y) - mean) / n;
      down += (out.at(x, y) - mean) * (out.at(x, y + 1) - mean) / n;
    }
  }
  EXPECT_NEAR(across, 0, 5 * mean / std::sqrt(n));
  EXPECT_NEAR(down, 0, 5 * mean / std::sqrt(n));
}

TEST(Crosstalk, OfAFractionOfZeroOrLeftOutChangesNoByte) {
  Case c(41);
  c.sensor.read_noise_e = 2;
  for (std::size_t i = 0; i < c.rate.size(); ++i) c.rate.data()[i] = static_cast<float>(c.between(0, 100));
  const auto bytes = [&](NoiseSourceSet kept) { return test::samples_of(c.electrons(kept)); };
  const auto left_out = bytes(NoiseSourceSet::all().without(Effect::crosstalk));
  EXPECT_NE(bytes(NoiseSourceSet::all()), left_out);
  c.sensor.crosstalk = 0;
  EXPECT_EQ(bytes(NoiseSourceSet::all()), left_out);
}

/// Mean and variance of the pixels of a colour.
struct ColourMoments {
  double n = 0, mean = 0, variance = 0;
};

ColourMoments moments_of(const Case& c, const PlaneView<const float>& plane, int colour) {
  ColourMoments out;
  double square = 0;
  for (int y = 0; y < plane.height; ++y) {
    for (int x = 0; x < plane.width; ++x) {
      if (static_cast<int>(colour_at(c.phase, x, y)) != colour) continue;
      ++out.n;
      out.mean += plane.at(x, y);
      square += static_cast<double>(plane.at(x, y)) * plane.at(x, y);
    }
  }
  out.mean /= out.n;
  out.variance = square / out.n - out.mean * out.mean;
  return out;
}

/// Compares what a block states of light that is moved with two frames, without and with what moves it.
void expect_moved(const Case& c, const isp::MovedLight& level, const Plane<float>& without, const Plane<float>& with) {
  Plane<float> added(c.width, c.height), moved(c.width, c.height);
  for (std::size_t i = 0; i < with.size(); ++i) {
    added.data()[i] = with.data()[i] - without.data()[i];
    moved.data()[i] = std::fabs(added.data()[i]);
  }
  for (int k = 0; k < 3; ++k) {
    const ColourMoments before = moments_of(c, without.view(), k), after = moments_of(c, with.view(), k);
    const double scale = before.mean * float_error, square = (before.variance + after.variance) * float_error;
    EXPECT_NEAR(level.mean_e[k], after.mean - before.mean, scale);
    EXPECT_NEAR(level.moved_e[k], moments_of(c, moved.view(), k).mean, scale);
    EXPECT_NEAR(level.variance_e2[k], moments_of(c, added.view(), k).variance, square);
    EXPECT_NEAR(level.more_contrast_e2[k], after.variance - before.variance, square);
    double variance = 0;
    for (int y = 0; y < c.height; ++y) {
      for (int x = 0; x < c.width; ++x) {
        if (static_cast<int>(colour_at(c.phase, x, y)) != k) continue;
        const double a = without.at(x, y), b = with.at(x, y);
        variance += isp::count_change_variance_e2(std::min(a, b), std::max(a, b), 1) / before.n;
      }
    }
    EXPECT_NEAR(level.count_variance_e2[k], variance, 10 * scale);
  }
}

TEST(Crosstalk, LevelsOfABlockStateItsMeansAndContrast) {
  for (std::uint32_t seed = 51; seed <= 58; ++seed) {
    Case c(seed);
    c.width = std::min(c.width, isp::effect_block);
    c.height = std::min(c.height, isp::effect_block);
    const auto drawn = [&] {
      Plane<float> out(c.width, c.height);
      for (std::size_t i = 0; i < out.size(); ++i) out.data()[i] = static_cast<float>(std::exp(c.between(0, 6)));
      return out;
    };
    c.rate = drawn();
    if (seed % 2 == 0) c.blurred = drawn();  // any light: levels are those of the two planes
    if (seed % 4 == 0) c.sensor.crosstalk = 0;
    const auto blocks = block_levels(c.frame());
    ASSERT_EQ(blocks.size(), 1u);
    const isp::BlockLevel& block = blocks[0];
    const Plane<float> both = c.electrons({Effect::crosstalk, Effect::lens_blur});
    for (int k = 0; k < 3; ++k) {
      const ColourMoments all = moments_of(c, both.view(), k);
      EXPECT_NEAR(block.signal_e[k], all.mean, all.mean * float_error);
      EXPECT_NEAR(block.contrast.variance_e2[k], all.variance, all.variance * float_error);
    }
    const NoiseSourceSet all = NoiseSourceSet::all();
    expect_moved(c, block.left_out(all), both, both);
    expect_moved(c, block.left_out(all.without(Effect::lens_blur)), c.electrons({Effect::crosstalk}), both);
    expect_moved(c, block.left_out(all.without(Effect::crosstalk)), c.electrons({Effect::lens_blur}), both);
    expect_moved(c, block.left_out({}), c.electrons({}), both);
  }
}

// Grey light stays as it is; the colours of a saturated one mix.
TEST(Crosstalk, IsSimulatedOnlyInTheBlocksThatShowIt) {
  Case c(61);
  c.phase = BayerPhase::rggb;
  c.width = 256;
  c.height = 64;
  c.sensor.crosstalk = 0.01;
  c.sensor.read_noise_e = 2;
  c.rate = test::filled(c.width, c.height, 300);
  for (int y = 0; y < c.height; ++y) {
    for (int x = 0; x < 128; ++x) c.rate.at(x, y) = colour_at(c.phase, x, y) == CfaColour::red ? 600 : 40;
  }
  const auto blocks = block_levels(c.frame());
  const auto developing = isp::developing_of(c.sensor, {}, *isp::rgb_to_xyz(isp::primaries_rec709), {1, 1, 1}, blocks);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const auto change =
        isp::predict_change(c.sensor, {}, developing, blocks[i], NoiseSourceSet::all().without(Effect::crosstalk));
    const std::size_t column = i % 8;  // colours to the left of block 4; grey from there, mixed with them at its border
    EXPECT_TRUE(column >= 4 || change.delta_e > 1) << i;
    EXPECT_TRUE(column <= 4 || change.delta_e == 0) << i;
  }
}

}  // namespace
}  // namespace lowlux::capture::crosstalk_test
