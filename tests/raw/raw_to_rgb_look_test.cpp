#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "isp/base/executor.h"
#include "isp/base/look_grid.h"
#include "isp/raw/kernel/raw_to_rgb.h"
#include "tests/raw/raw_to_rgb_support.h"
#include "tests/reference/raw_to_rgb_ref.h"

namespace lowlux {
namespace {

using namespace raw_to_rgb_testing;

int cells(int pixels) { return (pixels + 3) / 4; }

/// Cells with each part drawn from its range, in rows that are longer than the grid.
struct RandomLook {
  std::vector<Strided<float>> parts;
  LookGrid grid;

  RandomLook(int width, int height, unsigned seed) {
    std::mt19937 random(seed);
    const std::array<std::array<float, 2>, LookGrid::parts> range{
        {{0, 1}, {0, 1}, {0, 0.3f}, {-0.2f, 1}, {-0.1f, 0.5f}}};
    for (int k = 0; k < LookGrid::parts; ++k) {
      std::uniform_real_distribution<float> value(range[k][0], range[k][1]);
      Strided<float>& part = parts.emplace_back(cells(width), cells(height), 3, 1e6f);
      for (int y = 0; y < part.height; ++y) {
        for (int x = 0; x < part.width; ++x) part.view().at(x, y) = value(random);
      }
    }
    for (int k = 0; k < LookGrid::parts; ++k) grid.part[k] = parts[k].view();
    grid.luminance = {0.2126f, 0.7152f, 0.0722f};
    grid.rods = {-0.0126f, 0.6204f, 0.3922f};
    grid.tint = {-0.213f, -0.0376f, 1.0f};
    grid.dark = 0.01f;
  }
};

TEST(RawToRgbLook, EqualsTheReferenceOnEverySize) {
  InlineExecutor executor;
  for (const int width : {1, 2, 3, 4, 5, 7, 8, 15, 16, 17, 33, 64, 71}) {
    for (const int height : {1, 2, 5, 13}) {
      const auto mosaic = random_signed(width, height, 3);
      const isp::SignedMosaic in{mosaic.view(), BayerPhase::grbg, {2, 1, 1, 1.6f}};
      const RandomLook look(width, height, 4);
      isp::RgbTransform transform = typical_transform(false);
      const std::vector<reference::Rgb> plain = reference_picture(in, transform);
      transform.look = &look.grid;
      SceneLinear out(width, height);
      isp::RawToRgb(width, 1).linear(in, transform, out.view(), executor);
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          const reference::Rgb expected =
              reference::seen(plain[static_cast<std::size_t>(y) * width + x], look.grid, x, y);
          for (int c = 0; c < 3; ++c) {
            // Values to 10 in float, through some twenty operations, divided by as little as 0.01.
            ASSERT_NEAR(out.plane[c].at(x, y), expected[c], 2e-4) << width << "x" << height << " at " << x << "," << y;
          }
        }
      }
    }
  }
}

TEST(RawToRgbLook, OfDaylightChangesNothing) {
  constexpr int width = 37, height = 9;
  InlineExecutor executor;
  const auto mosaic = random_signed(width, height, 5);
  const isp::SignedMosaic in{mosaic.view(), BayerPhase::rggb, {1, 1, 1, 1}};
  RandomLook look(width, height, 6);
  const std::array<float, LookGrid::parts> daylight{0, 1, 0, 1, 0};
  for (int k = 0; k < LookGrid::parts; ++k) {
    for (float& value : look.parts[k].memory) value = daylight[k];
  }
  isp::RgbTransform transform = typical_transform(false);
  SceneLinear plain(width, height), seen(width, height);
  isp::RawToRgb kernel(width, 1);
  kernel.linear(in, transform, plain.view(), executor);
  transform.look = &look.grid;
  kernel.linear(in, transform, seen.view(), executor);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < plain.plane[c].size(); ++i) {
      ASSERT_NEAR(seen.plane[c].data()[i], plain.plane[c].data()[i], 3e-6);  // rounding of values to 5
    }
  }
}

