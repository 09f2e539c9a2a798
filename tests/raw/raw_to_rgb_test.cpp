#include "isp/raw/kernel/raw_to_rgb.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include "tests/raw/raw_to_rgb_support.h"

namespace lowlux {
namespace {

using namespace raw_to_rgb_testing;
using reference::Rgb;

const ToneTable& tone() {
  static const ToneTable table = reference::srgb_tone_table();
  return table;
}

constexpr std::uint8_t guard8 = 0xA5;
constexpr std::uint16_t guard16 = 0xA5A5;
constexpr float guard_float = -777;

/// Largest distances from the reference of one picture in all three outputs; fails where a guard sample changed.
struct Distance {
  double codes8 = 0;   // of 255
  double codes16 = 0;  // of 65535
  double linear = 0;   // of 1
};

void expect_guards(const auto& picture, auto guard, int used_width) {
  for (int y = 0; y < picture.height; ++y) {
    for (int x = used_width; x < picture.stride; ++x) {
      ASSERT_EQ(picture.memory[static_cast<std::size_t>(y) * picture.stride + x], guard) << "beyond row " << y;
    }
  }
}

Distance distance(const isp::RgbInput& in, const isp::RgbTransform& transform, const std::vector<Rgb>& expected,
                  int width, int height) {
  InlineExecutor one;
  isp::RawToRgb kernel(width, 1);
  Strided<std::uint8_t> codes8(3 * width, height, 7, guard8);
  Strided<std::uint16_t> codes16(3 * width, height, 7, guard16);
  std::vector<Strided<float>> planes(3, Strided<float>(width, height, 7, guard_float));
  kernel.rgb8(in, transform, tone(), codes8.view(), one);
  kernel.rgb16(in, transform, tone(), codes16.view(), one);
  kernel.linear(in, transform, {planes[0].view(), planes[1].view(), planes[2].view()}, one);
  Distance worst;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const double want = expected[static_cast<std::size_t>(y) * width + x][c];
        const double encoded = reference::srgb_encoded(want);
        worst.codes8 = std::fmax(worst.codes8, std::fabs(codes8.view().at(3 * x + c, y) - 255 * encoded));
        worst.codes16 = std::fmax(worst.codes16, std::fabs(codes16.view().at(3 * x + c, y) - 65535 * encoded));
        worst.linear = std::fmax(worst.linear, std::fabs(planes[c].view().at(x, y) - want));
      }
    }
  }
  expect_guards(codes8, guard8, 3 * width);
  expect_guards(codes16, guard16, 3 * width);
  for (const auto& plane : planes) expect_guards(plane, guard_float, width);
  return worst;
}

/// 8 bits: half a code of rounding and a third of a code that one bin of the table spans at most.
/// 16 bits: half a code, the table's interpolation and float rounding at the steepest part of the curve.
/// Linear: float rounding of sums of about ten terms below 3.
void expect_close(const Distance& d) {
  EXPECT_LT(d.codes8, 0.85);
  EXPECT_LT(d.codes16, 2.5);
  EXPECT_LT(d.linear, 3e-6);
}

std::vector<std::array<int, 2>> sizes() {
  std::vector<std::array<int, 2>> out;
  for (int w = 1; w <= 9; ++w) {
    for (int h = 1; h <= 9; ++h) out.push_back({w, h});
  }
  for (const auto& size :
       {std::array{15, 4}, {16, 5}, {17, 3}, {31, 7}, {33, 6}, {63, 2}, {64, 3}, {65, 9}, {257, 11}}) {
    out.push_back(size);
  }
  return out;
}

TEST(RawToRgb, EqualsTheReferenceFromDnOnEveryPhaseAndSize) {
  for (const BayerPhase phase : all_phases) {
    for (const auto [w, h] : sizes()) {
      SCOPED_TRACE(testing::Message() << "phase " << static_cast<int>(phase) << ", " << w << " x " << h);
      const auto dn = random_dn(w, h, 100 * w + h);
      const isp::DnMosaic in{dn.view(), phase, uneven_levels()};
      for (const bool move : {true, false}) {
        const auto transform = typical_transform(move);
        expect_close(distance(in, transform, reference_picture(in, transform), w, h));
      }
    }
  }
}

TEST(RawToRgb, EqualsTheReferenceFromSignedMosaicsOnEveryPhaseAndSize) {
  for (const BayerPhase phase : all_phases) {
    for (const auto [w, h] : sizes()) {
      SCOPED_TRACE(testing::Message() << "phase " << static_cast<int>(phase) << ", " << w << " x " << h);
      const auto value = random_signed(w, h, 100 * w + h);
      const isp::SignedMosaic in{value.view(), phase, {1.0f, 0.8f, 0.81f, 0.9f}};
      auto transform = typical_transform();
      if (w % 2 == 0) transform.clip = std::numeric_limits<float>::infinity();
      expect_close(distance(in, transform, reference_picture(in, transform), w, h));
    }
  }
}

