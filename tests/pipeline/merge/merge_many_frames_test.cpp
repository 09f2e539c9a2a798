#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>

#include "isp/pipeline/merge/frame_electrons.h"
#include "tests/pipeline/merge/merge_ways.h"
#include "tests/support/executors.h"

/// Hand-held merges of 16 frames, from which on the reference is predicted from the mean of all colours: frames with
/// corrections, other levels or no colours gain as much as plain ones.
namespace lowlux::isp {
namespace {

using test::Burst;

constexpr int frames = 16, width = 208, height = 160;
constexpr Rect middle{24, 24, width - 48, height - 48};

/// Returns a burst whose frames are displaced by up to 12 pixels and turned by up to one degree.
Burst hand_held(double mean_e, std::uint64_t draws) {
  Burst burst{.width = width, .height = height, .mean_e = mean_e};
  burst.scene = [mean_e](double x, double y, int colour) { return test::textured(x, y, colour, mean_e); };
  burst.position = test::hand_held_position(width, height, 12, 1000 * draws);
  return burst;
}

/// States what a merge of hand-held frames differs by from a plain one.
struct Variant {
  std::function<void(RawFrame&, int)> disturb = {};
  std::shared_ptr<const DarkFrame> dark = nullptr;
  double white_e = test::night_full_e();  // of the reference
};

MergedRaw merged(const Burst& burst, const Variant& variant) {
  const FrameReader read = [&](int index, bool) {
    FrameToMerge out{burst.frame(index), burst.options(), {}};
    if (variant.disturb) variant.disturb(out.frame, index);
    out.options.dark_frame = variant.dark;
    return Result<FrameToMerge>(std::move(out));
  };
  auto result = merge_frames(frames, read, {.alignment = MergeAlignment::subpixel}, test::two_threads);
  EXPECT_TRUE(result) << result.error().message;
  return *std::move(result);
}

struct Errors {
  double gain_db;  // over the reference alone
  double bias;     // of the mean, relative
};

/// Compares the middle of a merge with the truth.
Errors errors(const Burst& burst, const Variant& variant) {
  const MergedRaw found = merged(burst, variant);
  test::expect_finite(found, "");
  const Plane<float> gain = shading_gain(found.frame.corrections, width, height, test::two_threads);
  double square = 0, square_of_single = 0, sum = 0, truth = 0;
  for (int y = middle.y; y < middle.y + middle.height; ++y) {
    for (int x = middle.x; x < middle.x + middle.width; ++x) {
      const double expected = burst.truth_e(x, y), of_pixel = gain.empty() ? 1 : static_cast<double>(gain.at(x, y));
      const double value = Burst::signal_e(found.frame, x, y, variant.white_e) * of_pixel;
      sum += value;
      truth += expected;
      square += std::pow(value - expected, 2);
      square_of_single += (expected / of_pixel + std::pow(burst.read_noise_e, 2)) * of_pixel * of_pixel;
    }
  }
  return {10 * std::log10(square_of_single / square), sum / truth - 1};
}

constexpr double level_e = 30;
constexpr std::uint64_t seed = 42;

/// Checks that a variant gains as much as plain frames, less a loss, and keeps the mean.
void expect_plain_gain(const Burst& burst, const Variant& variant, double loss_db) {
  static const Errors plain = errors(hand_held(level_e, seed), {});
  const Errors found = errors(burst, variant);
  std::printf("gain %.2f dB, of plain frames %.2f; bias %.4f\n", found.gain_db, plain.gain_db, found.bias);
  EXPECT_GT(found.gain_db, plain.gain_db - loss_db);
  EXPECT_NEAR(found.bias, 0, 0.001);
}

TEST(MergeManyFrames, OfAMonochromeSensorGainAsMuchAsOfAMosaic) {
  Burst burst = hand_held(level_e, seed);
  const auto scene = burst.scene;
  burst.scene = [scene](double x, double y, int) { return scene(x, y, 1); };
  burst.neutral = {1, 1, 1};
  expect_plain_gain(burst, {.disturb = [](RawFrame& frame, int) { frame.raw.layout = SensorLayout::monochrome; }}, 0.1);
}

/// Returns frames that a lens shades and whose gains correct it.
Variant shaded(const RawCorrections& corrections) {
  const auto gain = std::make_shared<const Plane<float>>(shading_gain(corrections, width, height, test::one_thread));
  const auto disturb = [=](RawFrame& frame, int) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        std::uint16_t& dn = frame.raw.dn.at(x, y);
        const double above = (dn - test::night_black_dn) / static_cast<double>(gain->at(x, y));
        dn = static_cast<std::uint16_t>(std::lround(test::night_black_dn + above));
      }
    }
    frame.corrections = corrections;
  };
  return {.disturb = disturb};
}