TEST(RawToRgbLook, LeavesTheReddestRedsWhatSodiumLightLeaves) {
  InlineExecutor executor;
  Plane<float> red(4, 4), none(4, 4);
  std::fill_n(red.data(), 16, 0.5f);
  std::fill_n(none.data(), 16, 0.0f);
  RandomLook look(4, 4, 9);
  const std::array<float, LookGrid::parts> night{1, 0, 0, 1, 0};
  for (int k = 0; k < LookGrid::parts; ++k) std::ranges::fill(look.parts[k].memory, night[k]);
  isp::RgbTransform transform;
  transform.luminance = look.grid.luminance;
  transform.move_into_gamut = false;
  transform.look = &look.grid;
  SceneLinear out(4, 4);
  isp::RawToRgb(4, 1).linear(isp::CameraPlanes{{red.view(), none.view(), none.view()}, {1, 1, 1}}, transform,
                             out.view(), executor);
  const float expected = 0.5f * look.grid.luminance[0] * LookGrid::min_rods;
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(out.plane[c].at(1, 1), expected, 1e-7) << "grey, and not black";
}

TEST(RawToRgbLook, GivesTheSameBytesWithAnyNumberOfThreads) {
  constexpr int width = 83, height = 61;
  const auto mosaic = random_dn(width, height, 7);
  const isp::DnMosaic in{mosaic.view(), BayerPhase::bggr, uneven_levels()};
  const RandomLook look(width, height, 8);
  isp::RgbTransform transform = typical_transform();
  transform.look = &look.grid;
  const ToneTable tone = reference::srgb_tone_table();
  std::vector<std::uint8_t> first;
  for (const int threads : {1, 2, 3, 7}) {
    PoolExecutor executor(threads);
    Plane<std::uint8_t> out(3 * width, height);
    isp::RawToRgb(width, threads).rgb8(in, transform, tone, out.view(), executor);
    const std::vector<std::uint8_t> bytes(out.data(), out.data() + out.size());
    if (first.empty()) first = bytes;
    ASSERT_EQ(bytes, first) << threads << " threads";
  }
}

// Means of whole cells by hand; what lies beyond the picture mirrors it.
TEST(RawToRgbQuarter, IsTheMeanOfSquaresOfSixteenPixels) {
  InlineExecutor executor;
  for (const BayerPhase phase : all_phases) {
    for (const int width : {4, 6, 12, 37}) {
      for (const int height : {4, 9}) {
        const auto mosaic = random_signed(width, height, 9);
        const isp::SignedMosaic in{mosaic.view(), phase, {2, 1, 3, 1.5f}};
        const reference::LinearisedMosaic linear = reference::linearised(in);
        CameraRgb out(cells(width), cells(height));
        isp::RawToRgb(width, 1).quarter(in, out.view(), executor);
        for (int y = 0; y < out.height(); ++y) {
          for (int x = 0; x < out.width(); ++x) {
            std::array<double, 3> sum{}, n{};
            for (int k = 0; k < 16; ++k) {
              const int column = 4 * x + k % 4, row = 4 * y + k / 4;
              const auto colour = static_cast<int>(colour_at(phase, column, row));
              sum[colour] += linear.at(column, row);
              n[colour] += 1;
            }
            for (int c = 0; c < 3; ++c) ASSERT_NEAR(out.plane[c].at(x, y), sum[c] / n[c], 2e-6) << width << " " << x;
          }
        }
      }
    }
  }
}

TEST(RawToRgbQuarter, OfPlanesIsTheirMean) {
  constexpr int width = 12, height = 8;
  InlineExecutor executor;
  const auto plane = random_signed(width, height, 10);
  const isp::CameraPlanes in{{plane.view(), plane.view(), plane.view()}, {1, 2, 3}};
  CameraRgb out(3, 2);
  isp::RawToRgb(width, 1).quarter(in, out.view(), executor);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 3; ++x) {
      double sum = 0;
      for (int k = 0; k < 16; ++k) sum += plane.view().at(4 * x + k % 4, 4 * y + k / 4);
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(out.plane[c].at(x, y), (c + 1) * sum / 16, 3e-6);
    }
  }
}

}  // namespace
}  // namespace lowlux