TEST(RawToRgb, EqualsTheReferenceFromCameraPlanesOnEverySize) {
  for (const auto [w, h] : sizes()) {
    SCOPED_TRACE(testing::Message() << w << " x " << h);
    const auto r = random_signed(w, h, 1), g = random_signed(w, h, 2), b = random_signed(w, h, 3);
    const isp::CameraPlanes in{{r.view(), g.view(), b.view()}, {1.1f, 0.7f, 0.9f}};
    const auto transform = typical_transform();
    std::vector<Rgb> expected;
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x)
        expected.push_back(reference::transformed(reference::camera_rgb(in, x, y), transform));
    }
    expect_close(distance(in, transform, expected, w, h));
  }
}

TEST(RawToRgb, TakesOnePlaneThreeTimesForMonochrome) {
  const auto grey = random_signed(37, 5, 4);
  const isp::CameraPlanes in{{grey.view(), grey.view(), grey.view()}};
  const isp::RgbTransform transform{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.2126f, 0.7152f, 0.0722f}, 1.0f, true};
  InlineExecutor one;
  isp::RawToRgb kernel(37, 1);
  Strided<std::uint8_t> out(3 * 37, 5, 0, 0);
  kernel.rgb8(in, transform, tone(), out.view(), one);
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 37; ++x) {
      const int code = out.view().at(3 * x, y);
      EXPECT_NEAR(code, 255 * reference::srgb_encoded(grey.view().at(x, y)), 0.85);
      EXPECT_EQ(code, out.view().at(3 * x + 1, y));
      EXPECT_EQ(code, out.view().at(3 * x + 2, y));
    }
  }
}

TEST(RawToRgb, CountsSamplesThatAreNotNumbersAsZeroAndLimitsHugeOnes) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  for (const float odd_one : {nan, -nan, infinity, -infinity, 3e38f, -3e38f}) {
    auto value = random_signed(40, 6, 5);
    value.view().at(17, 2) = odd_one;
    value.view().at(38, 5) = odd_one;
    auto replaced = value;
    const float stands_for = std::isnan(odd_one) ? 0.0f : std::copysign(1e9f, odd_one);
    replaced.view().at(17, 2) = replaced.view().at(38, 5) = stands_for;
    InlineExecutor one;
    isp::RawToRgb kernel(40, 1);
    Strided<std::uint8_t> a(120, 6, 0, 0), b(120, 6, 0, 1);
    kernel.rgb8(isp::SignedMosaic{value.view()}, typical_transform(), tone(), a.view(), one);
    kernel.rgb8(isp::SignedMosaic{replaced.view()}, typical_transform(), tone(), b.view(), one);
    EXPECT_EQ(a.memory, b.memory) << odd_one;
  }
}

TEST(RawToRgb, MakesBlackOfATransformThatIsNotFinite) {
  const auto dn = random_dn(33, 4, 6);
  auto transform = typical_transform();
  transform.matrix.fill(std::numeric_limits<float>::quiet_NaN());
  transform.luminance.fill(std::numeric_limits<float>::infinity());
  InlineExecutor one;
  isp::RawToRgb kernel(33, 1);
  Strided<std::uint8_t> out(99, 4, 0, 1);
  for (const bool move : {true, false}) {
    transform.move_into_gamut = move;
    kernel.rgb8(isp::DnMosaic{dn.view(), BayerPhase::rggb, uneven_levels()}, transform, tone(), out.view(), one);
    EXPECT_EQ(out.memory, std::vector<std::uint8_t>(out.memory.size(), 0));
  }
}

TEST(RawToRgb, GivesTheSameBytesWithAnyNumberOfThreads) {
  for (const auto [w, h] : {std::array{101, 75}, {64, 2}, {7, 1}, {129, 13}}) {
    const auto dn = random_dn(w, h, 7);
    const isp::DnMosaic in{dn.view(), BayerPhase::gbrg, uneven_levels()};
    InlineExecutor one;
    isp::RawToRgb single(w, 1);
    Strided<std::uint8_t> expected(3 * w, h, 0, 0);
    single.rgb8(in, typical_transform(), tone(), expected.view(), one);
    for (const int threads : {2, 3, 7}) {
      for (const int scratch_threads : {threads, 2}) {  // a kernel made for fewer threads than the executor has
        PoolExecutor pool(threads);
        isp::RawToRgb kernel(w + 9, scratch_threads);
        Strided<std::uint8_t> out(3 * w, h, 0, 1);
        kernel.rgb8(in, typical_transform(), tone(), out.view(), pool);
        EXPECT_EQ(out.memory, expected.memory) << w << " x " << h << ", " << threads << " threads";
      }
    }
  }
}

