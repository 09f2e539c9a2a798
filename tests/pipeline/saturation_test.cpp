#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "isp/pipeline/develop.h"
#include "isp/pipeline/finished/clean_raw.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "tests/pipeline/saturated_night.h"
#include "tests/support/executors.h"

/// Sensors that saturate below the white level that their files state.
namespace lowlux::isp {
namespace {

using Rgb = std::array<double, 3>;
using test::Burst;
using test::one_thread;
using test::saturated_night;
using test::Saturation;
using test::sign;

/// Mean signal of each colour on the inner part of the sign [e-].
Rgb sign_of(const RawFrame& frame, double white_e) {
  Rgb sum{}, count{};
  for (int y = sign.y + 8; y < sign.y + sign.height - 8; ++y) {
    for (int x = sign.x + 8; x < sign.x + sign.width - 8; ++x) {
      const auto c = static_cast<std::size_t>(colour_at(BayerPhase::grbg, x, y));
      sum[c] += Burst::signal_e(frame, x, y, white_e);
      count[c] += 1;
    }
  }
  return {sum[0] / count[0], sum[1] / count[1], sum[2] / count[2]};
}

Rgb sign_of(const SceneLinear& image) {
  Rgb sum{};
  for (std::size_t c = 0; c < 3; ++c) {
    for (int y = sign.y + 8; y < sign.y + sign.height - 8; ++y) {
      for (int x = sign.x + 8; x < sign.x + sign.width - 8; ++x) sum[c] += image.plane[c].at(x, y);
    }
  }
  return sum;
}

TEST(SaturationBelowWhite, LampsAreWhiteInImagesAndCleanRaws) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const Saturation saturation = Saturation::draw(seed);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ": saturates at " << saturation.level_dn << " +- "
                                    << saturation.scatter_dn << " DN");
    const Burst burst = saturated_night(saturation, {40000, 80000, 50000});  // white, ten times saturation
    const RawFrame frame = burst.frame(0);
    DevelopOptions image = burst.options();
    image.exposure_ev = 0;
    image.tone = ToneCurve::none;
    image.space = OutputSpace::linear_srgb;
    image.samples = SampleType::f32;
    const auto made = develop(frame, image, one_thread);
    ASSERT_TRUE(made) << made.error().message;
    ASSERT_TRUE(made->plan.levels.saturation);
    EXPECT_NEAR(made->plan.levels.saturation->mean_dn, saturation.level_dn, 8);
    const Rgb rgb = sign_of(std::get<SceneLinear>(made->picture));
    EXPECT_NEAR(rgb[0] / rgb[1], 1, 0.002);
    EXPECT_NEAR(rgb[2] / rgb[1], 1, 0.002);
    image.highlights = Highlights::reconstruct;
    const auto rebuilt = plan_develop(frame, image, one_thread);
    ASSERT_TRUE(rebuilt) << rebuilt.error().message;
    const double from_dn = made->plan.levels.saturation->from_dn();
    for (const double fraction : rebuilt->saturation) {
      EXPECT_NEAR(fraction, (from_dn - test::night_black_dn) / (test::night_white_dn - test::night_black_dn), 1e-12);
    }
    DevelopOptions options = burst.options();
    options.denoise.mode = DenoiseChoice::Mode::level;
    const auto clean = clean_raw(frame, options, one_thread);
    ASSERT_TRUE(clean) << clean.error().message;
    int saturated = 0, white = 0;
    for (int y = 0; y < burst.height; ++y) {
      for (int x = 0; x < burst.width; ++x) {
        if (frame.raw.dn.at(x, y) < saturation.level_dn - 2 * saturation.scatter_dn - 1) continue;
        ++saturated;
        white += clean->frame.raw.dn.at(x, y) == 65535 ? 1 : 0;
      }
    }
    EXPECT_EQ(white, saturated);
    EXPECT_GT(saturated, 2000);
  }
}

TEST(SaturationBelowWhite, CanBeLeftOut) {
  const Burst burst = saturated_night(Saturation::draw(1), {40000, 80000, 50000});
  DevelopOptions options = burst.options();
  options.find_saturation = false;
  const auto plan = plan_develop(burst.frame(0), options, one_thread);
  ASSERT_TRUE(plan) << plan.error().message;
  EXPECT_FALSE(plan->levels.saturation);
  EXPECT_EQ(plan->saturation, (Rgb{1, 1, 1}));
}

TEST(SaturationBelowWhite, LampsOfBracketsKeepTheirColour) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const Saturation saturation = Saturation::draw(seed);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ": saturates at " << saturation.level_dn << " +- "
                                    << saturation.scatter_dn << " DN");
    Burst burst = saturated_night(saturation, {40000, 20000, 8000});
    burst.light = [](int index) { return std::array{1.0, 1.0 / 16, 1.0 / 4}[static_cast<std::size_t>(index)]; };
    const MergedRaw merged = burst.merged(3, {.reference = 0});
    EXPECT_TRUE(merged.saturation);
    const Rgb found = sign_of(merged.frame, 16 * test::night_full_e());
    EXPECT_NEAR(found[0], 40000, 400);
    EXPECT_NEAR(found[1], 20000, 200);
    EXPECT_NEAR(found[2], 8000, 120);
  }
}

