#include "isp/metrics/picture_comparison.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "isp/model/colour/colour_difference.h"
#include "isp/render/output_space.h"
#include "tests/support/numbers.h"

namespace lowlux::isp {
namespace {

using test::nan;

constexpr int width = 67, height = 33;  // one piece of a row and a rest

/// A picture whose pixels have the CIELAB colour of(x, y) under D65.
template <class Colour>
SceneLinear picture_of(const Colour& of) {
  const Xyz white = xyz_of(white_d65).value();
  const auto back = [](double f) { return f > 24.0 / 116 ? f * f * f : (f - 16.0 / 116) * 108 / 841; };
  SceneLinear out(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Lab lab = of(x, y);
      const double f = (lab.l + 16) / 116;
      out.plane[0].at(x, y) = static_cast<float>(white.x * back(f + lab.a / 500));
      out.plane[1].at(x, y) = static_cast<float>(white.y * back(f));
      out.plane[2].at(x, y) = static_cast<float>(white.z * back(f - lab.b / 200));
    }
  }
  return out;
}

/// Returns the CIELAB colours of an image, row by row.
std::vector<Lab> lab_of_pixels(const SceneLinear& xyz) {
  const Xyz white = xyz_of(white_d65).value();
  std::vector<Lab> out;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      out.push_back(lab_of({xyz.plane[0].at(x, y), xyz.plane[1].at(x, y), xyz.plane[2].at(x, y)}, white));
    }
  }
  return out;
}

/// 11 x 7 colours of low chroma, 29 pixels of each and more.
Lab plain(int x, int y) { return {60, static_cast<double>(x % 11), static_cast<double>(y % 7)}; }

PictureComparison compared(const SceneLinear& a, const SceneLinear& b) {
  InlineExecutor one;
  return compare_pictures(a, b, one);
}

void expect_all(const DifferenceSummary& found, double expected, double tolerance) {
  EXPECT_NEAR(found.mean, expected, tolerance);
  EXPECT_NEAR(found.median, expected, tolerance);
  EXPECT_NEAR(found.percentile_95, expected, tolerance);
  EXPECT_NEAR(found.largest, expected, tolerance);
}

TEST(PictureComparison, OfAPictureWithItselfFindsNothing) {
  const SceneLinear a = picture_of(plain);
  const PictureComparison found = compared(a, a);
  expect_all(found.delta_e_ab, 0, 0);
  expect_all(found.delta_e_94c, 0, 0);
  expect_all(found.ciede2000, 0, 0);
  EXPECT_TRUE(std::isinf(found.psnr_db));
  EXPECT_NEAR(found.ssim.value(), 1, 1e-12);
  EXPECT_NEAR(found.gamut.convex_percent, 100, 1e-4);
  EXPECT_EQ(found.gamut.occupancy_percent, 100);
  EXPECT_EQ(found.pixels, 67U * 33);
  EXPECT_EQ(found.not_finite + found.reference_outside + found.test_outside + found.reference_beyond, 0U);
}

// 1e-3: float X, Y, Z, 6e-8 relative, times the slopes of f and 500.
TEST(PictureComparison, KnownShiftsHaveTheirDifferences) {
  const SceneLinear a = picture_of(plain);
  const PictureComparison lighter = compared(a, picture_of([](int x, int y) {
                                               const Lab c = plain(x, y);
                                               return Lab{c.l + 2, c.a, c.b};
                                             }));
  expect_all(lighter.delta_e_ab, 2, 1e-3);
  expect_all(lighter.delta_e_94c, 0, 1e-3);
  const SceneLinear grey = picture_of([](int, int) { return Lab{60, 0, 0}; });
  const SceneLinear tinted = picture_of([](int, int) { return Lab{60, 3, 4}; });
  expect_all(compared(grey, tinted).delta_e_94c, 5, 1e-3);
  expect_all(compared(tinted, grey).delta_e_94c, 5 / 1.225, 1e-3);  // S_C of the chroma 5 of A
  expect_all(compared(grey, tinted).ciede2000, ciede2000({60, 0, 0}, {60, 3, 4}), 1e-3);
}

TEST(PictureComparison, SummariesAreRanksOfThePixels) {
  std::vector<float> hundred;
  for (int i = 0; i < 100; ++i) hundred.push_back(static_cast<float>((37 * i) % 100 + 1));  // 1 to 100
  const DifferenceSummary found = summary_of(hundred);
  EXPECT_DOUBLE_EQ(found.mean, 50.5);
  EXPECT_EQ(found.median, 50);
  EXPECT_EQ(found.percentile_95, 95);
  EXPECT_EQ(found.largest, 100);
  std::vector<float> one{7}, none;
  EXPECT_EQ(summary_of(one).percentile_95, 7);
  EXPECT_TRUE(std::isnan(summary_of(none).mean) && std::isnan(summary_of(none).largest));
  std::vector<float> seven{3, 1, 2, 7, 6, 5, 4};
  EXPECT_EQ(summary_of(seven).median, 4);
  EXPECT_EQ(summary_of(seven).percentile_95, 7);
}