/// Takes rows, and how each thread's came.
struct TakenRows {
  std::vector<std::uint8_t> codes;
  std::vector<std::vector<int>> rows;  // of each thread

  static void take(void* context, int thread, int y, const std::uint8_t* rgb, int width) {
    auto& self = *static_cast<TakenRows*>(context);
    std::copy_n(rgb, 3 * width, self.codes.data() + static_cast<std::ptrdiff_t>(3) * width * y);
    self.rows[static_cast<std::size_t>(thread)].push_back(y);
  }
};

TEST(RawToRgb, HandsOutTheRowsOfRgb8InOrderFromAnEvenOne) {
  for (const auto [w, h] : {std::array{101, 75}, {64, 2}, {7, 1}, {129, 13}}) {
    const auto dn = random_dn(w, h, 8);
    const isp::DnMosaic in{dn.view(), BayerPhase::grbg, uneven_levels()};
    InlineExecutor one;
    Strided<std::uint8_t> expected(3 * w, h, 0, 0);
    isp::RawToRgb(w, 1).rgb8(in, typical_transform(), tone(), expected.view(), one);
    for (const int threads : {1, 2, 3, 7}) {
      PoolExecutor pool(threads);
      isp::RawToRgb kernel(w, threads);
      TakenRows taken{std::vector<std::uint8_t>(expected.memory.size()), std::vector<std::vector<int>>(threads)};
      kernel.rows8(in, typical_transform(), tone(), {TakenRows::take, &taken}, pool);
      EXPECT_EQ(taken.codes, expected.memory) << w << " x " << h << ", " << threads << " threads";
      std::size_t all = 0;
      for (const std::vector<int>& rows : taken.rows) {
        all += rows.size();
        EXPECT_TRUE(rows.empty() || rows.front() % 2 == 0);
        for (std::size_t i = 1; i < rows.size(); ++i) EXPECT_EQ(rows[i], rows[i - 1] + 1);
      }
      EXPECT_EQ(all, static_cast<std::size_t>(h));
    }
  }
}

TEST(RawToRgb, WritesTheCodesOfRgb8InOtherOrdersAndNothingElse) {
  constexpr std::uint8_t guard = 0xA5;
  constexpr int padding = 5;  // bytes between rows
  for (const int w : {1, 2, 3, 15, 16, 17, 31, 32, 33, 63, 64, 65, 97, 1921}) {
    constexpr int h = 3;
    const auto dn = random_dn(w, h, 9);
    const isp::DnMosaic in{dn.view(), BayerPhase::gbrg, uneven_levels()};
    PoolExecutor pool(2);
    isp::RawToRgb kernel(w, 2);
    Encoded8 expected{Plane<std::uint8_t>(3 * w, h)};
    kernel.rgb8(in, typical_transform(), tone(), expected.codes.view(), pool);
    for (const int pixel_bytes : {3, 4}) {
      for (const bool is_bgr : {false, true}) {
        const std::ptrdiff_t stride = static_cast<std::ptrdiff_t>(pixel_bytes) * w + padding;
        std::vector<std::uint8_t> out(static_cast<std::size_t>(stride * h), guard);
        kernel.pixels8(in, typical_transform(), tone(), {out.data(), w, h, stride, pixel_bytes, is_bgr}, pool);
        for (int y = 0; y < h; ++y) {
          const std::uint8_t* const row = out.data() + stride * y;
          for (int x = 0; x < w; ++x) {
            for (int c = 0; c < 3; ++c) {
              ASSERT_EQ(row[pixel_bytes * x + (is_bgr ? 2 - c : c)], expected.codes.at(3 * x + c, y)) << w << " " << x;
            }
            if (pixel_bytes == 4) {
              ASSERT_EQ(row[4 * x + 3], 255);
            }
          }
          for (int i = 0; i < padding; ++i) ASSERT_EQ(row[pixel_bytes * w + i], guard) << w;
        }
      }
    }
  }
}

