#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/pipeline/merge/merge_bursts.h"

/// The ways in which frames are merged, and what all of them have to hold.
namespace lowlux::test {

struct MergeWay {
  std::string name;
  isp::MergeOptions options;
  bool bracket = false;  // exposures of 1, 4, 1/4, 1, ...

  /// Returns a burst with the exposures of this way.
  Burst of(Burst burst) const {
    if (!bracket) return burst;
    burst.light = [](int index) { return index % 3 == 1 ? 4.0 : index % 3 == 2 ? 0.25 : 1.0; };
    return burst;
  }
};

/// Returns all ways but those by the stars.
inline std::vector<MergeWay> ways_without_stars() {
  using isp::MergeAlignment;
  const merge::DrizzleOptions drizzle{.scale = 1.5};
  return {
      {"at rest, robust", {.alignment = MergeAlignment::none}},
      {"at rest, plain", {.robust = false, .alignment = MergeAlignment::none}},
      {"cells", {.alignment = MergeAlignment::cells}},
      {"sub-pixel", {.alignment = MergeAlignment::subpixel}},
      {"sub-pixel, plain", {.robust = false, .alignment = MergeAlignment::subpixel}},
      {"drizzle", {.alignment = MergeAlignment::subpixel, .drizzle = drizzle}},
      {"bracket at rest", {.alignment = MergeAlignment::none, .reference = 0}, true},
      {"bracket, sub-pixel", {.alignment = MergeAlignment::subpixel, .reference = 0}, true},
  };
}

/// Returns the ways for frames that move.
inline std::vector<MergeWay> moving_ways() {
  std::vector<MergeWay> out = ways_without_stars();
  std::erase_if(out, [](const MergeWay& way) { return way.options.alignment == isp::MergeAlignment::none; });
  return out;
}

/// Merges the first `count` frames of a burst, which are named "frame 0", "frame 1", ... in errors.
inline Result<isp::MergedRaw> tried(const Burst& burst, int count, const isp::MergeOptions& options) {
  InlineExecutor one;
  const isp::FrameReader read = [&](int index, bool) {
    return Result<isp::FrameToMerge>({burst.frame(index), burst.options(), "frame " + std::to_string(index)});
  };
  return merge_frames(count, read, options, one);
}

/// Encodes a frame anew with other black and white levels [DN], and the same gain [DN/e-].
inline void change_levels(RawFrame& frame, double black_dn, double white_dn) {
  for (std::size_t i = 0; i < frame.raw.dn.size(); ++i) {
    const double dn = frame.raw.dn.data()[i] + black_dn - night_black_dn;
    frame.raw.dn.data()[i] = static_cast<std::uint16_t>(std::clamp(dn, 0.0, white_dn));
  }
  const double unit = (night_white_dn - night_black_dn) / (white_dn - black_dn);
  frame.raw.black_tag->pattern_dn = {black_dn};
  frame.raw.white_dn.fill(white_dn);
  for (double& scale : frame.noise->scale) scale *= unit;
  for (double& offset : frame.noise->offset) offset *= unit * unit;
}

/// Returns the mean signal over all samples [e-].
/// @param white_e  signal of the white level of the reference
inline double mean_e(const isp::MergedRaw& merged, double white_e = night_full_e()) {
  const RawDn& raw = merged.frame.raw;
  const double brightest_e = std::exp2(merged.baseline_exposure_ev) * white_e;
  double sum = 0;
  for (int y = 0; y < raw.rows(); ++y) {
    for (int x = 0; x < raw.row_samples(); ++x) sum += Burst::signal_e(merged.frame, x, y, brightest_e);
  }
  return sum / static_cast<double>(raw.samples());
}

/// Checks that every sample and every figure of the noise is finite, and that the noise is positive.
inline void expect_finite(const isp::MergedRaw& merged, const std::string& where) {
  const RawDn& raw = merged.frame.raw;
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < raw.dn_float.size(); ++i) wrong += std::isfinite(raw.dn_float.data()[i]) ? 0 : 1;
  EXPECT_EQ(wrong, 0U) << where;
  EXPECT_GT(raw.samples(), 0U) << where;
  ASSERT_TRUE(merged.frame.noise) << where;
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_TRUE(std::isfinite(merged.frame.noise->scale[c]) && merged.frame.noise->scale[c] >= 0) << where;
    EXPECT_TRUE(std::isfinite(merged.frame.noise->offset[c]) && merged.frame.noise->offset[c] >= 0) << where;
    EXPECT_TRUE(std::isfinite(merged.empty_fraction[c])) << where;
  }
  EXPECT_TRUE(std::isfinite(merged.mean_count) && std::isfinite(merged.baseline_exposure_ev)) << where;
  if (merged.frame.noise_ratio) {
    const Plane<float>& ratio = merged.frame.noise_ratio->ratio;
    for (std::size_t i = 0; i < ratio.size(); ++i) {
      ASSERT_TRUE(std::isfinite(ratio.data()[i]) && ratio.data()[i] > 0) << where;
    }
  }
  for (const isp::FrameUse& use : merged.frames) {
    EXPECT_TRUE(std::isfinite(use.light) && use.light > 0) << where;
    EXPECT_TRUE(std::isfinite(use.mean_chi_square) && std::isfinite(use.largest_shift_px)) << where;
    EXPECT_TRUE(use.used_fraction >= 0 && use.used_fraction <= 1) << where;
  }
}

}  // namespace lowlux::test