TEST(PictureComparison, PsnrAndSsimOfGreysHaveTheirClosedForms) {
  const auto grey = [](double code) {
    const Xyz white = xyz_of(white_d65).value();
    const double y = decode_transfer(OutputSpace::srgb, code);
    SceneLinear out(width, height);
    const std::array part{white.x, white.y, white.z};
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < out.plane[c].size(); ++i) out.plane[c].data()[i] = static_cast<float>(part[c] * y);
    }
    return out;
  };
  const PictureComparison found = compared(grey(0.5), grey(0.6));
  EXPECT_NEAR(found.psnr_db, 20, 1e-3);  // float codes: 1e-6 of 0.1
  // Without variance the structure is the same, and what is left is (2 a b + c1) / (a^2 + b^2 + c1).
  EXPECT_NEAR(found.ssim.value(), (2 * 0.5 * 0.6 + 1e-4) / (0.25 + 0.36 + 1e-4), 1e-5);
  EXPECT_EQ(found.gamut.reference_bins, 1U);
  EXPECT_TRUE(std::isnan(found.gamut.convex_percent)) << "one colour has no area";
}

TEST(PictureComparison, WhatADisplayHasNotIsClippedAndCounted) {
  const SceneLinear a = picture_of([](int x, int) { return Lab{x < 10 ? 150.0 : 60.0, 0, 0}; });
  const SceneLinear b = picture_of([](int x, int) { return Lab{x < 10 ? 100.0 : 60.0, 0, 0}; });
  const PictureComparison found = compared(a, b);
  EXPECT_EQ(found.reference_outside, 10U * height);
  EXPECT_EQ(found.test_outside, 0U) << "white itself is inside";
  EXPECT_GT(found.psnr_db, 80) << "shown, both are white";
  EXPECT_NEAR(found.delta_e_ab.largest, 50, 1e-3) << "the difference of colour is not clipped";
  const double a_step = 116 * std::cbrt(1.0002) - 16;  // Y = 1.0002
  EXPECT_EQ(compared(b, picture_of([&](int, int) { return Lab{a_step, 0, 0}; })).test_outside, found.pixels);
  const SceneLinear green = picture_of([](int, int) { return Lab{60, -150, 60}; });
  EXPECT_EQ(compared(a, green).test_outside, found.pixels);
}

TEST(PictureComparison, PixelsThatAreNoNumbersCountForNoColour) {
  SceneLinear a = picture_of(plain);
  SceneLinear b = picture_of([](int x, int y) {
    const Lab c = plain(x, y);
    return Lab{c.l + 2, c.a, c.b};
  });
  a.plane[0].at(3, 4) = std::numeric_limits<float>::quiet_NaN();
  b.plane[1].at(65, 30) = std::numeric_limits<float>::infinity();
  const PictureComparison found = compared(a, b);
  EXPECT_EQ(found.not_finite, 2U);
  expect_all(found.delta_e_ab, 2, 1e-3);
  EXPECT_TRUE(std::isfinite(found.psnr_db));
  for (auto& plane : a.plane) std::fill_n(plane.data(), plane.size(), std::numeric_limits<float>::quiet_NaN());
  const PictureComparison nothing = compared(a, b);
  EXPECT_EQ(nothing.not_finite, nothing.pixels);
  EXPECT_TRUE(std::isnan(nothing.ciede2000.mean));
  EXPECT_TRUE(std::isnan(nothing.gamut.occupancy_percent));
}

TEST(PictureComparison, LightFarBeyondWhiteIsOutOfTheGamutsReach) {
  const SceneLinear a = picture_of(plain);
  const SceneLinear lamp = picture_of([](int x, int y) { return x == 0 && y == 0 ? Lab{900, 1500, 0} : plain(x, y); });
  const PictureComparison found = compared(lamp, a);
  EXPECT_EQ(found.reference_beyond, 1U);
  EXPECT_EQ(found.test_beyond, 0U);
  EXPECT_NEAR(found.gamut.convex_percent, 100, 1e-4);
}

