#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "tests/pipeline/merge/merge_bursts.h"
#include "tests/pipeline/merge/star_nights.h"

namespace lowlux::isp {
namespace {

using test::Burst;
using test::moments_of_stars;
using test::night;
using test::Sky;

MergeOptions by_stars(std::optional<int> reference = 0) {
  return {.alignment = MergeAlignment::stars, .reference = reference};
}

// Drops are tents, whose variance is a sixth of the radius squared: of radius 1 for green, half of the sites, and 4/3
// for the others.
constexpr double variance_of_drops_px2 = (1 + 16.0 / 9) / 2 / 6;

double picture_e(const MergedRaw& merged, int x, int y) { return Burst::signal_e(merged.frame, x, y); }

TEST(MergeStars, KeepFluxAndWidthWhileTheSkyTurns) {
  const Sky sky(3, 150, 1500);
  const Burst burst = night(sky);
  const MergedRaw merged = burst.merged(12, by_stars());
  for (int i = 1; i < 12; ++i) {
    EXPECT_TRUE(merged.frames[i].aligned) << i;
    EXPECT_GT(merged.frames[i].stars_matched, merged.stars / 2) << i;
    EXPECT_GT(merged.frames[i].used_fraction, 0.9) << i;
  }
  const auto found = moments_of_stars(sky, burst, 1, [&](int x, int y) { return picture_e(merged, x, y); });
  const auto truth = moments_of_stars(sky, burst, 1, [&](int x, int y) { return burst.truth_e(x, y); });
  EXPECT_NEAR(found.flux_e / truth.flux_e, 1, 0.01);
  // The reference, one of twelve, is not spread.
  EXPECT_NEAR(found.variance_px2 - truth.variance_px2, 11.0 / 12 * variance_of_drops_px2, 0.04);
}

TEST(MergeStars, NoiseOfTheSkyIsWhatIsStated) {
  Sky sky(4, 200, 1500);
  const Burst burst = night(sky);
  const MergedRaw merged = burst.merged(12, by_stars());
  // Means of 6 x 6 sites of sky, between stars: their variance is that of larger areas.
  double sum = 0, square = 0, n = 0;
  for (int y = 56; y + 6 < 140; y += 6) {
    for (int x = 56; x + 6 < 200; x += 6) {
      double mean = 0, light = 0;
      for (int v = y; v < y + 6; ++v) {
        for (int u = x; u < x + 6; ++u) {
          mean += picture_e(merged, u, v) / 36;
          light = std::max(light, burst.truth_e(u, v));
        }
      }
      if (light > sky.sky_e + 0.5) continue;
      sum += mean;
      square += mean * mean;
      ++n;
    }
  }
  const double variance = 36 * (square / n - std::pow(sum / n, 2)) * n / (n - 1), white_e = test::night_full_e();
  double stated = 0;
  for (const std::size_t c : {0U, 1U, 1U, 2U}) {
    const NoiseProfile& noise = *merged.frame.noise;
    stated += (noise.scale[c] * sky.sky_e / white_e + noise.offset[c]) * white_e * white_e / 4;
  }
  EXPECT_NEAR(sum / n, sky.sky_e, 5 * std::sqrt(variance / 36 / n));
  EXPECT_NEAR(variance / stated, 1, 0.1 + 5 * std::sqrt(2 / n));
  double of_all = 0;
  for (const std::size_t c : {0U, 1U, 1U, 2U}) {
    EXPECT_GT(merged.drop_noise[c], 1.01) << c;
    of_all += merged.frame.noise->scale[c] * white_e / merged.drop_noise[c] / 4;
  }
  EXPECT_NEAR(of_all * merged.mean_count, 1, 1e-3);
}

TEST(MergeStars, SatellitesAreLeftOutOfTheReferenceToo) {
  const Sky sky(5, 200, 1500);
  Burst burst = night(sky);
  burst.disturb = [](RawFrame& frame, int index) {
    if (index % 3 != 0) return;
    for (int x = 0; x < frame.raw.dn.width(); ++x) {
      const int y = 60 + 7 * index + x / 8;
      if (y < frame.raw.dn.height()) frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(frame.raw.dn.at(x, y) + 900);
    }
  };
  const MergedRaw merged = burst.merged(12, by_stars());
  Burst quiet = night(sky);
  const MergedRaw without = quiet.merged(12, by_stars());
  const Rect middle{40, 40, 170, 110};
  EXPECT_LT(quiet.mean_square_error(merged.frame, middle), 1.3 * quiet.mean_square_error(without.frame, middle));
}

TEST(MergeStars, FramesThatHardlyMovedCountAsManyAsTheyAre) {
  const Sky sky(11, 200, 1500);
  Burst burst = night(sky);
  burst.position = [](int, double x, double y) { return std::array{x, y}; };
  EXPECT_NEAR(burst.merged(8, by_stars()).mean_count, 8, 0.1);
  const Burst moved = night(sky);
  const MergedRaw two = moved.merged(2, by_stars());  // sites at which only the edge of a drop lies count as one frame
  EXPECT_GT(two.mean_count, 1.2);
  EXPECT_LT(two.mean_count, 2);
}

TEST(MergeStars, AreAlignedAfterTurnsOfAnyAngle) {
  const Sky sky(12, 200, 1500);
  for (const double turn_deg : {10.0, 30.0, 90.0, 180.0}) {
    Burst burst = night(sky, turn_deg);
    burst.width = 192;  // a square, so that a quarter turn stays within what both show
    burst.position = [turn_deg](int index, double x, double y) {
      const double turn = turn_deg * index * std::numbers::pi / 180, u = x - 95.5, v = y - 95.5;
      return std::array{95.5 + u * std::cos(turn) + v * std::sin(turn), 95.5 - u * std::sin(turn) + v * std::cos(turn)};
    };
    const MergedRaw merged = burst.merged(3, by_stars());
    for (int i = 0; i < 3; ++i) {
      EXPECT_TRUE(merged.frames[i].aligned) << turn_deg;
      EXPECT_GT(merged.frames[i].used_fraction, 0.85) << turn_deg << ", frame " << i;
    }
    const auto found = moments_of_stars(sky, burst, 1, [&](int x, int y) { return picture_e(merged, x, y); });
    const auto truth = moments_of_stars(sky, burst, 1, [&](int x, int y) { return burst.truth_e(x, y); });
    EXPECT_NEAR(found.flux_e / truth.flux_e, 1, 0.03) << turn_deg;
    // After a quarter turn, sites of red and blue lie a pixel beside two of their samples, after a half turn a pixel
    // each way from four of them, and those of green on theirs or between four that weigh nothing: (0.5 + 1) / 3 / 2.
    const double spread_px2 = turn_deg == 90 ? 0.25 : 2.0 / 3 * variance_of_drops_px2;
    EXPECT_NEAR(found.variance_px2 - truth.variance_px2, spread_px2, 0.1) << turn_deg;
  }
}

TEST(MergeStars, ABracketHasTheLightOfItsReference) {
  Sky sky(13, 200, 1500);
  Burst burst = night(sky);
  burst.light = [](int index) { return std::array{1.0, 0.25, 2.0}[static_cast<std::size_t>(index % 3)]; };
  const MergedRaw merged = burst.merged(6, by_stars());
  ASSERT_TRUE(merged.bracket);
  const double white_e = test::night_full_e() * std::exp2(merged.baseline_exposure_ev);
  double sum = 0, n = 0;
  for (int y = 50; y < 140; ++y) {
    for (int x = 50; x < 200; ++x) {
      if (burst.truth_e(x, y) > sky.sky_e + 0.5) continue;
      sum += Burst::signal_e(merged.frame, x, y, white_e);
      ++n;
    }
  }
  EXPECT_NEAR(sum / n, sky.sky_e, 0.01 * sky.sky_e);
}

TEST(MergeStars, OtherStarsAreLeftOut) {
  const Sky sky(6, 200, 1500), other(60, 200, 1500);
  const Burst burst = night(sky), clouded = night(other);
  InlineExecutor one;
  const FrameReader read = [&](int index, bool) {
    const Burst& taken = index == 3 ? clouded : burst;
    return Result<FrameToMerge>({taken.frame(index), burst.options(), index == 3 ? "other.dng" : "stars.dng"});
  };
  const auto merged = merge_frames(6, read, by_stars(), one);
  ASSERT_TRUE(merged) << merged.error().message;
  EXPECT_FALSE(merged->frames[3].aligned);
  EXPECT_EQ(merged->frames[3].used_fraction, 0);
  EXPECT_TRUE(merged->frames[4].aligned);
  ASSERT_FALSE(merged->warnings.empty());
  EXPECT_EQ(merged->warnings.back(),
            "1 of 6 frames were left out (other.dng): their stars do not match those of the reference");
}

TEST(MergeStars, AFrameWithoutStarsIsNoReference) {
  const Burst burst{.mean_e = 20};
  Burst flat = burst;
  flat.scene = [](double, double, int) { return 20.0; };
  InlineExecutor one;
  const FrameReader read = [&](int index, bool) {
    return Result<FrameToMerge>({flat.frame(index), flat.options(), "a.dng"});
  };
  const auto merged = merge_frames(3, read, by_stars(), one);
  ASSERT_FALSE(merged);
  EXPECT_EQ(merged.error().code, ErrorCode::insufficient);
  EXPECT_EQ(merged.error().where, "a.dng");
}

TEST(MergeStars, IsTheSameForAnyNumberOfThreads) {
  const Sky sky(7, 200, 1500);
  const Burst burst = night(sky);
  MergeOptions drizzled = by_stars(), kept = by_stars();
  drizzled.drizzle = merge::DrizzleOptions{.scale = 1.5};
  kept.keep_foreground = true;
  for (const MergeOptions& options : {by_stars(), kept, drizzled}) {
    const MergedRaw once = burst.merged(4, options);
    for (const int threads : {2, 3, 7}) {
      PoolExecutor executor(threads);
      EXPECT_TRUE(test::same_samples(once.frame.raw, burst.merged(4, options, &executor).frame.raw)) << threads;
    }
  }
}

TEST(MergeStars, ALandscapeKeepsItsPlaceWhereAsked) {
  const Sky sky(8, 200, 1500);
  Burst burst = night(sky);
  const auto moving = burst.position;
  constexpr int horizon = 112;
  constexpr double hidden = 1000;  // rows of the sky that the landscape does not hide, and of the landscape
  const auto landscape = [](double x, double y, int colour) { return test::smooth_scene(x, y, colour, 25); };
  burst.scene = [&](double x, double y, int colour) {
    if (y > hidden / 2) return landscape(x, y - hidden, colour);
    if (y < -hidden / 2) return sky.at(x, y + hidden);
    return y >= horizon ? landscape(x, y, colour) : sky.at(x, y);
  };
  burst.position = [moving](int index, double x, double y) {
    if (y >= horizon) return std::array{x, y + hidden};
    const auto [u, v] = moving(index, x, y);
    return std::array{u, v - hidden};
  };
  const auto truth_e = [&](int x, int y) {
    const auto colour = static_cast<int>(colour_at(BayerPhase::grbg, x, y));
    return y >= horizon ? landscape(x, y, colour) : sky.at(x, y);
  };
  const auto error_of = [&](const RawFrame& frame, int from, int to) {
    double sum = 0;
    for (int y = from; y < to; ++y) {
      for (int x = 40; x < 216; ++x) sum += std::pow(Burst::signal_e(frame, x, y) - truth_e(x, y), 2);
    }
    return sum / (176 * (to - from));
  };
  MergeOptions options = by_stars();
  const MergedRaw moved = burst.merged(9, options);
  options.keep_foreground = true;
  const MergedRaw kept = burst.merged(9, options);
  EXPECT_NEAR(kept.still_fraction, 80.0 / 192, 0.1);
  const double single = error_of(burst.frame(0), 128, 184);
  EXPECT_GT(error_of(moved.frame, 128, 184), single);
  EXPECT_LT(error_of(kept.frame, 128, 184), single / 8);
}

TEST(MergeDrizzle, MeasuresColoursFluxAndWidth) {
  const Sky sky(9, 150, 1500);
  const Burst burst = night(sky);
  for (const merge::DrizzleOptions drizzle : {merge::DrizzleOptions{}, {.scale = 2, .pixfrac = 0.6}}) {
    MergeOptions options = by_stars();
    options.drizzle = drizzle;
    const MergedRaw merged = burst.merged(16, options);
    const RawDn& raw = merged.frame.raw;
    ASSERT_EQ(raw.layout, SensorLayout::linear_rgb);
    EXPECT_EQ(raw.active.width, static_cast<int>(burst.width * drizzle.scale));
    EXPECT_EQ(raw.dn.width(), 3 * raw.active.width);
    EXPECT_EQ(raw.active.height, static_cast<int>(burst.height * drizzle.scale));
    const auto truth = moments_of_stars(sky, burst, 1, [&](int x, int y) { return burst.truth_e(x, y); });
    for (int c = 0; c < 3; ++c) {
      const auto found = moments_of_stars(sky, burst, drizzle.scale,
                                          [&](int x, int y) { return Burst::signal_e(merged.frame, 3 * x + c, y); });
      EXPECT_NEAR(found.flux_e / truth.flux_e, 1, 0.03) << c;
      // The pixel of the sensor is in the truth already.
      const double spread = (drizzle.pixfrac * drizzle.pixfrac + 1 / (drizzle.scale * drizzle.scale)) / 12;
      EXPECT_NEAR(found.variance_px2 - truth.variance_px2, spread, 0.08) << c;
    }
  }
}

TEST(MergeDrizzle, WhereNoFrameMatchesTheImageIsFilled) {
  const Sky sky(14, 200, 1500);
  Burst burst = night(sky);
  burst.disturb = [](RawFrame& frame, int index) {  // the same part of every frame shows another scene
    for (int y = 60; y < 120; ++y) {
      for (int x = 60; x < 120; ++x) {
        frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(frame.raw.dn.at(x, y) + 400 + 300 * (index % 4));
      }
    }
  };
  MergeOptions options = by_stars();
  options.drizzle = merge::DrizzleOptions{.scale = 1.5, .pixfrac = 0.9};
  const MergedRaw merged = burst.merged(12, options);
  EXPECT_GT(merged.empty_fraction[0], 0.01);
  for (int y = 0; y < merged.frame.raw.active.height; ++y) {
    for (int x = 0; x < merged.frame.raw.dn.width(); ++x) {
      ASSERT_GT(Burst::signal_e(merged.frame, x, y), 2) << x << ", " << y;
    }
  }
}

TEST(MergeDrizzle, FlatsCorrectWhatTheLensTakesAway) {
  const Sky sky(15, 200, 1500);
  Burst burst = night(sky);
  burst.disturb = [](RawFrame& frame, int) {
    GainMap map{.bottom = 192, .right = 256, .points_v = 192, .points_h = 256};
    map.spacing_v = 1.0 / 191;
    map.spacing_h = 1.0 / 255;
    for (int y = 0; y < 192; ++y) {
      for (int x = 0; x < 256; ++x) {
        map.gain.push_back(static_cast<float>(1 + 0.002 * x + ((x / 2 + y / 2) % 2 == 0 ? 0.05 : -0.05)));
      }
    }
    frame.corrections.gain_maps = {map};
  };
  for (const bool drizzles : {false, true}) {
    MergeOptions options = by_stars();
    if (drizzles) options.drizzle = merge::DrizzleOptions{.scale = 2};
    const MergedRaw merged = burst.merged(6, options);
    ASSERT_EQ(merged.frame.corrections.gain_maps.size(), 1U);
    const GainMap& map = merged.frame.corrections.gain_maps[0];
    EXPECT_EQ(map.right, drizzles ? 512 : 256);
    EXPECT_EQ(map.planes, drizzles ? 3 : 1);
    for (int x = 40; x < 216; ++x) EXPECT_NEAR(map.gain[96 * 256 + x], 1 + 0.002 * x, 0.005) << x;
  }
}

TEST(MergeDrizzle, FramesThatStandStillOrDifferInExposureAreRefused) {
  const Sky sky(10, 200, 1500);
  Burst burst = night(sky);
  InlineExecutor one;
  const auto refused = [&](const Burst& of, const MergeOptions& options) {
    const FrameReader read = [&](int index, bool) { return Result<FrameToMerge>({of.frame(index), of.options()}); };
    const auto merged = merge_frames(4, read, options, one);
    return !merged && merged.error().code == ErrorCode::invalid_argument;
  };
  MergeOptions options = by_stars();
  options.drizzle = merge::DrizzleOptions{};
  Burst bracket = burst;
  bracket.light = [](int index) { return index == 2 ? 0.25 : 1.0; };
  EXPECT_TRUE(refused(bracket, options));
  Burst still = burst;
  still.position = {};
  options.alignment = std::nullopt;
  EXPECT_TRUE(refused(still, options));
  EXPECT_FALSE(refused(burst, options));
}

}  // namespace
}  // namespace lowlux::isp
