#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <numeric>
#include <random>
#include <vector>

#include "tests/adapter/stage_frames.h"

namespace lowlux {
namespace {

using namespace stage_testing;

TEST(StageStatistics, AreThoseOfAPlainLoop) {
  for (const int bits : {8, 10, 16}) {
    const RawFormatNames& names = names_of_bayer(bits, BayerPhase::gbrg);
    Codes codes = scene(names.format, 75, 46);
    const int largest = largest_code(names.format);
    codes[3] = codes[80] = 0;
    codes[17] = codes[90] = codes[95] = static_cast<std::uint16_t>(largest);
    Rig rig(plain_settings(3), names, 75, 46, LOWLUX_STAGE_BGR888);
    ASSERT_EQ(rig.process(codes, fixed_params(names.format)), LOWLUX_STAGE_OK);
    std::uint64_t sum[3]{}, count[3]{}, clipped = 0, zero = 0;
    std::uint32_t luma[1024]{}, luma64[64]{};
    for (int y = 0; y < 46; ++y) {
      for (int x = 0; x < 75; ++x) {
        const int code = codes[y * 75 + x];
        const auto colour = static_cast<std::size_t>(colour_at(names.format.phase, x & 1, y & 1));
        sum[colour] += code;
        ++count[colour];
        clipped += code >= largest ? 1 : 0;
        zero += code == 0 ? 1 : 0;
        if (x % 2 != 0 || y % 4 != 0 || x + 1 >= 75) continue;  // every second row of cells
        int weighted = 0;
        for (int site = 0; site < 4; ++site) {
          const auto c = static_cast<std::size_t>(colour_at(names.format.phase, site & 1, site >> 1));
          const int weight[] = {77, 75, 29};
          weighted += weight[c] * codes[(y + (site >> 1)) * 75 + x + (site & 1)];
        }
        const int bin = (weighted / 256) * 1024 / (largest + 1);
        ++luma[bin];
        ++luma64[bin / 16];
      }
    }
    const lowlux_stage_statistics& s = rig.statistics;
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(s.sum[c], sum[c]);
      EXPECT_EQ(s.count[c], count[c]);
    }
    EXPECT_FLOAT_EQ(s.clipped, static_cast<float>(clipped) / (75 * 46));
    EXPECT_FLOAT_EQ(s.zero, static_cast<float>(zero) / (75 * 46));
    EXPECT_TRUE(std::equal(std::begin(luma), std::end(luma), s.luma)) << bits;
    EXPECT_TRUE(std::equal(std::begin(luma64), std::end(luma64), s.luma64)) << bits;
  }
}

/// Steps of even light, each 64 columns wide, of a sensor of known gain and read noise.
Codes even_steps(int steps, int rows, double gain_dn, double read_dn, double black_dn, unsigned seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  Codes out;
  out.reserve(static_cast<std::size_t>(steps) * 64 * rows);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < 64 * steps; ++x) {
      const double e = 40.0 * (x / 64);
      std::poisson_distribution<int> poisson(std::max(e, 1e-9));
      const double dn = black_dn + gain_dn * (e > 0 ? poisson(engine) : 0) + read_dn * normal(engine);
      out.push_back(static_cast<std::uint16_t>(std::clamp(std::round(dn), 0.0, 4095.0)));
    }
  }
  return out;
}

TEST(StageStatistics, TellBlackAndNoiseOfSimulatedSteps) {
  constexpr double gain_dn = 2.5, read_dn = 6, black_dn = 200;
  constexpr int steps = 8, rows = 256, frames = 8;
  const RawFormatNames& names = names_of_bayer(12);
  std::vector<double> gains, reads;
  for (unsigned seed = 1; seed <= frames; ++seed) {
    const Codes codes = even_steps(steps, rows, gain_dn, read_dn, black_dn, seed);
    Rig rig(plain_settings(2), names, 64 * steps, rows, LOWLUX_STAGE_BGR888);
    auto params = no_params();
    params.valid = LOWLUX_STAGE_HAS_BLACK;
    std::ranges::fill(params.black_level, static_cast<float>(black_dn));
    ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK);
    gains.push_back(rig.statistics.measured_noise_gain);
    reads.push_back(rig.statistics.measured_noise_read);
    // The darkest hundredth of tiles is below the mean of the dark step, by no more than the scatter of a tile's mean,
    // which has 64 samples of a site at least (tiles are 16 pixels wide or more).
    for (const float black : rig.statistics.measured_black) EXPECT_NEAR(black, black_dn, 5 * read_dn / 8) << seed;
  }
  const auto expect_mean = [](const std::vector<double>& v, double expected, double also) {
    const double mean = std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
    double square = 0;
    for (const double x : v) square += (x - mean) * (x - mean);
    const auto n = static_cast<double>(v.size());
    EXPECT_NEAR(mean, expected, 5 * std::sqrt(square / (n - 1) / n) + also);
  };
  // Five standard errors of the mean over the frames, and the hundredth that TileNoise leaves to detail.
  expect_mean(gains, gain_dn, 0.01 * gain_dn);
  expect_mean(reads, std::sqrt(read_dn * read_dn + 1.0 / 12), 0.01 * read_dn);
}

TEST(StageStatistics, OfFramesWithoutABlackPlaceGiveNoMoreThanAQuarterOfWhiteForBlack) {
  const RawFormatNames& names = names_of_bayer(10);
  for (const std::uint16_t code : {std::uint16_t{1023}, std::uint16_t{700}, std::uint16_t{200}}) {
    Rig rig(plain_settings(), names, 64, 48, LOWLUX_STAGE_BGR888);
    ASSERT_EQ(rig.process(Codes(64 * 48, code), no_params()), LOWLUX_STAGE_OK) << rig.error();
    EXPECT_EQ(rig.result.black_from, LOWLUX_STAGE_FROM_FRAME);
    EXPECT_FLOAT_EQ(rig.result.black_level[0], code == 200 ? 200 : 1023 / 4.0F);
    EXPECT_EQ(rig.statistics.measured_black[0], code) << "what was measured is told as it is";
    if (code == 1023) {
      EXPECT_EQ(rig.planes[0], std::vector<std::uint8_t>(rig.planes[0].size(), 255)) << "white is white";
    }
  }
}

}  // namespace
}  // namespace lowlux