TEST(RawToRgb, KeepsConstantMosaicsConstant) {
  constexpr int w = 23, h = 9;
  for (const BayerPhase phase : all_phases) {
    Strided<float> value(w, h, 0, 0.25f);
    const isp::RgbTransform plain{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {}, 1.0f, false};
    InlineExecutor one;
    isp::RawToRgb kernel(w, 1);
    std::vector<Strided<float>> out(3, Strided<float>(w, h, 0, 0));
    kernel.linear(isp::SignedMosaic{value.view(), phase}, plain, {out[0].view(), out[1].view(), out[2].view()}, one);
    for (const auto& plane : out) {
      for (const float v : plane.memory) EXPECT_NEAR(v, 0.25, 1e-7);
    }
  }
}

TEST(RawToRgb, ReproducesLinearRampsInTheInterior) {
  constexpr int w = 40, h = 12;
  const auto ramp = [](int x, int y) { return 0.1f + 0.011f * static_cast<float>(x) - 0.004f * static_cast<float>(y); };
  Strided<float> value(w, h, 0, 0);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) value.view().at(x, y) = ramp(x, y);
  }
  const isp::RgbTransform plain{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {}, 1.0f, false};
  InlineExecutor one;
  isp::RawToRgb kernel(w, 1);
  for (const BayerPhase phase : all_phases) {
    std::vector<Strided<float>> out(3, Strided<float>(w, h, 0, 0));
    kernel.linear(isp::SignedMosaic{value.view(), phase}, plain, {out[0].view(), out[1].view(), out[2].view()}, one);
    for (int y = 2; y < h - 2; ++y) {
      for (int x = 2; x < w - 2; ++x) {
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(out[c].view().at(x, y), ramp(x, y), 2e-7) << x << ' ' << y;
      }
    }
  }
}

TEST(RawToRgb, TurnsClippedHighlightsNeutral) {
  Strided<float> value(16, 8, 0, 1.0f);  // every site at the white level
  const isp::SignedMosaic in{value.view(), BayerPhase::rggb, {2.0f, 1.0f, 1.0f, 1.6f}};
  InlineExecutor one;
  isp::RawToRgb kernel(16, 1);
  Strided<std::uint8_t> out(48, 8, 0, 0);
  kernel.rgb8(in, typical_transform(), tone(), out.view(), one);
  EXPECT_EQ(out.memory, std::vector<std::uint8_t>(out.memory.size(), 255));
}

TEST(RawToRgb, BinsWholeCellsExactly) {
  for (const BayerPhase phase : all_phases) {
    for (const auto [w, h] : sizes()) {
      const auto dn = random_dn(w, h, w + h);
      const isp::DnMosaic in{dn.view(), phase, uneven_levels()};
      const auto mosaic = reference::linearised(in);
      InlineExecutor one;
      isp::RawToRgb kernel(w, 1);
      std::vector<Strided<float>> out(3, Strided<float>(w / 2, h / 2, 3, guard_float));
      kernel.bin2x2(in, {out[0].view(), out[1].view(), out[2].view()}, one);
      for (int y = 0; y < h / 2; ++y) {
        for (int x = 0; x < w / 2; ++x) {
          Rgb mean{};
          for (int site = 0; site < 4; ++site) {
            const int sx = 2 * x + (site & 1), sy = 2 * y + (site >> 1);
            const auto colour = colour_at(phase, sx, sy);
            mean[static_cast<int>(colour)] += mosaic.at(sx, sy) * (colour == CfaColour::green ? 0.5 : 1.0);
          }
          for (int c = 0; c < 3; ++c) {
            ASSERT_NEAR(out[c].view().at(x, y), mean[c], 3e-7) << w << " x " << h << " at " << x << ", " << y;
          }
        }
      }
      for (const auto& plane : out) expect_guards(plane, guard_float, w / 2);
    }
  }
}

TEST(RawToRgb, BinsSignedMosaicsLikeDnAndWithAnyNumberOfThreads) {
  constexpr int w = 70, h = 31;
  const auto dn = random_dn(w, h, 8);
  Strided<float> value(w, h, 0, 0);
  const auto levels = uneven_levels();
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      value.view().at(x, y) = static_cast<float>(dn.view().at(x, y)) - levels.black[site_of(x, y)];
    }
  }
  InlineExecutor one;
  PoolExecutor three(3);
  isp::RawToRgb kernel(w, 3);
  std::vector<Strided<float>> a(3, Strided<float>(w / 2, h / 2, 0, 0)), b(3, Strided<float>(w / 2, h / 2, 0, 1));
  kernel.bin2x2(isp::DnMosaic{dn.view(), BayerPhase::grbg, levels}, {a[0].view(), a[1].view(), a[2].view()}, one);
  kernel.bin2x2(isp::SignedMosaic{value.view(), BayerPhase::grbg, levels.gain}, {b[0].view(), b[1].view(), b[2].view()},
                three);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(a[c].memory, b[c].memory);
}

}  // namespace
}  // namespace lowlux