/// Returns gains of some points, each of which is gain(v, u) with v and u in -1..1.
GainMap gain_map(int points_v, int points_h, const std::function<double(double, double)>& gain) {
  GainMap out{.bottom = height, .right = width, .points_v = points_v, .points_h = points_h};
  out.spacing_v = 1.0 / points_v;
  out.spacing_h = 1.0 / points_h;
  out.origin_v = 0.5 / points_v;
  out.origin_h = 0.5 / points_h;
  for (int j = 0; j < points_v; ++j) {
    for (int i = 0; i < points_h; ++i) {
      out.gain.push_back(static_cast<float>(gain((2 * j + 1.0) / points_v - 1, (2 * i + 1.0) / points_h - 1)));
    }
  }
  return out;
}

TEST(MergeManyFrames, WithGainMapsOfEachColourGainAsMuch) {
  RawCorrections corrections;
  for (int site = 0; site < 4; ++site) {
    GainMap map = gain_map(9, 13, [=](double v, double u) { return 1 + (0.5 + 0.1 * site) * (v * v + u * u) / 2; });
    map.top = site >> 1;
    map.left = site & 1;
    map.row_pitch = map.column_pitch = 2;
    corrections.gain_maps.push_back(std::move(map));
  }
  expect_plain_gain(hand_held(level_e, seed), shaded(corrections), 0.3);
}

// Pixels differ by 1 %, which is averaged over displaced frames: 0.3 e- of a frame at 30 e-, whose noise is 6 e-.
TEST(MergeManyFrames, WithAFlatFrameGainAsMuch) {
  std::mt19937_64 draw(7);
  std::normal_distribution<double> response(0, 0.01);
  RawCorrections corrections;
  corrections.gain_maps.push_back(gain_map(
      height, width, [&](double v, double u) { return (1 + 0.6 * (v * v + u * u) / 2) * (1 + response(draw)); }));
  expect_plain_gain(hand_held(level_e, seed), shaded(corrections), 0.3);
}

TEST(MergeManyFrames, WithADarkFrameGainAsMuch) {
  const auto pattern_dn = [](int x, int y) { return 40 * ((x / 3 + y / 5) % 4); };
  auto dark = std::make_shared<DarkFrame>();
  dark->dn = Plane<float>(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) dark->dn.at(x, y) = static_cast<float>(test::night_black_dn + pattern_dn(x, y));
  }
  double sum_dn = 0;
  for (std::size_t i = 0; i < dark->dn.size(); ++i) sum_dn += static_cast<double>(dark->dn.data()[i]);
  const double mean_dn = sum_dn / static_cast<double>(dark->dn.size());
  dark->mean_dn.fill(mean_dn);
  dark->noise_std_dn.fill(2 * test::night_gain_dn_per_e);
  dark->frames = dark->files = 64;
  const auto disturb = [=](RawFrame& frame, int) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        std::uint16_t& dn = frame.raw.dn.at(x, y);
        dn = static_cast<std::uint16_t>(dn + pattern_dn(x, y));
      }
    }
  };
  expect_plain_gain(
      hand_held(level_e, seed),
      {.disturb = disturb, .dark = dark, .white_e = (test::night_white_dn - mean_dn) / test::night_gain_dn_per_e}, 0.1);
}

TEST(MergeManyFrames, OfDifferentBlackAndWhiteLevelsGainAsMuch) {
  const auto levels_dn = [](int index) {
    std::mt19937_64 draw(static_cast<std::uint64_t>(index));
    std::uniform_int_distribution<int> black(100, 4000), white(12000, 16383);
    const int black_dn = black(draw);
    return std::pair{static_cast<double>(black_dn), static_cast<double>(white(draw))};
  };
  const auto disturb = [=](RawFrame& frame, int index) {
    const auto [black_dn, white_dn] = levels_dn(index);
    test::change_levels(frame, black_dn, white_dn);
  };
  const auto [black_dn, white_dn] = levels_dn(0);
  expect_plain_gain(hand_held(level_e, seed),
                    {.disturb = disturb, .white_e = (white_dn - black_dn) / test::night_gain_dn_per_e}, 0.1);
}

TEST(MergeManyFrames, OrientationAndCropAreThoseOfTheReference) {
  const Burst burst = hand_held(level_e, seed);
  const auto orientation = [](int index) { return static_cast<Orientation>(1 + (3 * index + 5) % 8); };
  const auto crop = [](int index) { return Rect{2 * (index % 5), index % 7, width - 30, height - 20 - index}; };
  const auto disturb = [&](RawFrame& frame, int index) {
    frame.raw.info.orientation = orientation(index);
    frame.raw.default_crop = crop(index);
  };
  const MergedRaw expected = merged(burst, {}), found = merged(burst, {.disturb = disturb});
  EXPECT_EQ(found.reference, expected.reference);
  EXPECT_TRUE(test::same_samples(found.frame.raw, expected.frame.raw));
  EXPECT_EQ(found.frame.raw.info.orientation, orientation(found.reference));
  EXPECT_EQ(found.frame.raw.default_crop, crop(found.reference));
}

}  // namespace
}  // namespace lowlux::isp
