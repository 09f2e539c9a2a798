#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "tests/pipeline/merge/merge_bursts.h"

namespace lowlux::isp {
namespace {

using test::Burst;

TEST(MergeStatic, GainsTenLogOfTheNumberAndStatesItsNoise) {
  struct Light {
    double mean_e, read_e;
  };
  for (const Light light : {Light{20, 2}, {4, 2}, {20, 14.28}}) {  // the last has the noise of 200 e- of dark charge
    const Burst burst{.mean_e = light.mean_e, .read_noise_e = light.read_e};
    const double single = burst.mean_square_error(burst.frame(0));
    for (const int count : {4, 8, 16, 32}) {
      const MergedRaw merged = burst.merged(count);
      const double error = burst.mean_square_error(merged.frame);
      EXPECT_GT(10 * std::log10(single / error), 10 * std::log10(count) - 0.3) << light.mean_e << ", " << count;
      EXPECT_NEAR(burst.stated_variance(merged.frame) / error, 1, 0.03) << light.mean_e << ", " << count;
      EXPECT_EQ(merged.alignment, MergeAlignment::none);
    }
  }
}

TEST(MergeStatic, OneFrameStaysAsItIs) {
  const Burst burst;
  const MergedRaw merged = burst.merged(1);
  const double single = burst.mean_square_error(burst.frame(0)), same = burst.mean_square_error(merged.frame);
  EXPECT_NEAR(same / single, 1, 0.01);
  EXPECT_NEAR(merged.mean_count, 1, 1e-9);
}

TEST(MergeStatic, IdenticalFramesMatchEntirely) {
  const Burst burst;
  const FrameReader same = [&](int, bool) { return Result<FrameToMerge>({burst.frame(0), burst.options()}); };
  InlineExecutor executor;
  const auto merged = merge_frames(6, same, {}, executor);
  ASSERT_TRUE(merged) << merged.error().message;
  EXPECT_GT(merged->mean_count, 5.99);
  for (const FrameUse& use : merged->frames) EXPECT_EQ(use.outliers, 0);
}

TEST(MergeStatic, AWalkerASatelliteAndCosmicRaysAreLeftOut) {
  Burst burst{.mean_e = 20, .read_noise_e = 2, .find_defects = true};
  burst.disturb = [](RawFrame& frame, int index) {
    for (int y = 40; y < 90; ++y) {  // a walker, 30 px wide, 20 px further in each frame
      for (int x = 20 * index; x < 20 * index + 30; ++x) frame.raw.dn.at(x, y) += 4 * 40;
    }
    if (index == 3) {
      for (int x = 0; x < 255; ++x) frame.raw.dn.at(x, x / 2) += 4000;  // a satellite
    }
    frame.raw.dn.at(11 + 17 * index, 150) = 16000;  // cosmic rays
  };
  const MergedRaw merged = burst.merged(10);
  EXPECT_EQ(merged.alignment, MergeAlignment::none);
  const double expected = burst.mean_square_error(burst.frame_as_exposed(0)) / 10;
  EXPECT_LT(burst.mean_square_error(merged.frame), 1.25 * expected);
  const MergedRaw plain = burst.merged(10, {.robust = false});
  EXPECT_GT(burst.mean_square_error(plain.frame), 10 * expected);
}

TEST(MergeStatic, IsTheSameForAnyNumberOfThreads) {
  const Burst burst{.width = 131, .height = 77};
  InlineExecutor one;
  const MergedRaw expected = burst.merged(5, {}, &one);
  for (const int threads : {2, 3, 7}) {
    PoolExecutor pool(threads);
    const MergedRaw result = burst.merged(5, {}, &pool);
    EXPECT_TRUE(test::same_samples(result.frame.raw, expected.frame.raw)) << threads;
    EXPECT_EQ(result.frame.noise->scale, expected.frame.noise->scale);
  }
}

TEST(MergeStatic, FramesOfAnySizeAndOfExtremeContent) {
  for (const auto& [width, height] : {std::pair{2, 2}, {2, 601}, {601, 2}, {37, 33}}) {
    const Burst burst{.width = width, .height = height};
    const MergedRaw merged = burst.merged(4);
    EXPECT_EQ(merged.frame.raw.dn.width(), width);
    if (width * height < 500) continue;  // too few sites for the variance
    EXPECT_NEAR(burst.mean_square_error(merged.frame) / burst.mean_square_error(burst.frame(0)), 0.25, 0.1);
  }
  Burst dark{.mean_e = 0};
  EXPECT_NEAR(dark.mean_square_error(dark.merged(8).frame) / dark.mean_square_error(dark.frame(0)), 1.0 / 8, 0.01);
  Burst saturated;
  saturated.disturb = [](RawFrame& frame, int) {
    std::fill_n(frame.raw.dn.data(), frame.raw.dn.size(), std::uint16_t{16383});
  };
  const MergedRaw white = saturated.merged(5);
  for (std::size_t i = 0; i < white.frame.raw.dn.size(); ++i) ASSERT_EQ(white.frame.raw.dn.data()[i], 65535);
}

TEST(MergeStatic, RefusesFramesThatDoNotFit) {
  const Burst burst;
  struct Case {
    std::string why;
    std::function<void(RawFrame&)> change;
  };
  const std::vector<Case> cases{
      {"it was taken with", [](RawFrame& f) { f.raw.info.model = "another"; }},
      {"pixels, the reference", [](RawFrame& f) { f.raw.active.width -= 2, f.raw.default_crop.width -= 2; }},
      {"its mosaic", [](RawFrame& f) { f.raw.phase = BayerPhase::bggr; }},
      {"its noise is not", [](RawFrame& f) { f.noise->scale[1] /= 4; }},
      {"exposure times", [](RawFrame& f) { f.raw.info.exposure_s.reset(); }},
      {"its ISO (100) is not that of the reference", [](RawFrame& f) { f.noise.reset(), f.raw.info.iso = 100; }},
  };
  for (const Case& c : cases) {
    for (const int bad : {1, 4}) {
      const FrameReader read = [&](int index, bool) {
        RawFrame frame = burst.frame(index);
        if (index == bad) c.change(frame);
        return Result<FrameToMerge>({std::move(frame), burst.options(), "frame " + std::to_string(index)});
      };
      InlineExecutor executor;
      const auto merged = merge_frames(5, read, {}, executor);
      ASSERT_FALSE(merged) << c.why;
      EXPECT_NE(merged.error().message.find(c.why), std::string::npos) << merged.error().message;
      EXPECT_EQ(merged.error().where, "frame " + std::to_string(bad));
    }
  }
}

// Four frames of 14 bits in 16 bits have the noise of one frame in units of its range.
TEST(MergeStatic, RefusesAMergedFileAmongItsFrames) {
  const Burst burst;
  for (const int merged_at : {0, 2}) {
    const FrameReader read = [&](int index, bool) {
      return Result<FrameToMerge>({index == merged_at ? burst.merged(4).frame : burst.frame(index), burst.options()});
    };
    InlineExecutor executor;
    const auto again = merge_frames(4, read, {}, executor);
    ASSERT_FALSE(again);
    EXPECT_NE(again.error().message.find("its noise is not"), std::string::npos) << again.error().message;
  }
}

TEST(MergeStatic, AReaderThatFailsEndsTheMerge) {
  const Burst burst;
  for (const int bad : {0, 2, 4}) {
    const FrameReader read = [&](int index, bool) -> Result<FrameToMerge> {
      if (index == bad) return fail(ErrorCode::unreadable, "gone", "file " + std::to_string(index));
      return FrameToMerge{burst.frame(index), burst.options()};
    };
    PoolExecutor executor(2);
    const auto merged = merge_frames(5, read, {}, executor);
    ASSERT_FALSE(merged);
    EXPECT_EQ(merged.error().where, "file " + std::to_string(bad));
  }
  InlineExecutor executor;
  EXPECT_FALSE(merge_frames(0, {}, {}, executor));
}

TEST(MergeStatic, WarnsOfCopiesOfFrames) {
  Burst burst;
  const auto warning_of = [&burst](const std::array<int, 5>& exposed, MergeAlignment alignment) {
    const FrameReader read = [&](int index, bool) {
      const auto i = static_cast<std::size_t>(index);
      return Result<FrameToMerge>({burst.frame(exposed[i]), burst.options(), std::string(1, "abcde"[i])});
    };
    InlineExecutor executor;
    const auto merged = merge_frames(5, read, {.alignment = alignment}, executor);
    EXPECT_TRUE(merged) << merged.error().message;
    for (const std::string& warning : merged->warnings) {
      if (warning.find("samples of another frame") != std::string::npos) return warning;
    }
    return std::string();
  };
  for (const auto alignment : {MergeAlignment::none, MergeAlignment::cells}) {
    const std::string warning = warning_of({0, 1, 0, 2, 1}, alignment);  // frames c and e are copies
    EXPECT_TRUE(warning.starts_with("2 of 5 frames have the samples of another frame (c those of a)")) << warning;
    EXPECT_EQ(warning_of({0, 1, 2, 3, 4}, alignment), "");
  }
  // Frames that are saturated everywhere are equal without being copies.
  burst.scene = [](double, double, int) { return 1e6; };
  EXPECT_EQ(warning_of({0, 1, 2, 3, 4}, MergeAlignment::none), "");
}

}  // namespace
}  // namespace lowlux::isp
