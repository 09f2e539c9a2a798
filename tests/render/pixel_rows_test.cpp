#include "isp/render/pixel_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace lowlux::isp {
namespace {

constexpr std::uint8_t guard = 0xA5;

std::vector<std::uint8_t> random_row(int width, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> row(static_cast<std::size_t>(3 * width));
  for (std::uint8_t& code : row) code = static_cast<std::uint8_t>(random());
  return row;
}

/// Widths below, at and above those of vectors, odd ones too.
constexpr int widths[] = {1, 2, 3, 15, 16, 17, 31, 32, 33, 63, 64, 65, 97, 1921};

struct Standard {
  YuvStandard standard;
  double kr, kb;
};
constexpr Standard standards[] = {{YuvStandard::bt601, 0.299, 0.114}, {YuvStandard::bt709, 0.2126, 0.0722}};

struct Yuv {
  double y, cb, cr;
};
Yuv exact(const Standard& s, double r, double g, double b) {
  const double luma = s.kr * r + (1 - s.kr - s.kb) * g + s.kb * b;
  return {16 + luma * 219 / 255, 128 + (b - luma) / (2 - 2 * s.kb) * 224 / 255,
          128 + (r - luma) / (2 - 2 * s.kr) * 224 / 255};
}

TEST(PixelRows, LumaIsTheStandardsRoundedToTheNearestCode) {
  for (const Standard& s : standards) {
    for (const int width : widths) {
      const auto rgb = random_row(width, 2);
      std::vector<std::uint8_t> y(static_cast<std::size_t>(width + 4), guard);
      luma_row(yuv_matrix(s.standard), rgb.data(), width, y.data());
      for (int x = 0; x < width; ++x) {
        const auto* p = &rgb[3 * static_cast<std::size_t>(x)];
        // Half a code, and 3 weights off by half of 1/65536 each.
        ASSERT_NEAR(y[static_cast<std::size_t>(x)], exact(s, p[0], p[1], p[2]).y, 0.5 + 1.5 * 255 / 65536) << width;
      }
      for (auto i = static_cast<std::size_t>(width); i < y.size(); ++i) ASSERT_EQ(y[i], guard);
    }
  }
}

TEST(PixelRows, ChromaIsThatOfTheMeanOfFourPixels) {
  for (const Standard& s : standards) {
    for (const int width : widths) {
      const auto above = random_row(width, 3), below = random_row(width, 4);
      const int pairs = (width + 1) / 2;
      std::vector<std::uint8_t> uv(static_cast<std::size_t>(2 * pairs + 4), guard);
      chroma_row(yuv_matrix(s.standard), above.data(), below.data(), width, uv.data());
      for (int i = 0; i < pairs; ++i) {
        const int left = 2 * i, right = std::min(left + 1, width - 1);
        double mean[3];
        for (int c = 0; c < 3; ++c) {
          const auto at = [&](const auto& row, int x) {
            return row[3 * static_cast<std::size_t>(x) + static_cast<std::size_t>(c)] / 4.0;
          };
          mean[c] = at(above, left) + at(above, right) + at(below, left) + at(below, right);
        }
        const Yuv want = exact(s, mean[0], mean[1], mean[2]);
        ASSERT_NEAR(uv[static_cast<std::size_t>(2 * i)], want.cb, 0.5 + 2.0 * 255 / 65536) << width;
        ASSERT_NEAR(uv[static_cast<std::size_t>(2 * i + 1)], want.cr, 0.5 + 2.0 * 255 / 65536) << width;
      }
      for (std::size_t i = 2 * static_cast<std::size_t>(pairs); i < uv.size(); ++i) ASSERT_EQ(uv[i], guard);
    }
  }
}

TEST(PixelRows, GreysHaveNoColourAndWhiteIsWhite) {
  for (const Standard& s : standards) {
    for (int grey = 0; grey < 256; ++grey) {
      const std::vector<std::uint8_t> rgb(3 * 34, static_cast<std::uint8_t>(grey));
      std::vector<std::uint8_t> y(34), uv(34);
      luma_row(yuv_matrix(s.standard), rgb.data(), 34, y.data());
      chroma_row(yuv_matrix(s.standard), rgb.data(), rgb.data(), 34, uv.data());
      for (const std::uint8_t code : uv) ASSERT_EQ(code, 128);
      for (const std::uint8_t code : y) ASSERT_EQ(code, std::lround(16 + grey * 219.0 / 255));
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
