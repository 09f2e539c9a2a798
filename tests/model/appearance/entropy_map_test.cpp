// The model of largest entropy as a map of colours.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "isp/model/appearance/entropy_model.h"
#include "isp/model/colour/colour_difference.h"
#include "tests/support/numbers.h"

namespace lowlux::isp {
namespace {

using test::inf;
using test::nan;

ColourMap map_at(double white_cd_m2, const EntropyOptions& options = {}) {
  return *entropy_colour_map({.white_cd_m2 = white_cd_m2}, options);
}

const Xyz rec709[] = {{0.4124, 0.2126, 0.0193}, {0.3576, 0.7152, 0.1192}, {0.1805, 0.0722, 0.9505},
                      {0.77, 0.9278, 0.1385},   {0.5929, 0.2848, 0.9698}, {0.5381, 0.7874, 1.0697},
                      {0.30, 0.25, 0.12},       {0.1, 0.12, 0.3}};
const Xyz white{0.95047, 1, 1.08883};

/// Distance from the white in u'v'.
double saturation(const Xyz& c) {
  const UvPrime uv = *uv_prime_of(*xy_of(c)), grey = *uv_prime_of(*xy_of(white));
  return std::hypot(uv.u - grey.u, uv.v - grey.v);
}

TEST(EntropyMap, SendsTheWhiteToTheDisplaysWhite) {
  const Xyz whites[] = {white, {1.09850, 1, 0.35585}, {1, 1, 1}};
  for (const EntropyVariant variant : {EntropyVariant::rendering, EntropyVariant::thesis}) {
    for (const PixelPower power : {PixelPower::lifted, PixelPower::luminance}) {
      for (const Xyz& from : whites) {
        const auto map = entropy_colour_map({.white_cd_m2 = 0.5, .white = from}, {.variant = variant, .power = power});
        ASSERT_TRUE(map);
        const Xyz to = (*map)(from);
        EXPECT_NEAR(to.x, white.x, 8e-15) << "rounding: 9e-16 was measured";
        EXPECT_NEAR(to.y, white.y, 2e-15) << "2e-16";
        EXPECT_NEAR(to.z, white.z, 1e-14) << "1e-15";
      }
    }
  }
}

TEST(EntropyMap, IsNearlyTheIdentityInDaylight) {
  double most = 0, max_old = 0;
  const ColourMap day = map_at(1000), day_old = map_at(1000, {.cones = ConeSet::smith_pokorny_1975});
  for (const Xyz& c : rec709) {
    most = std::fmax(most, ciede2000(lab_of(day(c), white), lab_of(c, white)));
    max_old = std::fmax(max_old, ciede2000(lab_of(day_old(c), white), lab_of(c, white)));
  }
  // Neither cones are sums of the CIE 1931 functions: what is found is a metamer to them, and another colour to the
  // observer of 1931. By how much, only the functions tell: 1.16 and 1.91 were measured, and a tenth more is
  // the limit. Stockman's and Sharpe's are the nearer ones.
  EXPECT_LT(most, 1.1 * 1.16);
  EXPECT_LT(max_old, 1.1 * 1.91);
  EXPECT_LT(most, max_old);
}

TEST(EntropyMap, LosesColourAsItGetsDarker) {
  for (const Xyz& c : rec709) {
    const double day = saturation(map_at(1000)(c)), dusk = saturation(map_at(5)(c)),
                 night = saturation(map_at(0.05)(c));
    EXPECT_LT(dusk, day);
    EXPECT_LT(night, dusk);
    EXPECT_LT(night, 0.5 * day);
    EXPECT_GT(night, 0);
  }
}

TEST(EntropyMap, BrightensBluesAndDarkensRedsInTheDark) {
  const ColourMap night = map_at(0.01);
  EXPECT_LT(night(rec709[0]).y, 0.7 * rec709[0].y) << "Purkinje's shift";
  EXPECT_GT(night(rec709[2]).y, 1.5 * rec709[2].y);
}

TEST(EntropyMap, IsHomogeneous) {
  for (const EntropyVariant variant : {EntropyVariant::rendering, EntropyVariant::thesis}) {
    for (const PixelPower power : {PixelPower::lifted, PixelPower::luminance}) {
      const ColourMap map = map_at(0.5, {.variant = variant, .power = power});
      for (const Xyz& c : rec709) {
        const Xyz one = map(c);
        for (const double s : {1e-9, 0.3, 1e6}) {
          const Xyz scaled = map({s * c.x, s * c.y, s * c.z});
          EXPECT_NEAR(scaled.x / s, one.x, 1e-14) << "rounding: 2e-15 was measured";
          EXPECT_NEAR(scaled.y / s, one.y, 3e-15) << "3e-16";
          EXPECT_NEAR(scaled.z / s, one.z, 6e-15) << "7e-16";
        }
      }
    }
  }
}

bool finite(const Xyz& c) { return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z); }

TEST(EntropyMap, HoldsForColoursThatAreNoLight) {
  for (const double white_cd_m2 : {1e-6, 0.5, 1000.0}) {
    const ColourMap map = map_at(white_cd_m2);
    const Xyz black = map({0, 0, 0});
    EXPECT_EQ(black.x, 0);
    EXPECT_EQ(black.y, 0);
    EXPECT_EQ(black.z, 0);
    const Xyz grey = map({0.3, -0.5, 0.1});
    EXPECT_DOUBLE_EQ(grey.x, -0.5 * white.x) << "the grey of its luminance";
    EXPECT_EQ(grey.y, -0.5);
    EXPECT_DOUBLE_EQ(grey.z, -0.5 * white.z);
    std::mt19937 engine(1);
    std::uniform_real_distribution<double> part(-1, 1);
    for (int i = 0; i < 300; ++i) {
      Xyz c{part(engine), part(engine), part(engine)};
      const double size = std::exp(690 * part(engine));  // 1e-300 to 1e300
      c = {size * c.x, size * c.y, size * c.z};
      EXPECT_TRUE(finite(map(c))) << c.x << " " << c.y << " " << c.z;
    }
    EXPECT_TRUE(finite(map({1e308, 1e308, 1e308})));
    EXPECT_TRUE(finite(map({5e-324, 5e-324, 5e-324})));
    EXPECT_TRUE(finite(map({0.1, 1e-9, 0.1})));
    for (const double bad : {nan, inf, -inf}) EXPECT_EQ(map({0.3, bad, 0.3}).y, 0);
  }
}

TEST(EntropyMap, RefusesConditionsThatAreNone) {
  const AppearanceModel model = entropy_appearance();
  EXPECT_TRUE(model.at({}));
  for (const double bad : {0.0, -1.0, nan, inf}) {
    EXPECT_FALSE(model.at({.white_cd_m2 = bad}));
    EXPECT_FALSE(model.at({.adaptation_cd_m2 = bad}));
    EXPECT_FALSE(model.at({.scotopic_ratio = bad}));
    EXPECT_FALSE(model.at({.white = {0.95, bad, 1}}));
  }
  EXPECT_FALSE(model.at({.white = {0.9, 0.1, 0.9}})) << "beyond the purples";
  EXPECT_EQ(model.at({.white_cd_m2 = -1}).error().code, ErrorCode::invalid_argument);
}

// See PixelPower: by luminance alone, too little power is put behind a saturated blue for its S response.
TEST(EntropyMap, LiftedPowerKeepsSaturatedBluesByDay) {
  const ColourMap lifted = map_at(1000), by_luminance = map_at(1000, {.power = PixelPower::luminance});
  const auto miss = [](const ColourMap& map, const Xyz& c) {
    return ciede2000(lab_of(map(c), white), lab_of(c, white));
  };
  EXPECT_LT(miss(lifted, rec709[2]), 0.5 * miss(by_luminance, rec709[2]));
}

}  // namespace
}  // namespace lowlux::isp
