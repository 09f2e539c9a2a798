// Floating-point samples go the way of codes: where both hold the same values, every result has the same bits.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "isp/base/dark_frame.h"
#include "isp/raw/black_point.h"
#include "isp/raw/measure/masked_black.h"
#include "isp/raw/measure/thumbnail.h"
#include "isp/raw/repair.h"
#include "isp/raw/subtract_dark_frame.h"
#include "isp/raw/to_linear.h"
#include "tests/support/as_floats.h"
#include "tests/support/executors.h"
#include "tests/support/frames.h"

namespace lowlux::isp {
namespace {

using test::one_thread;

constexpr double scales[] = {1, 1.0 / 65536, 1024};  // exact: powers of two

bool same_bits(const Plane<float>& a, const Plane<float>& b) {
  return a.width() == b.width() && a.height() == b.height() &&
         std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

/// A noisy frame with hot, dead and saturated pixels inside of a border.
RawDn noisy(SensorLayout layout, unsigned seed) {
  test::NormalDn normal(seed);
  const int samples = layout == SensorLayout::linear_rgb ? 3 : 1;
  RawDn raw = test::bayer_frame(samples * 111, 93, BayerPhase::gbrg, [&](int x, int y) {
    if ((37 * x + 11 * y) % 1009 == 3) return 3900;
    if ((41 * x + 17 * y) % 1013 == 3) return 4095;
    return (43 * x + 13 * y) % 1019 == 3 ? 0 : normal(300 + 2 * x + 3 * y, 12);
  });
  raw.layout = layout;
  raw.active = {3, 2, 101, 87};
  raw.default_crop = {0, 0, 101, 87};
  raw.black_tag = BlackLevel{.samples = samples, .pattern_dn = std::vector<double>(samples, 256)};
  return raw;
}

BlackPoint black_point(const RawDn& raw) { return *choose_black(raw, {BlackChoice::metadata}); }

TEST(FloatSamples, FractionsAndElectronsHaveTheBitsOfThoseOfCodes) {
  for (const SensorLayout layout : {SensorLayout::bayer, SensorLayout::monochrome}) {
    for (const bool pattern : {false, true}) {
      for (const double scale : scales) {
        RawDn codes = noisy(layout, 1), floats = noisy(layout, 1);
        if (pattern) {
          for (RawDn* raw : {&codes, &floats}) raw->black_tag = BlackLevel{.columns = 3, .pattern_dn = {250, 256, 261}};
        }
        test::make_floats(floats, scale);
        const RawFraction expected = to_fraction(codes, black_point(codes), one_thread);
        EXPECT_TRUE(same_bits(to_fraction(floats, black_point(floats), one_thread).value, expected.value)) << scale;
        const PerSite<double> electrons{1000.5, 2000.25, 2000.5, 1500};
        for (const int threads : {1, 2, 3, 7}) {
          PoolExecutor pool(threads);
          Plane<float> found(101, 87);
          to_electrons(floats, black_point(floats), electrons, found.view(), pool);
          EXPECT_TRUE(same_bits(
              found, to_electrons(to_fraction(codes, black_point(codes), one_thread), electrons, one_thread).value));
        }
      }
    }
  }
}

TEST(FloatSamples, DemosaicedFractionsHaveTheBitsOfThoseOfCodes) {
  RawDn codes = noisy(SensorLayout::linear_rgb, 2), floats = noisy(SensorLayout::linear_rgb, 2);
  test::make_floats(floats, 1.0 / 65536);
  CameraRgb expected(101, 87), found(101, 87);
  to_fraction_rgb(codes, black_point(codes), expected.view(), one_thread);
  to_fraction_rgb(floats, black_point(floats), found.view(), one_thread);
  for (int c = 0; c < 3; ++c) EXPECT_TRUE(same_bits(found.plane[c], expected.plane[c]));
}

TEST(FloatSamples, ValuesBelowBlackAndAboveWhiteStay) {
  RawDn raw = noisy(SensorLayout::bayer, 3);
  test::make_floats(raw, 1.0 / 65536);
  raw.black_tag->pattern_dn = {0};
  raw.white_dn.fill(1);
  raw.dn_float.at(10, 10) = -2.5F;
  raw.dn_float.at(11, 10) = 1e6F;
  raw.dn_float.at(12, 10) = 1e-9F;
  const RawFraction out = to_fraction(raw, black_point(raw), one_thread);
  EXPECT_EQ(out.value.at(7, 8), -2.5F);
  EXPECT_EQ(out.value.at(8, 8), 1e6F);
  EXPECT_EQ(out.value.at(9, 8), 1e-9F);
}

TEST(FloatSamples, ThumbnailsHaveTheBitsOfThoseOfCodes) {
  for (const SensorLayout layout : {SensorLayout::bayer, SensorLayout::monochrome, SensorLayout::linear_rgb}) {
    for (const double scale : scales) {
      RawFrame codes, floats;
      codes.raw = noisy(layout, 4);
      floats.raw = noisy(layout, 4);
      test::make_floats(floats.raw, scale);
      const Thumbnail expected = make_thumbnail(codes, black_point(codes.raw), one_thread);
      for (const int threads : {1, 2, 3, 7}) {
        PoolExecutor pool(threads);
        const Thumbnail found = make_thumbnail(floats, black_point(floats.raw), pool);
        EXPECT_TRUE(same_bits(found.clipped, expected.clipped));
        for (int c = 0; c < 3; ++c) EXPECT_TRUE(same_bits(found.mean.plane[c], expected.mean.plane[c]));
        EXPECT_DOUBLE_EQ(found.black_noise_std, expected.black_noise_std);
      }
    }
  }
}

TEST(FloatSamples, DefectsAreThoseOfCodes) {
  for (const double scale : scales) {
    for (const bool known : {false, true}) {
      RawDn codes = noisy(SensorLayout::bayer, 5), floats = noisy(SensorLayout::bayer, 5);
      test::make_floats(floats, scale);
      const DefectNoise noise{12, known ? 0.5 : 0}, scaled{12 * scale, known ? 0.5 * scale : 0};
      const auto expected = find_defects(codes, black_point(codes), noise, one_thread);
      EXPECT_GT(expected.size(), 8u);
      for (const int threads : {1, 2, 3, 7}) {
        PoolExecutor pool(threads);
        EXPECT_EQ(find_defects(floats, black_point(floats), scaled, pool), expected) << scale;
      }
    }
  }
}

TEST(FloatSamples, DefectsAreFoundBelowAThousandthOfACode) {
  RawDn raw = test::bayer_frame(40, 30, BayerPhase::rggb, [](int, int) { return 0; });
  test::make_floats(raw);
  raw.white_dn.fill(1);
  test::NormalDn normal(6);
  for (std::size_t i = 0; i < raw.dn_float.size(); ++i) {
    raw.dn_float.data()[i] = 1e-10F * static_cast<float>(normal(1000, 30) - 1000);  // half of the values are negative
  }
  raw.dn_float.at(20, 14) = 1e-7F;
  raw.dn_float.at(9, 21) = -1e-7F;
  const std::vector<Pixel> expected{{20, 14}, {9, 21}};
  EXPECT_EQ(find_defects(raw, black_point(raw), {.black_std_dn = 3e-9, .shot_dn = 1e-12}, one_thread), expected);
}

TEST(FloatSamples, MaskedPixelsAndDarkFramesAreOfCodes) {
  RawDn raw = noisy(SensorLayout::bayer, 7);
  raw.masked = {{0, 0, 111, 60}};
  raw.masked_is_stated = true;
  test::make_floats(raw);
  const MaskedBlack masked = measure_masked_black(raw);
  EXPECT_FALSE(masked.black);
  EXPECT_NE(masked.refusal.find("floating-point"), std::string::npos);
  DarkFrame dark;
  dark.dn = Plane<float>(101, 87);
  const auto black = black_of(raw, dark);
  ASSERT_FALSE(black);
  EXPECT_EQ(black.error().code, ErrorCode::unsupported);
}

}  // namespace
}  // namespace lowlux::isp
