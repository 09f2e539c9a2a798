#include "isp/raw/measure/tile_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "isp/base/plane.h"
#include "isp/base/random/random.h"
#include "tests/support/tile_columns.h"

namespace lowlux::isp {
namespace {

struct Camera {
  double gain_dn;
  double read_e;
  double black_dn;
  int bits;

  double white_dn() const { return std::exp2(bits) - 1; }
  double offset_dn2() const { return gain_dn * gain_dn * read_e * read_e + 1.0 / 12; }
  /// Within 1000 e- and 0.85 of white.
  double max_e() const { return std::min(1000.0, 0.85 * (white_dn() - black_dn) / gain_dn); }
};
constexpr Camera ten_bits{0.24, 2, 64, 10}, twelve_bits{1, 1, 256, 12};

/// Electrons by column.
struct Light {
  double min_e;
  double max_e;
  int steps = 0;  // 0: rises evenly, in the logarithm
  double at(int x, int width) const {
    double t = static_cast<double>(x) / width;
    if (steps > 0) t = std::floor(t * steps) / std::max(1, steps - 1);
    return min_e * std::pow(max_e / min_e, t);
  }
};

Plane<std::uint16_t> frame_of(const Camera& camera, const Light& light, int side, std::uint64_t seed) {
  Plane<std::uint16_t> out(side, side);
  std::vector<float> mean(side), electrons(side), normal(side);
  for (int x = 0; x < side; ++x) mean[x] = static_cast<float>(light.at(x, side));
  for (int y = 0; y < side; ++y) {
    const auto row = static_cast<std::uint32_t>(y);
    poisson_row({.seed = seed}, 0, row, mean, electrons);
    normal_row({.seed = seed}, 0, row, 1, normal);
    for (int x = 0; x < side; ++x) {
      const double e = static_cast<double>(electrons[x]) + camera.read_e * static_cast<double>(normal[x]);
      const double dn = std::clamp(camera.black_dn + camera.gain_dn * e, 0.0, camera.white_dn());
      out.at(x, y) = static_cast<std::uint16_t>(std::lround(dn));
    }
  }
  return out;
}

TileNoise measured(const Plane<std::uint16_t>& frame, int tile = 16) {
  TileNoise out(frame.width(), frame.height(), tile);
  test::measure(frame, out);
  return out;
}

std::optional<NoiseLine> line_of(const Camera& camera, const Plane<std::uint16_t>& frame) {
  const double black = camera.black_dn;
  return measured(frame).line({black, black, black, black}, camera.white_dn());
}

TEST(TileNoise, FindsGainAndOffsetOfFlatsAndSlopesWithinItsOwnErrors) {
  for (const Camera& camera : {ten_bits, twelve_bits, Camera{4, 1.5, 256, 12}, Camera{8, 0.3, 256, 12}}) {
    for (const Light& light : {Light{1, camera.max_e(), 8}, Light{1, camera.max_e()}}) {
      const auto line = line_of(camera, frame_of(camera, light, 512, 3));
      ASSERT_TRUE(line);
      EXPECT_NEAR(line->gain_dn, camera.gain_dn, 5 * line->gain_error_dn);
      EXPECT_NEAR(line->offset_dn2, camera.offset_dn2(), 5 * line->offset_error_dn2);
      EXPECT_LT(line->gain_error_dn, 0.02 * camera.gain_dn);
    }
  }
}

// Where chance rules: of small frames. The spread of 50 results has an error of a tenth itself.
TEST(TileNoise, StatesTheErrorsItsResultsHave) {
  for (const Camera& camera : {ten_bits, twelve_bits}) {
    constexpr int frames = 50;
    double gain = 0, gain2 = 0, offset = 0, offset2 = 0, gain_error = 0, offset_error = 0;
    for (int i = 0; i < frames; ++i) {
      const auto seed = static_cast<std::uint64_t>(i);
      const auto line = line_of(camera, frame_of(camera, {1, camera.max_e(), 6}, 256, seed));
      ASSERT_TRUE(line);
      gain += line->gain_dn / frames;
      gain2 += line->gain_dn * line->gain_dn / frames;
      offset += line->offset_dn2 / frames;
      offset2 += line->offset_dn2 * line->offset_dn2 / frames;
      gain_error += line->gain_error_dn / frames;
      offset_error += line->offset_error_dn2 / frames;
    }
    const double gain_ratio = std::sqrt(gain2 - gain * gain) / gain_error;
    const double offset_ratio = std::sqrt(offset2 - offset * offset) / offset_error;
    EXPECT_GT(gain_ratio, 1 / 1.5);
    EXPECT_LT(gain_ratio, 1.5);
    EXPECT_GT(offset_ratio, 1 / 1.5);
    EXPECT_LT(offset_ratio, 1.5);
    // A bias that shows in the mean of 50 would be of the method.
    EXPECT_NEAR(gain, camera.gain_dn, gain_error);
    EXPECT_NEAR(offset, camera.offset_dn2(), offset_error);
  }
}

// Noise below half a code: what tiles show of it depends on where their means lie, and many show none.
TEST(TileNoise, NoiseThatRoundingHidesDoesNotFoolIt) {
  const Camera coarse{0.03, 4, 64, 10};  // dark noise 0.12 DN
  const auto line = line_of(coarse, frame_of(coarse, {1, 1000, 8}, 512, 5));
  ASSERT_TRUE(line);
  EXPECT_NEAR(line->gain_dn, coarse.gain_dn, 5 * line->gain_error_dn);
  const Camera very_coarse{0.005, 4, 64, 10};  // 0.16 DN at 1000 e-
  EXPECT_FALSE(line_of(very_coarse, frame_of(very_coarse, {1, 1000, 8}, 512, 5)));
}

TEST(TileNoise, OneLevelTellsNoGain) {
  EXPECT_FALSE(line_of(ten_bits, frame_of(ten_bits, {100, 100, 1}, 512, 6)));
  EXPECT_FALSE(line_of(ten_bits, frame_of(ten_bits, {1e-3, 1e-3, 1}, 512, 6)));
}

TEST(TileNoise, ClippedFramesTellNothing) {
  const Camera clipping{4, 1.5, 256, 10};
  EXPECT_FALSE(line_of(clipping, frame_of(clipping, {5000, 9000, 4}, 512, 7)));
  Plane<std::uint16_t> white(512, 512);
  std::fill_n(white.data(), white.size(), std::uint16_t{1023});
  EXPECT_FALSE(line_of(ten_bits, white));
}

TEST(TileNoise, FramesOfFewTilesTellNothing) {
  EXPECT_FALSE(line_of(ten_bits, frame_of(ten_bits, {1, 1000}, 64, 8)));
  EXPECT_FALSE(line_of(ten_bits, frame_of(ten_bits, {1, 1000}, 10, 8)));
  const Plane<std::uint16_t> small = frame_of(ten_bits, {1, 1000}, 10, 8);
  EXPECT_EQ(measured(small).darkest_dn(), (PerSite<double>{}));
}

// A slope has no noise: all differences are the same.
TEST(TileNoise, ASlopeAddsNothing) {
  Plane<std::uint16_t> noisy = frame_of(twelve_bits, {1, 400, 8}, 512, 9);
  const auto flat = line_of(twelve_bits, noisy);
  for (int y = 0; y < noisy.height(); ++y) {
    for (int x = 0; x < noisy.width(); ++x) noisy.at(x, y) = static_cast<std::uint16_t>(noisy.at(x, y) + 5 * (x % 16));
  }
  const auto sloped = measured(noisy).line({291, 296, 291, 296}, 4095);  // 7 or 8 steps of 5 DN above 256
  ASSERT_TRUE(flat && sloped);
  EXPECT_NEAR(sloped->gain_dn, flat->gain_dn, flat->gain_error_dn);
}

TEST(TileNoise, TheDarkestPlaceIsFoundSiteBySite) {
  Plane<std::uint16_t> frame = frame_of(ten_bits, {50, 1000}, 512, 10);
  const Plane<std::uint16_t> dark = frame_of(ten_bits, {1e-3, 1e-3, 1}, 64, 11);
  constexpr PerSite<int> above{0, 3, 5, 9};
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) frame.at(192 + x, 256 + y) = dark.at(x, y);
  }
  for (int y = 0; y < 512; ++y) {
    for (int x = 0; x < 512; ++x) {
      frame.at(x, y) = static_cast<std::uint16_t>(frame.at(x, y) + above[site_of(x, y)]);
    }
  }
  TileNoise tiles = measured(frame);
  const PerSite<double> darkest = tiles.darkest_dn();
  // 16 of 1024 tiles are dark, the quantile is the 11th of them; a tile's mean has 64 pixels of each site.
  const double tile_std_dn = std::sqrt(ten_bits.offset_dn2() / 64);
  for (int site = 0; site < 4; ++site) EXPECT_NEAR(darkest[site], 64 + above[site], 3 * tile_std_dn);
}

TEST(TileNoise, ClearForgetsTheFrameBefore) {
  const Plane<std::uint16_t> frame = frame_of(ten_bits, {1, 1000}, 256, 12);
  TileNoise tiles = measured(frame);
  const auto once = tiles.line({64, 64, 64, 64}, 1023);
  tiles.clear();
  test::measure(frame, tiles);
  const auto again = tiles.line({64, 64, 64, 64}, 1023);
  ASSERT_TRUE(once && again);
  EXPECT_EQ(once->gain_dn, again->gain_dn);
  EXPECT_EQ(once->offset_dn2, again->offset_dn2);
}

}  // namespace
}  // namespace lowlux::isp
