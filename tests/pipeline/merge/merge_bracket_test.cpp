#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "isp/base/noise_ratio.h"
#include "tests/pipeline/merge/merge_bursts.h"

namespace lowlux::isp {
namespace {

using test::Burst;

/// A ramp from 1 to 50,000 e- in the light of the first frame; it saturates at 3968 e-.
Burst ramp(const std::vector<double>& lights) {
  Burst burst{.width = 1024, .height = 64};
  burst.scene = [](double x, double, int) { return std::pow(10, 4.7 * x / 1023); };
  burst.light = [lights](int index) { return lights[static_cast<std::size_t>(index)]; };
  return burst;
}

/// Holds what a merge did to a column.
struct Column {
  double bias_e = 0;
  double variance_e2 = 0;
};

Column column_of(const Burst& burst, const RawFrame& frame, int x, double white_e) {
  Column out;
  for (int y = 0; y < burst.height; ++y) {
    const double error = Burst::signal_e(frame, x, y, white_e) - burst.truth_e(x, y);
    out.bias_e += error / burst.height;
    out.variance_e2 += error * error / burst.height;
  }
  return out;
}

/// Returns the variance of the best weighted mean of the exposures that do not saturate at a signal.
double best_variance(const std::vector<double>& lights, double signal_e, double read_e) {
  double weight = 0;
  for (const double light : lights) {
    if (light * signal_e < 0.85 * test::night_full_e()) {
      weight += light * light / (light * signal_e + read_e * read_e + 1.0 / 192);
    }
  }
  return 1 / weight;
}

TEST(MergeBracket, EightStopsAreUnbiasedAndNearTheBestWeightsAtEveryLevel) {
  const std::vector<double> lights{1, 16, 1.0 / 16};
  const Burst burst = ramp(lights);
  const MergedRaw merged = burst.merged(3, {.reference = 0});
  ASSERT_TRUE(merged.bracket);
  EXPECT_EQ(merged.alignment, MergeAlignment::none);
  EXPECT_TRUE(merged.frame.raw.is_float());  // 16 bits would be coarser than the noise
  EXPECT_NEAR(merged.baseline_exposure_ev, 4, 0.05);
  EXPECT_NEAR(merged.frame.raw.info.exposure_s.value(), 0.1 / 16, 0.05 * 0.1 / 16);  // white is that of the shortest
  const double white_e = 16 * test::night_full_e();
  double bias_chi_square = 0, excess = 0;
  int count = 0;
  for (int x = 0; x < 1024; ++x) {
    const Column column = column_of(burst, merged.frame, x, white_e);
    const double best = best_variance(lights, burst.truth_e(x, 0), 2);
    bias_chi_square += column.bias_e * column.bias_e / (best / burst.height);
    excess += column.variance_e2 / best;
    ++count;
  }
  EXPECT_LT(excess / count, 1.15);          // weights fade towards saturation, and are not those of the truth
  EXPECT_LT(bias_chi_square / count, 1.3);  // 1 without any bias
}

TEST(MergeBracket, ThereIsNoSeamWhereAnExposureSaturatesThoughItsTimeIsWrong) {
  // Shutters of 1/16 and 16 times the time that let 8 % more and 6 % less light through than the file states.
  Burst burst = ramp({1, 16 * 0.94, 1.08 / 16});
  const FrameReader read = [&](int index, bool) {
    RawFrame frame = burst.frame(index);
    frame.raw.info.exposure_s = 0.1 * std::array{1.0, 16.0, 1.0 / 16}[static_cast<std::size_t>(index)];
    return Result<FrameToMerge>({std::move(frame), burst.options()});
  };
  InlineExecutor executor;
  const auto merged = merge_frames(3, read, {.reference = 0}, executor);
  ASSERT_TRUE(merged) << merged.error().message;
  EXPECT_NEAR(merged->frames[1].light, 16 * 0.94, 0.1);
  EXPECT_NEAR(merged->frames[2].light, 1.08 / 16, 0.0003);
  const double white_e = test::night_full_e() / merged->frames[2].light;
  for (int x0 = 0; x0 < 1024; x0 += 32) {
    double relative = 0, error2 = 0;
    for (int x = x0; x < x0 + 32; ++x) {
      const Column column = column_of(burst, merged->frame, x, white_e);
      const double truth = burst.truth_e(x, 0);
      relative += column.bias_e / truth / 32;
      error2 += best_variance({1, 16 * 0.94, 1.08 / 16}, truth, 2) / (truth * truth) / (32.0 * 32 * burst.height);
    }
    EXPECT_LT(std::fabs(relative), 0.006 + 5 * std::sqrt(error2)) << x0;
  }
}

TEST(MergeBracket, LampsKeepTheirColourAndWhatSaturatesEverywhereIsWhite) {
  Burst burst{.width = 128, .height = 128};
  burst.light = [](int index) { return std::array{1.0, 1.0 / 16}[static_cast<std::size_t>(index)]; };
  burst.scene = [](double x, double y, int colour) {
    if (x >= 32 && x < 64 && y >= 32 && y < 64)
      return std::array{40000.0, 20000.0, 5000.0}[static_cast<std::size_t>(colour)];
    if (x >= 80 && x < 90 && y >= 80 && y < 90) return 500000.0;
    return 20.0;
  };
  const MergedRaw merged = burst.merged(2);
  const double white_e = 16 * test::night_full_e();
  std::array<double, 3> sum{}, count{};
  for (int y = 36; y < 60; ++y) {
    for (int x = 36; x < 60; ++x) {
      const auto c = static_cast<std::size_t>(colour_at(BayerPhase::grbg, x, y));
      sum[c] += Burst::signal_e(merged.frame, x, y, white_e);
      count[c] += 1;
    }
  }
  EXPECT_NEAR(sum[0] / count[0], 40000, 300);
  EXPECT_NEAR(sum[1] / count[1], 20000, 150);
  EXPECT_NEAR(sum[2] / count[2], 5000, 100);
  for (int y = 82; y < 88; ++y) {
    for (int x = 82; x < 88; ++x) EXPECT_GE(Burst::signal_e(merged.frame, x, y, white_e), white_e);
  }
}

TEST(MergeBracket, WhereSomethingMovedSaturatedBlocksShowOneFrame) {
  using Rgb = std::array<double, 3>;
  const Rgb before{20000, 1000, 300}, after{300, 20000, 1000};  // red saturates in the long frame, and nothing after
  const Rect object{32, 40, 64, 48};
  Burst burst{.width = 384, .height = 256};
  burst.light = [](int index) { return std::array{1.0, 1.0 / 16}[static_cast<std::size_t>(index)]; };
  const auto is_inside = [&](double x, double y) {
    return x >= object.x && x < object.x + object.width && y >= object.y && y < object.y + object.height;
  };
  burst.scene = [&](double x, double y, int colour) {
    return is_inside(x, y) ? before[static_cast<std::size_t>(colour)] : test::textured(x, y, colour, 400);
  };
  burst.disturb = [&](RawFrame& frame, int index) {
    if (index == 0) return;
    for (int y = object.y; y < object.y + object.height; ++y) {
      for (int x = object.x; x < object.x + object.width; ++x) {
        const double e = after[static_cast<std::size_t>(colour_at(BayerPhase::grbg, x, y))] / 16;
        frame.raw.dn.at(x, y) =
            static_cast<std::uint16_t>(std::lround(test::night_black_dn + test::night_gain_dn_per_e * e));
      }
    }
  };
  for (const auto alignment : {MergeAlignment::none, MergeAlignment::cells, MergeAlignment::subpixel}) {
    const MergedRaw merged = burst.merged(2, {.alignment = alignment});
    const double white_e = test::night_full_e() / merged.frames[1].light;
    for (int y = object.y + 8; y < object.y + object.height - 8; ++y) {
      for (int x = object.x + 8; x < object.x + object.width - 8; ++x) {
        const double expected = after[static_cast<std::size_t>(colour_at(BayerPhase::grbg, x, y))];
        ASSERT_NEAR(Burst::signal_e(merged.frame, x, y, white_e), expected, 0.05 * expected) << x << ' ' << y;
      }
    }
  }
}

TEST(MergeBracket, ADefectOfTheReferenceDoesNotReplaceItsBlock) {
  Burst burst{.width = 384, .height = 256};
  burst.light = [](int index) { return std::array{1.0, 1.0 / 16}[static_cast<std::size_t>(index)]; };
  burst.scene = [](double x, double y, int colour) { return test::textured(x, y, colour, 400); };
  const Rect object{32, 40, 64, 48};
  burst.disturb = [&](RawFrame& frame, int index) {
    if (index == 0) frame.corrections.defects = {{61, 61, 1, 1}};
    for (int y = object.y; y < object.y + object.height; ++y) {
      for (int x = object.x; x < object.x + object.width; ++x) {
        const double e = index == 0 ? 900 : 2000.0 / 16;
        frame.raw.dn.at(x, y) =
            static_cast<std::uint16_t>(std::lround(test::night_black_dn + test::night_gain_dn_per_e * e));
      }
    }
  };
  const MergedRaw merged = burst.merged(2, {.alignment = MergeAlignment::none});
  const double white_e = test::night_full_e() / merged.frames[1].light;
  for (int y = object.y + 8; y < object.y + object.height - 8; ++y) {
    for (int x = object.x + 8; x < object.x + object.width - 8; ++x) {
      ASSERT_NEAR(Burst::signal_e(merged.frame, x, y, white_e), 900, 9) << x << ' ' << y;
    }
  }
}

TEST(MergeBracket, NearSaturationOfTheShortestFrameOtherColoursKeepTheirLongExposures) {
  std::array<double, 2> blue_error{};
  for (const bool near : {false, true}) {
    Burst burst{.width = 384, .height = 256};
    burst.light = [](int index) { return std::array{1.0, 1.0 / 16}[static_cast<std::size_t>(index)]; };
    const double red_e = (near ? 0.97 : 0.8) * 16 * test::night_full_e();
    burst.scene = [=](double x, double y, int colour) {
      if (x < 64 || x >= 192 || y < 64 || y >= 192) return test::textured(x, y, colour, 400);
      return colour == 0 ? red_e : 300.0;
    };
    const MergedRaw merged = burst.merged(2, {.alignment = MergeAlignment::none});
    const double white_e = test::night_full_e() / merged.frames[1].light;
    for (int y = 72; y < 184; ++y) {
      for (int x = 72; x < 184; ++x) {
        if (colour_at(BayerPhase::grbg, x, y) != CfaColour::blue) continue;
        blue_error[near ? 1 : 0] += std::pow(Burst::signal_e(merged.frame, x, y, white_e) - 300, 2) / (56.0 * 56);
      }
    }
  }
  EXPECT_LT(blue_error[0], 1.2 * 304);  // the noise of the long frame
  EXPECT_LT(blue_error[1], 1.2 * 304);
}

TEST(MergeBracket, IsFoundWhereverTheExposureChanges) {
  for (const int changed : {1, 2, 4}) {
    Burst burst;
    burst.light = [changed](int index) { return index == changed ? 4.0 : 1.0; };
    for (const auto alignment : {std::optional(MergeAlignment::none), std::optional<MergeAlignment>()}) {
      const MergedRaw merged = burst.merged(5, {.alignment = alignment});
      EXPECT_TRUE(merged.bracket);
      // Five frames of 8 times the light of one; 4 e-^2 of read noise in each.
      const double expected = burst.mean_square_error(burst.frame(0)) / 8;
      EXPECT_LT(burst.mean_square_error(merged.frame), 1.1 * expected);
      EXPECT_NEAR(burst.stated_variance(merged.frame) / burst.mean_square_error(merged.frame), 1, 0.1);
    }
  }
}

// Half of the blocks are left out by chance: what remains of them has the noise of the reference.
TEST(MergeBracket, BlocksThatDoNotMatchHaveTheNoiseOfTheLongestExposure) {
  Burst burst{.width = 384, .height = 256};
  burst.light = [](int index) { return std::array{1.0, 256.0, 16.0}[static_cast<std::size_t>(index)]; };
  burst.scene = [](double x, double y, int colour) { return test::textured(x, y, colour, 0.2); };
  const MergedRaw merged = burst.merged(3, {.alignment = MergeAlignment::none, .false_alarm = 0.5});
  EXPECT_EQ(merged.reference, 1);
  const double long_variance = (0.2 * 256 + 4) / (256.0 * 256), white_e = test::night_full_e();
  double worst = 0;
  for (int y = 0; y + 16 <= burst.height; y += 16) {
    for (int x = 0; x + 16 <= burst.width; x += 16) {
      worst = std::max(worst, burst.mean_square_error(merged.frame, {x, y, 16, 16}, white_e));
    }
  }
  EXPECT_LT(worst, 3 * long_variance);  // the brightest squares, and the largest of 384 means of 256 values
  // Where most of the longest exposure is saturated, the next one is the reference; and always the one that is named.
  burst.scene = [](double x, double, int) { return x < 200 ? 100.0 : 1.0; };
  for (const auto alignment : {std::optional(MergeAlignment::none), std::optional<MergeAlignment>()}) {
    EXPECT_EQ(burst.merged(3, {.alignment = alignment}).reference, 2);
  }
  EXPECT_EQ(burst.merged(3, {.alignment = MergeAlignment::none, .reference = 0}).reference, 0);
}

// Where only the short exposure is not saturated, the noise is that of another order of magnitude.
TEST(MergeBracket, ExposuresOfManyStopsStateTheNoiseOfTheirHighlights) {
  std::mt19937_64 random(5127);
  for (int draw = 0; draw < 6; ++draw) {
    const double stops = std::uniform_real_distribution<>(9, 12)(random);
    const double bright_e = std::uniform_real_distribution<>(50, 2000)(random);
    const double dark_e = std::uniform_real_distribution<>(50, 300)(random) / std::exp2(stops);
    SCOPED_TRACE(fmt::format("{:.2f} EV, {:.0f} e- and {:.3g} e-", stops, bright_e, dark_e));
    Burst burst{.width = 256, .height = 256};
    burst.light = [stops](int index) { return index == 0 ? 1 : std::exp2(stops); };
    burst.scene = [&](double x, double, int) { return x < 96 ? bright_e : dark_e * std::exp2((x - 96) / 50); };
    const MergedRaw merged = burst.merged(2, {.alignment = MergeAlignment::none});
    ASSERT_TRUE(merged.bracket);
    const double white_e = test::night_full_e();
    const NoiseProfile& profile = *merged.frame.noise;
    const NoiseRatioView ratio = view_of(merged.frame.noise_ratio.get());
    for (const Rect& area : {Rect{0, 0, 88, 256}, Rect{104, 0, 152, 256}}) {
      double stated_e2 = 0;
      for (int y = 0; y < area.height; ++y) {
        for (int x = area.x; x < area.x + area.width; ++x) {
          const auto c = static_cast<std::size_t>(colour_at(BayerPhase::grbg, x, y));
          const double signal = burst.truth_e(x, y) / white_e;
          stated_e2 += ratio.at(x, y) * (profile.scale[c] * signal + profile.offset[c]) * white_e * white_e;
        }
      }
      stated_e2 /= static_cast<double>(area.width) * area.height;
      EXPECT_NEAR(stated_e2 / burst.mean_square_error(merged.frame, area, white_e), 1, 0.1) << "column " << area.x;
    }
  }
}

/// Merges frames that are named "frame 0", "frame 1" ...
Result<MergedRaw> merged_by_name(const Burst& burst, int count, const MergeOptions& options = {}) {
  InlineExecutor executor;
  const FrameReader read = [&](int index, bool) {
    return Result<FrameToMerge>({burst.frame(index), burst.options(), "frame " + std::to_string(index)});
  };
  return merge_frames(count, read, options, executor);
}

TEST(MergeBracket, WithoutAnExposureTimeItIsRefused) {
  for (const int bad : {0, 1}) {
    Burst burst;
    burst.light = [](int index) { return index == 1 ? 4.0 : 1.0; };
    burst.disturb = [bad](RawFrame& frame, int index) {
      if (index == bad) frame.raw.info.exposure_s.reset();
    };
    const auto merged = merged_by_name(burst, 3);
    ASSERT_FALSE(merged);
    EXPECT_EQ(merged.error().code, ErrorCode::insufficient);
    EXPECT_EQ(merged.error().where, "frame " + std::to_string(bad));
  }
}

// A frame of 0.002 e- shows nothing of the scene; one of 1/16 of the light of the other is aligned with it.
TEST(MergeBracket, AFrameThatCannotBeAlignedIsNamedUnlessTheCameraIsStatedToRest) {
  Burst burst{.width = 320, .height = 256};
  burst.scene = [](double x, double y, int colour) { return test::textured(x, y, colour, 100); };
  burst.position = test::hand_held_position(burst.width, burst.height, 20, 0);
  const auto warnings_of = [&](double light, const MergeOptions& options) {  // of the alignment
    burst.light = [light](int index) { return index == 0 ? light : 1.0; };
    auto merged = merged_by_name(burst, 2, options);
    EXPECT_TRUE(merged) << merged.error().message;
    EXPECT_EQ(merged->reference, 1);
    std::erase_if(merged->warnings,
                  [](const std::string& text) { return text.find("could not be") == std::string::npos; });
    return merged->warnings;
  };
  const std::vector<std::string> unknown = warnings_of(1.0 / 50000, {});
  ASSERT_EQ(unknown.size(), 1);
  EXPECT_TRUE(unknown[0].starts_with("frame 0 could not be aligned with frame 1")) << unknown[0];
  EXPECT_TRUE(warnings_of(1.0 / 50000, {.alignment = MergeAlignment::none}).empty());
  const std::vector<std::string> aligned = warnings_of(1.0 / 50000, {.alignment = MergeAlignment::subpixel});
  ASSERT_EQ(aligned.size(), 1);
  EXPECT_NE(aligned[0].find("could not be found (frame 0)"), std::string::npos) << aligned[0];
  EXPECT_TRUE(warnings_of(1.0 / 16, {}).empty());
}

}  // namespace
}  // namespace lowlux::isp