TEST(PictureComparison, MeanOf94cOverLabPlanesIsThatOfTheComparison) {
  const SceneLinear a = picture_of(plain);
  const SceneLinear b = picture_of([](int x, int y) { return Lab{50, x % 5 - 7.0, y % 9 + 3.0}; });
  std::vector<Lab> first = lab_of_pixels(a), second = lab_of_pixels(b);
  const Lab at = plain(9, 3);
  EXPECT_NEAR(first[3 * width + 9].a, at.a, 1e-3);
  EXPECT_NEAR(first[3 * width + 9].b, at.b, 1e-3);
  const double mean = mean_delta_e_94c(first, second);
  EXPECT_NEAR(mean, compared(a, b).delta_e_94c.mean, 1e-6 * mean);  // the comparison keeps floats
  EXPECT_GT(std::fabs(mean - mean_delta_e_94c(second, first)), 0.01) << "not symmetric";
  first[0].a = nan;
  second[1].l = nan;
  EXPECT_NEAR(mean_delta_e_94c(first, second), mean, 0.01);
  EXPECT_TRUE(std::isnan(mean_delta_e_94c({}, {})));
}

TEST(PictureComparison, ThreadsChangeNoBit) {
  const SceneLinear a = picture_of(plain);
  const SceneLinear b = picture_of([](int x, int y) { return Lab{40.0 + y, x % 13 - 7.0, y % 9 + 3.0}; });
  PoolExecutor three(3);
  const PictureComparison alone = compared(a, b), shared = compare_pictures(a, b, three);
  EXPECT_EQ(alone.ciede2000.mean, shared.ciede2000.mean);
  EXPECT_EQ(alone.delta_e_94c.percentile_95, shared.delta_e_94c.percentile_95);
  EXPECT_EQ(alone.gamut.convex_percent, shared.gamut.convex_percent);
  EXPECT_EQ(alone.psnr_db, shared.psnr_db);
  EXPECT_EQ(alone.ssim, shared.ssim);
  EXPECT_EQ(alone.test_outside, shared.test_outside);
}

/// Eq. 13 over windows summed pixel by pixel, with deviations from their means.
double slow_ssim(const Plane<float>& a, const Plane<float>& b) {
  double total = 0;
  int windows = 0;
  for (int y0 = 0; y0 + 11 <= a.height(); ++y0) {
    for (int x0 = 0; x0 + 11 <= a.width(); ++x0, ++windows) {
      const auto mean_over = [&](const auto& value) {
        double sum = 0, whole = 0;
        for (int y = 0; y < 11; ++y) {
          for (int x = 0; x < 11; ++x) {
            const double w = std::exp(-((x - 5) * (x - 5) + (y - 5) * (y - 5)) / (2 * 1.5 * 1.5));
            whole += w;
            sum += w * value(static_cast<double>(a.at(x0 + x, y0 + y)), static_cast<double>(b.at(x0 + x, y0 + y)));
          }
        }
        return sum / whole;
      };
      const double ma = mean_over([](double p, double) { return p; }),
                   mb = mean_over([](double, double q) { return q; });
      const double va = mean_over([&](double p, double) { return (p - ma) * (p - ma); });
      const double vb = mean_over([&](double, double q) { return (q - mb) * (q - mb); });
      const double cov = mean_over([&](double p, double q) { return (p - ma) * (q - mb); });
      total += (2 * ma * mb + 1e-4) * (2 * cov + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
    }
  }
  return total / windows;
}

TEST(Ssim, AgreesWithWindowsSummedPixelByPixel) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(0, 1);
  for (const float part : {0.0F, 0.1F, 0.9F}) {
    Plane<float> a(23, 17), b(23, 17);
    for (std::size_t i = 0; i < a.size(); ++i) {
      a.data()[i] = any(random);
      b.data()[i] = (1 - part) * a.data()[i] + part * any(random);
    }
    InlineExecutor one;
    EXPECT_NEAR(ssim(a.view(), b.view(), one).value(), slow_ssim(a, b), 1e-12) << "doubles: rounding of 121 terms";
    EXPECT_EQ(ssim(a.view(), b.view(), one), ssim(b.view(), a.view(), one));
  }
}

TEST(Ssim, OfANegativeIsNegativeAndNeedsOneWholeWindow) {
  Plane<float> a(11, 11), b(11, 11);
  for (int i = 0; i < 121; ++i) {
    a.data()[i] = i % 2 == 0 ? 0.0F : 1.0F;
    b.data()[i] = 1 - a.data()[i];
  }
  InlineExecutor one;
  EXPECT_LT(ssim(a.view(), b.view(), one).value(), -0.9);
  EXPECT_FALSE(ssim(a.view().crop(0, 0, 10, 11), b.view().crop(0, 0, 10, 11), one));
  EXPECT_FALSE(ssim(a.view().crop(0, 0, 11, 10), b.view().crop(0, 0, 11, 10), one));
}

}  // namespace
}  // namespace lowlux::isp
