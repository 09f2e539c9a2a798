#include "calib/picture/noise_samples.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "tests/support/frames.h"

namespace lowlux::calib {
namespace {

constexpr SamplePlan all_samples{{}, 1'000'000};

bool is_green(BayerPhase phase, int x, int y) { return colour_at(phase, x, y) == CfaColour::green; }

NoiseSamples blocks_of(const RawDn& raw, const SamplePlan& plan = all_samples) {
  InlineExecutor executor;
  return block_samples(raw, plan, executor);
}

TEST(BlockSamples, KeepColoursApartInEveryPhase) {
  for (const auto phase : {BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr}) {
    const RawDn raw = test::bayer_frame(
        128, 96, phase, [&](int x, int y) { return 100 * (1 + static_cast<int>(colour_at(phase, x, y))); });
    PerSite<int> samples{};
    for (const NoiseSample& s : blocks_of(raw).sample) {
      const int level = 100 * (1 + static_cast<int>(colour_at(phase, s.site & 1, s.site >> 1)));
      EXPECT_EQ(s.mean_dn, level);
      EXPECT_EQ(s.around_dn, level);
      EXPECT_NEAR(s.low_dn2 + s.middle_dn2 + s.high_dn2, 0, 1e-6);  // DN^2; float sums of zeros
      ++samples[s.site];
    }
    const int upper = is_green(phase, 0, 0) ? 0 : 1;
    EXPECT_GT(samples[upper], 0);
    EXPECT_EQ(samples[3 - upper], 0);  // both greens are one lattice
    EXPECT_GT(samples[1 - upper], 0);
    EXPECT_GT(samples[2 + upper], 0);
  }
}

TEST(BlockSamples, OfAMonochromeSensorAreThoseOfFourSites) {
  RawDn raw = test::bayer_frame(96, 96, BayerPhase::rggb, [](int x, int y) { return 100 * (1 + site_of(x, y)); });
  raw.layout = SensorLayout::monochrome;
  PerSite<int> samples{};
  for (const NoiseSample& s : blocks_of(raw).sample) {
    EXPECT_EQ(s.mean_dn, 100 * (1 + s.site));
    ++samples[s.site];
  }
  for (const int n : samples) EXPECT_EQ(n, 25);  // 48 sites less twice the border of 2 hold 5 blocks of 8
}

TEST(BlockSamples, SubtractTheBlackOfEachGreen) {
  const RawDn raw = test::bayer_frame(96, 96, BayerPhase::rggb, [](int x, int y) { return 500 + 10 * site_of(x, y); });
  for (const NoiseSample& s : blocks_of(raw, {{100, 110, 120, 130}, 1'000'000}).sample) {
    EXPECT_EQ(s.mean_dn, 400);
    EXPECT_NEAR(s.high_dn2, 0, 1e-6);
  }
}

TEST(BlockSamples, OfGreensHoldEveryPixelAtMostOnce) {
  int held = 0, tried = 0;
  for (int y = 0; y < 64; y += 3) {
    for (int x = 1 - (y & 1); x < 64; x += 6) {
      RawDn raw = test::bayer_frame(64, 64, BayerPhase::rggb, [](int, int) { return 100; });
      raw.dn.at(x, y) = 164;
      const auto blocks = blocks_of(raw);
      const auto holders = std::count_if(blocks.sample.begin(), blocks.sample.end(), [](const NoiseSample& s) {
        return s.mean_dn > 100.5F;  // a 64th of 64 DN more
      });
      EXPECT_LE(holders, 1) << x << ' ' << y;
      held += static_cast<int>(holders);
      ++tried;
    }
  }
  EXPECT_GT(2 * held, tried);  // what is left out lies along the borders
}

TEST(BlockSamples, HaveSurroundingsOfTheSameMeanOnASlope) {
  const RawDn raw = test::bayer_frame(160, 160, BayerPhase::rggb, [](int x, int y) { return 100 + 3 * x + 2 * y; });
  for (const NoiseSample& s : blocks_of(raw).sample) {
    EXPECT_NEAR(s.mean_dn, s.around_dn, 2e-3);  // DN, of up to 900: float sums of 80 values
    EXPECT_LT(s.high_dn2, 0.2);                 // DN^2, of 27 details; the slope has several hundred within a block
  }
}

TEST(BlockSamples, LeaveMostOfADifferenceOfTheGreensOutOfTheFinestDetails) {
  const RawDn raw = test::bayer_frame(96, 96, BayerPhase::rggb, [](int, int y) { return 100 + 2 * (y & 1); });
  for (const NoiseSample& s : blocks_of(raw).sample) {
    if (s.site != 1) continue;
    // +-1 DN are 64 DN^2 in a block. (1 / (2 sin(pi / 16)))^4 / 64 = 67 % of it is in the detail that is left out.
    const double rest = 64 - std::pow(0.5 / std::sin(M_PI / 16), 4);
    EXPECT_LT(s.high_dn2, rest / 27);
  }
}

TEST(BlockSamples, AreLeftOutRowByRowBeyondTheMost) {
  const RawDn raw = test::bayer_frame(512, 512, BayerPhase::rggb, [](int, int) { return 100; });
  const auto all = blocks_of(raw).sample.size(), few = blocks_of(raw, {{}, 1000}).sample.size();
  EXPECT_GT(all, 3000U);
  EXPECT_LT(few, 1200U);  // rows of up to 31 blocks, rounded up for three lattices
  EXPECT_GT(few, 700U);
  EXPECT_TRUE(blocks_of(test::bayer_frame(20, 20, BayerPhase::rggb, [](int, int) { return 1; })).sample.empty());
}

TEST(DetailSamples, OfGreensSeeNoOtherColour) {
  const RawDn raw = test::bayer_frame(
      64, 64, BayerPhase::gbrg, [](int x, int y) { return is_green(BayerPhase::gbrg, x, y) ? 300 : 17 * (x % 7); });
  InlineExecutor executor;
  int greens = 0;
  for (const NoiseSample& s : detail_samples(raw, all_samples, executor).sample) {
    if (!is_green(BayerPhase::gbrg, s.site & 1, s.site >> 1)) continue;
    EXPECT_EQ(s.mean_dn, 300);
    EXPECT_EQ(s.high_dn2, 0);
    EXPECT_EQ(s.low_dn2, 0);
    ++greens;
  }
  EXPECT_GT(greens, 200);
}

}  // namespace
}  // namespace lowlux::calib
