#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <numbers>
#include <utility>

#include "tests/pipeline/merge/merge_bursts.h"

namespace lowlux::isp {
namespace {

using test::Burst;

/// A burst whose frames are displaced by up to 20 pixels and turned by up to one degree.
Burst hand_held(double mean_e) {
  Burst burst{.width = 320, .height = 256, .mean_e = mean_e};
  burst.scene = [mean_e](double x, double y, int colour) { return test::textured(x, y, colour, mean_e); };
  burst.position = test::hand_held_position(burst.width, burst.height, 20, 0);
  return burst;
}

constexpr Rect middle{32, 32, 256, 192};

TEST(MergeMoving, GainsNearlyAsMuchAsFramesAtRest) {
  for (const double mean_e : {20.0, 4.0}) {
    const Burst burst = hand_held(mean_e);
    const MergedRaw merged = burst.merged(8);
    EXPECT_EQ(merged.alignment, MergeAlignment::subpixel);
    const double single = burst.mean_square_error(burst.frame(0), middle);
    const double gain_db = 10 * std::log10(single / burst.mean_square_error(merged.frame, middle));
    EXPECT_GT(gain_db, 10 * std::log10(8) - 1) << mean_e;
    const MergedRaw cells = burst.merged(8, {.alignment = MergeAlignment::cells});
    EXPECT_LT(burst.mean_square_error(merged.frame, middle), burst.mean_square_error(cells.frame, middle)) << mean_e;
  }
}

TEST(MergeMoving, TheMotionOfTheCameraIsFoundForEveryReference) {
  const Burst burst = hand_held(20);
  for (const int count : {2, 3, 4}) {
    for (int reference = 0; reference < count; ++reference) {
      const MergedRaw merged = burst.merged(count, {.reference = reference});
      EXPECT_EQ(merged.alignment, MergeAlignment::subpixel) << count << " frames, reference " << reference;
    }
  }
}

// Waves of 3.5 pixels with 0.7 of the noise of a frame, which noise reduction of a single frame removes. A mean over
// drops of radius 1.5 px keeps sinc^2(1.5 / 3.5) = 0.52 of their contrast, over drops of 1 px 0.76. The mean of 8
// frames has a signal-to-noise ratio of 11.5, for which drops have 1.05 px.
TEST(MergeMoving, DetailThatNoiseHidesInOneFrameKeepsItsContrast) {
  constexpr double amplitude_e = 3.5, turns_per_px = 1 / 3.5;
  const auto wave = [](double x, double y) {
    return std::sin(2 * std::numbers::pi * turns_per_px * (0.8 * x + 0.6 * y));
  };
  Burst burst = hand_held(20);
  burst.scene = [&](double x, double y, int colour) {
    return test::textured(x, y, colour, 20) + amplitude_e * wave(x, y);
  };
  const auto contrast = [&](int frames) {
    const MergedRaw merged = burst.merged(frames, {.alignment = MergeAlignment::subpixel});
    double found = 0, square = 0;
    for (int y = middle.y; y < middle.y + middle.height; ++y) {
      for (int x = middle.x; x < middle.x + middle.width; ++x) {
        const auto colour = static_cast<int>(colour_at(BayerPhase::grbg, x, y));
        const double rest = Burst::signal_e(merged.frame, x, y) - test::textured(x, y, colour, 20);
        found += rest * wave(x, y);
        square += amplitude_e * wave(x, y) * wave(x, y);
      }
    }
    return found / square;
  };
  const double of_one = 0.02;  // standard error of one frame: 5 / (3.5 sqrt(0.5 x 256 x 192)), and of displacements
  EXPECT_NEAR(contrast(1), 1, 5 * of_one);
  const double of_8 = contrast(8), of_32 = contrast(32);
  std::printf("contrast kept of 8 and 32 frames: %.3f, %.3f\n", of_8, of_32);
  EXPECT_GT(of_8, 0.81);
  EXPECT_GT(of_32, 0.93);
}

// The prediction from all colours at every pixel, from 8 and 16 frames, holds the scene that noise hides in one frame.
// By the developed mosaic of their mean instead, which the mosaic's own drops have blurred, the gain is 13.3 dB.
TEST(MergeMoving, GainsOfManyFramesAreThoseOfFramesAtRest) {
  constexpr int frames = 32;
  const Burst burst = hand_held(20);
  const double single = burst.mean_square_error(burst.frame(0), middle);
  const MergedRaw merged = burst.merged(frames, {.alignment = MergeAlignment::subpixel});
  const double gain_db = 10 * std::log10(single / burst.mean_square_error(merged.frame, middle));
  std::printf("gain of %d frames: %.2f dB\n", frames, gain_db);
  EXPECT_GT(gain_db, 10 * std::log10(frames) - 1);
}

// A dark frame is subtracted from each frame, not from their mean once more, which is predicted from as well.
TEST(MergeMoving, ADarkFrameCountsOncePerFrame) {
  constexpr int frames = 16;
  const Burst burst = hand_held(20);
  const auto pattern_dn = [](int x, int y) { return 40 * ((x / 3 + y / 5) % 4); };
  auto dark = std::make_shared<DarkFrame>();
  dark->dn = Plane<float>(burst.width, burst.height);
  for (int y = 0; y < burst.height; ++y) {
    for (int x = 0; x < burst.width; ++x)
      dark->dn.at(x, y) = static_cast<float>(test::night_black_dn + pattern_dn(x, y));
  }
  dark->mean_dn.fill(test::night_black_dn + 60);
  dark->noise_std_dn.fill(2 * test::night_gain_dn_per_e);
  dark->frames = dark->files = 64;
  const auto gain_db = [&](bool with_dark) {
    const FrameReader read = [&](int index, bool) {
      FrameToMerge out{burst.frame(index), burst.options(), {}};
      if (!with_dark) return Result<FrameToMerge>(std::move(out));
      for (int y = 0; y < burst.height; ++y) {
        for (int x = 0; x < burst.width; ++x) {
          std::uint16_t& dn = out.frame.raw.dn.at(x, y);
          dn = static_cast<std::uint16_t>(dn + pattern_dn(x, y));
        }
      }
      out.options.dark_frame = dark;
      return Result<FrameToMerge>(std::move(out));
    };
    InlineExecutor one;
    const auto merged = merge_frames(frames, read, {.alignment = MergeAlignment::subpixel}, one);
    EXPECT_TRUE(merged) << merged.error().message;
    const double single = burst.mean_square_error(burst.frame(0), middle);
    return 10 * std::log10(single / burst.mean_square_error(merged->frame, middle));
  };
  const double without = gain_db(false), with = gain_db(true);
  std::printf("gain without and with a dark frame: %.2f, %.2f dB\n", without, with);
  EXPECT_NEAR(with, without, 0.1);
}

// Frames displaced by whole cells show each pixel in one colour; the others are those of the first prediction. By the
// developed mosaic of their mean instead, the gain is 12.9 dB, and with the noise of frames that cover all
// colours 13.3.
TEST(MergeMoving, FramesThatDoNotCoverAllColoursGainToo) {
  constexpr int frames = 32;
  Burst burst = hand_held(20);
  burst.position = [](int index, double x, double y) { return std::array{x + 2 * (index % 5), y - 2 * (index % 7)}; };
  const double single = burst.mean_square_error(burst.frame(0), middle);
  const MergedRaw merged = burst.merged(frames, {.alignment = MergeAlignment::subpixel});
  const double gain_db = 10 * std::log10(single / burst.mean_square_error(merged.frame, middle));
  std::printf("gain of %d frames displaced by whole cells: %.2f dB\n", frames, gain_db);
  EXPECT_GT(gain_db, 13.35);
}

/// Shades the corners of a frame to a share of its light, and states the gain that corrects it. Saturated pixels stay.
void shade(RawFrame& frame, double corner_fraction) {
  const double k = 1 / corner_fraction - 1;
  const Plane<std::uint16_t>& dn = frame.raw.dn;
  const double cx = 0.5 * (dn.width() - 1), cy = 0.5 * (dn.height() - 1), corner2 = cx * cx + cy * cy;
  for (int y = 0; y < dn.height(); ++y) {
    for (int x = 0; x < dn.width(); ++x) {
      if (frame.raw.dn.at(x, y) >= test::night_white_dn) continue;
      const double r2 = (std::pow(x - cx, 2) + std::pow(y - cy, 2)) / corner2;
      const double above = (frame.raw.dn.at(x, y) - test::night_black_dn) / (1 + k * r2);
      frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(test::night_black_dn + above));
    }
  }
  frame.corrections.radial_gains = {RadialGain{.k = {k}}};
}

// Content that a lens shades in one frame is brighter in another, where it is nearer to the middle.
TEST(MergeMoving, ShadingOfTheLensIsThatOfTheReference) {
  const Burst even = hand_held(60);
  const MergedRaw expected = even.merged(6, {.alignment = MergeAlignment::subpixel});
  // Mean and mean square, relative to the scene.
  const auto relative_errors = [&](const MergedRaw& merged, double corner_fraction) {
    std::pair<double, double> out;
    for (int y = middle.y; y < middle.y + middle.height; ++y) {
      for (int x = middle.x; x < middle.x + middle.width; ++x) {
        const double r2 = (std::pow(x - 159.5, 2) + std::pow(y - 127.5, 2)) / (159.5 * 159.5 + 127.5 * 127.5);
        const double share = 1 / (1 + (1 / corner_fraction - 1) * r2);
        const double error = Burst::signal_e(merged.frame, x, y) / share / even.truth_e(x, y) - 1;
        out.first += error / (middle.width * middle.height);
        out.second += error * error / (middle.width * middle.height);
      }
    }
    return out;
  };
  for (const double corner_fraction : {0.7, 0.4}) {
    Burst shaded = even;
    shaded.disturb = [&](RawFrame& frame, int) { shade(frame, corner_fraction); };
    const MergedRaw merged = shaded.merged(6, {.alignment = MergeAlignment::subpixel});
    for (std::size_t i = 1; i < merged.frames.size(); ++i) {
      EXPECT_GT(merged.frames[i].used_fraction, 0.97) << i << ' ' << corner_fraction;
      EXPECT_NEAR(merged.frames[i].largest_shift_px, expected.frames[i].largest_shift_px, 0.3)
          << i << ' ' << corner_fraction;
    }
    const auto [bias, square] = relative_errors(merged, corner_fraction);
    EXPECT_NEAR(bias, 0, 0.005) << corner_fraction;
    EXPECT_LT(square, 1.1 * relative_errors(expected, 1).second) << corner_fraction;
  }
}

TEST(MergeMoving, ShadingLeavesSaturatedPixelsWhite) {
  Burst burst = hand_held(60);
  const auto is_lamp = [](double x, double y) { return std::hypot(x - 250, y - 70) < 30; };
  burst.scene = [&](double x, double y, int colour) { return is_lamp(x, y) ? 1e5 : test::textured(x, y, colour, 60); };
  burst.disturb = [&](RawFrame& frame, int) { shade(frame, 0.4); };
  for (const bool robust : {false, true}) {
    const MergedRaw merged = burst.merged(4, {.robust = robust, .alignment = MergeAlignment::subpixel});
    for (int y = 60; y < 80; ++y) {
      for (int x = 240; x < 260; ++x) {
        ASSERT_GE(Burst::signal_e(merged.frame, x, y), 0.99 * test::night_full_e()) << x << ' ' << y << ' ' << robust;
      }
    }
  }
}

TEST(MergeMoving, WhatMovesInTheSceneStaysThatOfTheReference) {
  Burst burst = hand_held(20);
  burst.disturb = [](RawFrame& frame, int index) {
    for (int y = 60; y < 110; ++y) {
      for (int x = 60 + 15 * index; x < 110 + 15 * index; ++x) {
        frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(frame.raw.dn.at(x, y) + 4 * 40);
      }
    }
  };
  const Burst still = hand_held(20);
  const MergedRaw merged = burst.merged(8);
  // Where an object is in other frames, and not in the reference: no worse than the reference alone.
  const Rect swept{115, 60, 120, 50};
  EXPECT_LT(still.mean_square_error(merged.frame, swept), still.mean_square_error(still.frame(0), swept));
  // Where it is in the reference, it stays there.
  double sum = 0;
  for (int y = 65; y < 105; ++y) {
    for (int x = 65; x < 105; ++x) sum += Burst::signal_e(merged.frame, x, y) - still.truth_e(x, y);
  }
  EXPECT_NEAR(sum / (40 * 40), 40, 3);
  ASSERT_TRUE(merged.frame.noise_ratio);
}

TEST(MergeMoving, TheNoiseRatioStatesTheNoiseOfPlacesThatFewFramesShow) {
  const Burst burst = hand_held(20);
  const MergedRaw merged = burst.merged(8);
  ASSERT_TRUE(merged.frame.noise_ratio);
  const NoiseRatio& ratio = *merged.frame.noise_ratio;
  double corner = 0, centre = 0;
  for (int j = 0; j < 1; ++j) {
    for (int i = 0; i < ratio.ratio.width(); ++i) corner += static_cast<double>(ratio.ratio.at(i, j));
  }
  for (int i = 0; i < ratio.ratio.width(); ++i)
    centre += static_cast<double>(ratio.ratio.at(i, ratio.ratio.height() / 2));
  EXPECT_GT(corner, 1.5 * centre);
}

TEST(MergeMoving, IsTheSameForAnyNumberOfThreads) {
  Burst burst = hand_held(20);
  burst.width = 131;
  burst.height = 97;
  InlineExecutor one;
  constexpr int frames = 16;  // the reference is predicted a second time
  const MergedRaw expected = burst.merged(frames, {.alignment = MergeAlignment::subpixel}, &one);
  for (const int threads : {2, 3, 7}) {
    PoolExecutor pool(threads);
    const MergedRaw result = burst.merged(frames, {.alignment = MergeAlignment::subpixel}, &pool);
    EXPECT_TRUE(test::same_samples(result.frame.raw, expected.frame.raw)) << threads;
  }
}

TEST(MergeMoving, FramesOfPureNoiseDarkOrWhiteAreMerged) {
  Burst noise{.mean_e = 0};
  noise.scene = [](double, double, int) { return 0.0; };
  const MergedRaw merged = noise.merged(6, {.alignment = MergeAlignment::subpixel});
  // Drops average neighbours too; without structure to align by, displacements are 0 and each site is its own drop.
  const double left = noise.mean_square_error(merged.frame) / noise.mean_square_error(noise.frame(0));
  EXPECT_LT(left, 1.03 / 6);
  EXPECT_GT(left, 0.6 / 6);
  for (const auto alignment : {MergeAlignment::cells, MergeAlignment::subpixel}) {
    Burst white{.width = 64, .height = 48};
    white.disturb = [](RawFrame& frame, int) {
      std::fill_n(frame.raw.dn.data(), frame.raw.dn.size(), std::uint16_t{16383});
    };
    const MergedRaw saturated = white.merged(16, {.alignment = alignment});  // the reference is predicted twice
    for (std::size_t i = 0; i < saturated.frame.raw.dn.size(); ++i) ASSERT_EQ(saturated.frame.raw.dn.data()[i], 65535);
    const Burst narrow{.width = 2, .height = 301};
    EXPECT_EQ(narrow.merged(16, {.alignment = alignment}).frame.raw.dn.height(), 301);
  }
}

}  // namespace
}  // namespace lowlux::isp