/// Returns the level that a frame shows alone.
std::optional<SaturationLevel> shown_by(const Burst& burst, int index) {
  const RawFrame frame = burst.frame(index);
  const auto plan = plan_develop(frame, burst.options(), one_thread);
  EXPECT_TRUE(plan);
  return plan ? plan->levels.saturation : std::nullopt;
}

TEST(SaturationBelowWhite, BracketsUseTheLowestLevelOfTheirFramesIfTheReferenceShowsNone) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const Saturation saturation = Saturation::draw(seed);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ": saturates at " << saturation.level_dn << " +- "
                                    << saturation.scatter_dn << " DN");
    Burst burst = saturated_night(saturation, {40000, 20000, 8000});
    burst.light = [](int index) { return std::array{1.0 / 64, 1.0, 1.0 / 4}[static_cast<std::size_t>(index)]; };
    EXPECT_FALSE(shown_by(burst, 0));
    const auto bright = shown_by(burst, 1), medium = shown_by(burst, 2);
    ASSERT_TRUE(bright || medium);
    double lowest_dn = INFINITY;
    for (const auto& shown : {bright, medium}) {
      if (shown) lowest_dn = std::min(lowest_dn, shown->from_dn());
    }
    const MergedRaw merged = burst.merged(3, {.reference = 0});
    ASSERT_TRUE(merged.saturation);
    EXPECT_EQ(merged.saturation->from_dn(), lowest_dn);
    const Rgb found = sign_of(merged.frame, test::night_full_e());
    EXPECT_NEAR(found[0], 40000.0 / 64, 10);
    EXPECT_NEAR(found[1], 20000.0 / 64, 5);
    EXPECT_NEAR(found[2], 8000.0 / 64, 3);
  }
}

TEST(SaturationBelowWhite, LampsThatTheFirstFrameDoesNotShowAreWhiteInTheMean) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const Saturation saturation = Saturation::draw(seed);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ": saturates at " << saturation.level_dn << " +- "
                                    << saturation.scatter_dn << " DN");
    Burst burst = saturated_night(saturation, {40000, 80000, 50000});
    burst.disturb = [saturation](RawFrame& frame, int index) {
      saturation.limit(frame, index);
      if (index > 0) return;
      for (std::size_t i = 0; i < frame.raw.dn.size(); ++i) {  // the lamps were off
        frame.raw.dn.data()[i] = std::min<std::uint16_t>(frame.raw.dn.data()[i], 1000);
      }
    };
    EXPECT_FALSE(shown_by(burst, 0));
    const MergedRaw merged = burst.merged(4);
    ASSERT_TRUE(merged.saturation);
    EXPECT_NEAR(merged.saturation->mean_dn, saturation.level_dn, 8);
    const Rect inner{sign.x + 8, sign.y + 8, sign.width - 16, sign.height - 16};
    for (int y = inner.y; y < inner.y + inner.height; ++y) {
      for (int x = inner.x; x < inner.x + inner.width; ++x) ASSERT_EQ(merged.frame.raw.dn.at(x, y), 65535);
    }
  }
}

TEST(SaturationBelowWhite, AFrameThatIsSaturatedInMostPixelsIsNotTheReference) {
  Burst burst = saturated_night(Saturation::draw(2), {40000, 20000, 8000});
  burst.light = [](int index) { return std::array{1.0, 40.0}[static_cast<std::size_t>(index)]; };
  EXPECT_EQ(burst.merged(2).reference, 0);
}

TEST(SaturationBelowWhite, SurfacesThatAreEvenlyLitKeepTheirBits) {
  // The brightest surface of a dim scene: white, magenta by its filters, or with equal codes in all colours.
  for (const Rgb& share : {Rgb{0.5, 1, 0.625}, Rgb{1, 0.6, 1}, Rgb{1, 1, 1}}) {
    Burst burst =
        saturated_night({1e9, 0}, {0.85 * share[0] * test::night_full_e(), 0.85 * share[1] * test::night_full_e(),
                                   0.85 * share[2] * test::night_full_e()});
    burst.scene = [scene = burst.scene](double x, double y, int colour) {
      const bool is_sign = x < sign.x + sign.width && y < sign.y + sign.height;
      return is_sign ? scene(x, y, colour) : 0.01 * scene(x, y, colour);
    };
    const auto with = [&](bool find) {
      DevelopOptions options = burst.options();
      options.find_saturation = find;
      return options;
    };
    DevelopOptions clean[2] = {with(false), with(true)};
    Result<CleanRaw> cleaned[2];
    Result<MergedRaw> merged[2];
    for (int i = 0; i < 2; ++i) {
      clean[i].denoise.mode = DenoiseChoice::Mode::level;
      cleaned[i] = clean_raw(burst.frame(0), clean[i], one_thread);
      const FrameReader read = [&](int index, bool) {
        return Result<FrameToMerge>({burst.frame(index), with(i == 1)});
      };
      merged[i] = merge_frames(3, read, {}, one_thread);
      ASSERT_TRUE(cleaned[i] && merged[i]);
    }
    EXPECT_FALSE(merged[1]->saturation);
    EXPECT_TRUE(test::same_samples(cleaned[0]->frame.raw, cleaned[1]->frame.raw));
    EXPECT_TRUE(test::same_samples(merged[0]->frame.raw, merged[1]->frame.raw));
  }
}

}  // namespace
}  // namespace lowlux::isp
