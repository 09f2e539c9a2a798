#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/pipeline/merge/merge_ways.h"
#include "tests/pipeline/merge/star_nights.h"

namespace lowlux::isp {
namespace {

using test::Burst;
using test::MergeWay;
using test::tried;

std::string seed_text(std::uint64_t seed) { return ", seed " + std::to_string(seed); }

TEST(MergeHardCases, SmallFramesKeepTheirMeanOrAreRefusedByOneError) {
  constexpr std::uint64_t seed = 26;
  std::mt19937_64 draw(seed);
  std::uniform_int_distribution<int> length(3, 700), count(1, 5);
  const std::vector<std::array<int, 2>> sizes{{1, 1},  {1, length(draw)}, {length(draw), 1},  {3, 2},
                                              {2, 3},  {2, length(draw)}, {length(draw), 2},  {3, length(draw)},
                                              {15, 9}, {17, 16},          {length(draw), 18}, {2, 2}};
  constexpr double level_e = 50;
  for (const auto& [width, height] : sizes) {
    const int frames = count(draw);
    Burst flat{.width = width, .height = height};
    flat.scene = [](double, double, int) { return level_e; };
    const std::string size = std::to_string(frames) + " of " + std::to_string(width) + " x " + std::to_string(height);
    for (const MergeWay& way : test::ways_without_stars()) {
      const std::string where = way.name + ": " + size + seed_text(seed);
      const auto merged = tried(way.of(flat), frames, way.options);
      const bool single_drizzle = frames == 1 && way.options.drizzle;
      if (width == 1 || height == 1 || single_drizzle) {
        ASSERT_FALSE(merged) << where;
        EXPECT_EQ(merged.error().code, ErrorCode::invalid_argument) << where;
        EXPECT_EQ(merged.error().where, "frame 0") << where;
        continue;
      }
      ASSERT_TRUE(merged) << where << merged.error().message;
      test::expect_finite(*merged, where);
      const double scale = way.options.drizzle ? way.options.drizzle->scale : 1;
      EXPECT_EQ(merged->frame.raw.active.width, std::lround(scale * width)) << where;
      EXPECT_EQ(merged->frame.raw.active.height, std::lround(scale * height)) << where;
      const bool at_rest = way.options.alignment == MergeAlignment::none && !way.bracket;
      const double variance = (level_e + 4 + 1.0 / 192) / (width * height * (at_rest ? frames : 1));
      EXPECT_NEAR(test::mean_e(*merged), level_e, 5 * std::sqrt(variance)) << where;
    }
    const auto by_stars = tried(flat, std::max(frames, 2), {.alignment = MergeAlignment::stars});
    ASSERT_FALSE(by_stars) << size;
    EXPECT_EQ(by_stars.error().where, "frame 0") << size;
  }
}

/// Makes all frames of a burst dark, white, identical to the first, or pure noise.
void show(const std::string& content, const std::shared_ptr<const RawFrame>& first, Burst& burst) {
  const auto filled = [](double code) {
    return [code](RawFrame& frame, int) {
      std::fill_n(frame.raw.dn.data(), frame.raw.dn.size(), static_cast<std::uint16_t>(code));
    };
  };
  if (content == "dark") burst.disturb = filled(test::night_black_dn);
  if (content == "white") burst.disturb = filled(test::night_white_dn);
  if (content == "noise") burst.scene = [](double, double, int) { return 0.0; };
  if (content == "identical") {
    burst.disturb = [first](RawFrame& frame, int) {
      std::copy_n(first->raw.dn.data(), first->raw.dn.size(), frame.raw.dn.data());
    };
  }
}

double largest_change_e(const RawFrame& frame, const RawFrame& before) {
  double largest_e = 0;
  for (int y = 0; y < before.raw.rows(); ++y) {
    for (int x = 0; x < before.raw.row_samples(); ++x) {
      largest_e = std::max(largest_e, std::fabs(Burst::signal_e(frame, x, y) - Burst::signal_e(before, x, y)));
    }
  }
  return largest_e;
}

TEST(MergeHardCases, DarkWhiteNoisyAndIdenticalFramesKeepTheirMean) {
  constexpr std::uint64_t seed = 28;
  std::mt19937_64 draw(seed);
  std::uniform_int_distribution<int> length(40, 120), count(2, 6);
  std::uniform_real_distribution<double> read_noise_e(0.5, 20);
  for (const std::string content : {"dark", "white", "noise", "identical"}) {
    Burst burst{.width = length(draw), .height = length(draw), .mean_e = 20, .read_noise_e = read_noise_e(draw)};
    const auto first = std::make_shared<const RawFrame>(burst.frame_as_exposed(0));
    show(content, first, burst);
    const int frames = count(draw);
    const double sites = burst.width * burst.height;
    for (const MergeWay& way : test::ways_without_stars()) {
      const std::string where = content + ", " + way.name + seed_text(seed);
      const auto merged = tried(way.of(burst), frames, way.options);
      ASSERT_TRUE(merged) << where << merged.error().message;
      test::expect_finite(*merged, where);
      const double mean_e = test::mean_e(*merged);
      const double white_e = std::exp2(merged->baseline_exposure_ev) * test::night_full_e();
      const double noise_e =
          content == "noise" ? burst.read_noise_e : std::sqrt(burst.read_noise_e * burst.read_noise_e + 20);
      const double expected_e = content == "white" ? white_e : content == "identical" ? 20 : 0;
      const bool exact = content == "dark" || content == "white";
      EXPECT_NEAR(mean_e, expected_e, exact ? 1e-9 * white_e : 5 * noise_e / std::sqrt(sites)) << where;
      if (content != "identical" || way.bracket || way.options.drizzle) continue;
      const bool shares = way.options.alignment == MergeAlignment::subpixel;  // drops average neighbours too
      const double code_e = test::night_full_e() / (merged->frame.raw.white_dn[1] - 16384);
      EXPECT_LT(largest_change_e(merged->frame, *first),
                shares ? 5 * std::sqrt(36 + std::pow(burst.read_noise_e, 2)) : code_e)
          << where;
    }
    const auto by_stars = tried(burst, frames, {.alignment = MergeAlignment::stars});
    ASSERT_FALSE(by_stars) << content;
    EXPECT_EQ(by_stars.error().code, ErrorCode::insufficient) << content;
    EXPECT_EQ(by_stars.error().where, "frame 0") << content;
  }
}

/// Stripes or a lattice, drawn at random: period 6 to 36 px, any direction, level 10 to 100 e-.
std::function<double(double, double, int)> pattern(bool lattice, double level_e, std::mt19937_64& draw) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double frequency = 2 * std::numbers::pi / (6 * std::pow(6, unit(draw))), turn = std::numbers::pi * unit(draw);
  const double c = frequency * std::cos(turn), s = frequency * std::sin(turn);
  return [=](double x, double y, int) {
    const double across = std::sin(c * x + s * y);
    return level_e * (1 + 0.6 * across * (lattice ? std::sin(c * y - s * x) : 1));
  };
}

TEST(MergeHardCases, PeriodicPatternsInAMovingHandAreAveragedWithoutGhosts) {
  constexpr std::uint64_t seed = 29;
  constexpr int frames = 6;
  std::mt19937_64 draw(seed);
  std::uniform_real_distribution<double> level(10, 100), offset(-15, 15);
  for (int i = 0; i < 4; ++i) {
    const double level_e = level(draw);
    Burst burst{.width = 208, .height = 176, .mean_e = level_e};
    burst.scene = pattern(i % 2 == 1, level_e, draw);
    std::array<std::array<double, 2>, frames> shift;
    for (auto& of_frame : shift) of_frame = {offset(draw), offset(draw)};
    burst.position = [&](int index, double x, double y) {
      const auto [dx, dy] = shift[static_cast<std::size_t>(index)];
      return std::array{x + dx, y + dy};
    };
    const double scene_e = burst.mean_truth_e();
    const double single = burst.mean_square_error(burst.frame(0));
    std::vector<MergeWay> ways = test::moving_ways();
    ways.push_back({"automatic", {}});
    for (const MergeWay& way : ways) {
      const std::string where = way.name + (i % 2 == 1 ? ", lattice" : ", stripes") + seed_text(seed);
      const auto merged = tried(way.of(burst), frames, way.options);
      ASSERT_TRUE(merged) << where << merged.error().message;
      test::expect_finite(*merged, where);
      EXPECT_NEAR(test::mean_e(*merged), scene_e, 5 * std::sqrt((scene_e + 4) / (burst.width * burst.height))) << where;
      if (way.options.drizzle) continue;
      // A sixth, and more at the edges that not all frames show. A ghost of 0.6 of the level would be above 1.
      const double white_e = std::exp2(merged->baseline_exposure_ev) * test::night_full_e();
      EXPECT_LT(burst.mean_square_error(merged->frame, white_e) / single, 0.5) << where;
    }
  }
}

/// Returns positions of frames 1, 2, 3, ... that are displaced one way, the other, ...
std::function<std::array<double, 2>(int, double, double)> to_and_fro(double shift_px, double angle) {
  const double dx = shift_px * std::cos(angle), dy = shift_px * std::sin(angle);
  return [=](int index, double x, double y) {
    const double way = index % 2 == 0 ? -1 : 1;
    return std::array{x + way * dx, y + way * dy};
  };
}

TEST(MergeHardCases, ShiftsOfSeveralTilesAreFoundOrLeftOut) {
  constexpr std::uint64_t seed = 30;
  std::mt19937_64 draw(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  int all_found = 0;
  for (int i = 0; i < 4; ++i) {
    const bool is_beyond_search = i % 2 == 1;
    const double level_e = 10 * std::pow(10, unit(draw)), angle = 2 * std::numbers::pi * unit(draw);
    const double shift_px = is_beyond_search ? 182 + 40 * unit(draw) : 33 + 60 * unit(draw);
    Burst burst{.width = 320, .height = 256, .mean_e = level_e};
    burst.scene = [=](double x, double y, int colour) { return test::textured(x, y, colour, level_e); };
    burst.position = to_and_fro(shift_px, angle);
    const double single = burst.mean_square_error(burst.frame(0));
    for (const MergeWay& way : test::moving_ways()) {
      if (way.options.robust == false) continue;  // it leaves nothing out
      const std::string where =
          way.name + ", " + std::to_string(shift_px) + " px, " + std::to_string(level_e) + " e-" + seed_text(seed);
      const auto merged = tried(way.of(burst), 3, way.options);
      ASSERT_TRUE(merged) << where << merged.error().message;
      test::expect_finite(*merged, where);
      int found = 0;
      for (const int other : {1, 2}) {
        const FrameUse& use = merged->frames[static_cast<std::size_t>(other)];
        const bool is_found = std::fabs(use.largest_shift_px - shift_px) < 2;  // a CFA cell
        EXPECT_TRUE(!is_found || use.used_fraction > 0.9) << where;
        found += is_found ? 1 : 0;
      }
      EXPECT_TRUE(!is_beyond_search || found == 0) << where;
      all_found += found;
      if (way.options.drizzle) continue;
      // Frames that are found show two thirds of the reference and more; those that are not do no harm.
      const double white_e = std::exp2(merged->baseline_exposure_ev) * test::night_full_e();
      EXPECT_LT(burst.mean_square_error(merged->frame, white_e) / single, found == 2 ? 0.7 : 1.01) << where;
    }
  }
  EXPECT_GE(all_found, 15);  // of 16: both frames of the draws in range, by four ways
}

TEST(MergeHardCases, NightsThatStandStillRepeatOrMoveFarAreMergedByTheStars) {
  constexpr std::uint64_t seed = 32;
  test::Sky sky(seed, 200, 1500), lattice(seed, 800, 800);
  for (std::size_t i = 0; i < lattice.stars.size(); ++i) {
    lattice.stars[i].x = 24 * (static_cast<double>(i % 17) - 3) + 12;
    lattice.stars[i].y = 24 * (static_cast<double>(i / 17) - 3) + 12;
  }
  std::mt19937_64 draw(seed);
  std::uniform_real_distribution<double> far(34, 60), angle(0, 2 * std::numbers::pi);
  const double shift_px = far(draw), turn = angle(draw);
  for (const std::string night : {"still", "lattice", "far"}) {
    const test::Sky& shown = night == "lattice" ? lattice : sky;
    Burst burst = test::night(shown);
    burst.neutral = {1, 1, 1};  // the stars are white: where no frame shows them, they are interpolated as such
    if (night == "still") burst.position = {};
    if (night == "far") burst.position = to_and_fro(shift_px, turn);
    for (const bool drizzled : {false, true}) {
      const std::string where = night + (drizzled ? ", drizzled" : "") + seed_text(seed);
      MergeOptions options{.alignment = MergeAlignment::stars};
      if (drizzled) options.drizzle = merge::DrizzleOptions{};
      const auto merged = tried(burst, 3, options);
      ASSERT_TRUE(merged) << where << merged.error().message;
      test::expect_finite(*merged, where);
      const bool repeats = night == "lattice";  // a shift by any period matches: left out
      for (const int other : {1, 2}) {
        const FrameUse& use = merged->frames[static_cast<std::size_t>(other)];
        EXPECT_EQ(use.aligned, !repeats) << where;
        EXPECT_NEAR(use.used_fraction, repeats ? 0 : 1, 0.05) << where;
        EXPECT_NEAR(use.largest_shift_px, night == "far" ? shift_px : 0, 0.1) << where;
      }
      const auto found = test::moments_of_stars(
          shown, burst, 1, [&](int x, int y) { return Burst::signal_e(merged->frame, drizzled ? 3 * x + 1 : x, y); });
      const auto truth = test::moments_of_stars(shown, burst, 1, [&](int x, int y) { return burst.truth_e(x, y); });
      // Photons of the stars, and sky of 30 e- and read noise of 3 e- within each radius of 5.5 px, in three frames.
      const auto stars = static_cast<double>(std::ranges::count_if(shown.stars, [&](const test::SkyStar& star) {
        return star.x >= 50 && star.y >= 50 && star.x <= burst.width - 50 && star.y <= burst.height - 50;
      }));
      const double variance_e2 = (truth.flux_e + stars * std::numbers::pi * 5.5 * 5.5 * (30 + 9)) / 3;
      EXPECT_NEAR(found.flux_e / truth.flux_e, 1, drizzled ? 0.03 : 5 * std::sqrt(variance_e2) / truth.flux_e) << where;
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
