#include "isp/model/colour/correlated_colour_temperature.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "isp/model/spectrum/cie_data.h"
#include "tests/support/sweep.h"

namespace lowlux::isp {
namespace {

double uv_distance(const Xy& a, const Xy& b) {
  const UvPrime p = *uv_prime_of(a), q = *uv_prime_of(b);
  return std::hypot(p.u - q.u, (p.v - q.v) * 2 / 3);
}

struct KnownLight {
  Xy xy;
  double cct_k;
  double duv;
};

// From the tables' spectra by an independent search (nearest Planckian in CIE 1960 uv, 5 nm sums).
constexpr KnownLight known_lights[] = {
    {{0.44758, 0.40745}, 2856, 1.5739e-05},   // A
    {{0.34567, 0.35851}, 5002, 0.0032085},    // D50
    {{0.31272, 0.32903}, 6504, 0.0032126},    // D65
    {{0.29903, 0.31488}, 7506, 0.0031372},    // D75
    {{0.33333, 0.33333}, 5456, -0.0044249},   // E
    {{0.31006, 0.31616}, 6773, -0.0021534},   // C
    {{0.37207, 0.37512}, 4224, 0.0017891},    // FL2
    {{0.38054, 0.37692}, 3999, 5.0609e-05},   // FL11
    {{0.52168, 0.41797}, 2071, 0.0011765},    // high-pressure sodium
    {{0.52923, 0.41137}, 1968, -0.00043519},  // high-pressure sodium C100S54
    {{0.57515, 0.42423}, 1717, 0.0063132},    // low-pressure sodium
    {{0.3112, 0.38294}, 6275, 0.029022},      // clear mercury
    {{0.42859, 0.38817}, 3012, -0.0053283},   // metal halide 3K
    {{0.30776, 0.32527}, 6814, 0.0038226},    // white LED
};

TEST(ColourTemperature, OfLampsAndIlluminantsIsTheKnownOne) {
  for (const KnownLight& light : known_lights) {
    const ColourTemperature found = *colour_temperature_of(light.xy);
    EXPECT_NEAR(found.cct_k, light.cct_k, 1 + 2e-4 * light.cct_k);  // K: xy has five digits, the known CCT is rounded
    EXPECT_NEAR(found.duv, light.duv, 2e-5);                        // uv: xy has five digits
    EXPECT_FALSE(found.at_end);
  }
}

// CIE 15:2018 tables T.8 (HP) and T.12 (LED): xy to four digits, CCT to 1 K.
constexpr KnownLight cie_lamps[] = {
    {{0.5330, 0.4150}, 1959, 0}, {{0.4778, 0.4158}, 2506, 0}, {{0.4302, 0.4075}, 3144, 0}, {{0.3812, 0.3797}, 4002, 0},
    {{0.3776, 0.3713}, 4039, 0}, {{0.4560, 0.4078}, 2733, 0}, {{0.4357, 0.4012}, 2998, 0}, {{0.3756, 0.3723}, 4103, 0},
    {{0.3422, 0.3502}, 5109, 0}, {{0.3118, 0.3236}, 6598, 0}, {{0.4474, 0.4066}, 2851, 0}, {{0.4557, 0.4211}, 2840, 0},
    {{0.4548, 0.4044}, 2724, 0}, {{0.3781, 0.3775}, 4070, 0},
};

TEST(ColourTemperature, OfTheLampsOfCie15IsThePublishedOne) {
  for (const KnownLight& lamp : cie_lamps) {
    // K: half a unit of the fourth digit of x and y is 0.1 mired.
    EXPECT_NEAR(colour_temperature_of(lamp.xy)->cct_k, lamp.cct_k, 0.5 + 0.15e-6 * lamp.cct_k * lamp.cct_k);
  }
}

// ANSI C78.377-2008 table 1: the middles of the quadrangles white LEDs are sold by; Duv to three digits.
constexpr KnownLight led_quadrangles[] = {
    {{0.4578, 0.4101}, 2725, 0.000}, {{0.4338, 0.4030}, 3045, 0.000}, {{0.4073, 0.3917}, 3465, 0.000},
    {{0.3818, 0.3797}, 3985, 0.001}, {{0.3611, 0.3658}, 4503, 0.001}, {{0.3447, 0.3553}, 5028, 0.002},
    {{0.3287, 0.3417}, 5665, 0.002}, {{0.3123, 0.3282}, 6530, 0.003},
};

TEST(ColourTemperature, OfTheQuadranglesOfWhiteLedsIsThePublishedOne) {
  for (const KnownLight& led : led_quadrangles) {
    const ColourTemperature found = *colour_temperature_of(led.xy);
    EXPECT_NEAR(found.cct_k, led.cct_k, 0.5 + 0.15e-6 * led.cct_k * led.cct_k);
    EXPECT_NEAR(found.duv, led.duv, 5.5e-4);
  }
}

TEST(PlanckianLocus, IsIlluminantAAt2855Point5K) {
  // CIE defines A as 2848 K with c2 = 1.435e-2, which is 2848 * 1.4388 / 1.435 with today's c2.
  const Xy a = *planckian_xy(2848 * 1.4388 / 1.435);
  // Five published digits, of sums over 380..780 nm: the sum over 360..830 nm used here lies 8e-6 lower in y.
  EXPECT_NEAR(a.x, 0.44758, 1.5e-5);
  EXPECT_NEAR(a.y, 0.40745, 1.5e-5);
}

TEST(PlanckianLocus, RoundTripsTemperatureAndDuv) {
  for (const double mired : test::ratios(12, 995, 1.13)) {
    for (const double duv : {-0.02, -0.003, 0.0, 0.003, 0.02}) {
      const Xy xy = *planckian_xy(1e6 / mired, duv);
      const ColourTemperature found = *colour_temperature_of(xy);
      EXPECT_NEAR(1e6 / found.cct_k, mired, 1e-6 * mired)
          << duv;  // the search stops at 1e-10, far points settle slower
      EXPECT_NEAR(found.duv, duv, 1e-9) << mired;
      EXPECT_FALSE(found.at_end);
    }
  }
}

TEST(PlanckianLocus, EndsAreStatedAndNotGuessedBeyond) {
  EXPECT_FALSE(planckian_xy(999));
  EXPECT_FALSE(planckian_xy(100001));
  EXPECT_FALSE(planckian_xy(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(planckian_xy(5000, std::numeric_limits<double>::infinity()));
  EXPECT_TRUE(colour_temperature_of({0.70, 0.29})->at_end);
  EXPECT_NEAR(colour_temperature_of({0.70, 0.29})->cct_k, planckian_min_k, 1);
  EXPECT_TRUE(colour_temperature_of({0.2, 0.2})->at_end);
  EXPECT_NEAR(colour_temperature_of({0.2, 0.2})->cct_k, planckian_max_k, 1000);
}

TEST(ColourTemperature, FarOffTheLocusIsStillTheNearestPoint) {
  // Brute force over the locus as oracle: no point of it may be nearer than the one found.
  for (const double x : test::steps(0.1, 0.7, 0.1)) {
    for (const double y : test::steps(0.05, 0.8, 0.15)) {
      const ColourTemperature found = *colour_temperature_of({x, y});
      const double distance = uv_distance({x, y}, *planckian_xy(std::fmin(found.cct_k, planckian_max_k)));
      for (const double mired : test::steps(10, 1000, 5)) {
        EXPECT_LE(distance, uv_distance({x, y}, *planckian_xy(1e6 / mired)) + 1e-7) << x << " " << y;
      }
    }
  }
}

TEST(ColourTemperature, OfNoChromaticityIsNone) {
  EXPECT_FALSE(colour_temperature_of({0.3, 0}));
  EXPECT_FALSE(colour_temperature_of({0.3, -0.2}));
  EXPECT_FALSE(colour_temperature_of({std::numeric_limits<double>::quiet_NaN(), 0.3}));
  EXPECT_FALSE(colour_temperature_of({1.9, 0.01}));
}

TEST(Daylight, HasTheChromaticitiesOfTheCieIlluminants) {
  // CIE quotes nominal temperatures for c2 = 1.438e-2 when the locus was fitted: D65 is 6504 K, D50 5003 K.
  const KnownLight published[] = {
      {{0.34567, 0.35850}, 5003, 0}, {{0.31272, 0.32903}, 6504, 0}, {{0.29902, 0.31485}, 7504, 0}};
  for (const KnownLight& light : published) {
    const Xy xy = *daylight_xy(light.cct_k);
    // The published xy are those of the illuminants' spectra; in y they lie 1e-4 below CIE's own quadratic for the
    // locus (y = 0.32903 for D65, where x = 0.31272 gives 0.32913).
    EXPECT_NEAR(xy.x, light.xy.x, 1.5e-4);
    EXPECT_NEAR(xy.y, light.xy.y, 1.5e-4);
  }
  EXPECT_FALSE(daylight_xy(3999));
  EXPECT_FALSE(daylight_xy(25001));
}

TEST(Daylight, TheTwoFormulasMeetAt7000K) {
  EXPECT_LT(uv_distance(*daylight_xy(7000), *daylight_xy(7000.001)), 2e-5);  // CIE's coefficients have five digits
}

TEST(WhiteOfTemperature, HasTheTemperatureItIsAskedForOverTheWholeRange) {
  for (const double kelvin : test::ratios(white_min_k, white_max_k, 1.02)) {
    const ColourTemperature found = *colour_temperature_of(*white_of_temperature(kelvin));
    // CIE's cubic for daylight is off by 0.34 % at 24885 K; the fading offset moves the nearest Planckian by 0.12 %.
    EXPECT_NEAR(found.cct_k / kelvin, 1, kelvin < 4000 ? 2e-3 : 4e-3) << kelvin;
    EXPECT_GT(found.duv, -1e-4) << kelvin;
    EXPECT_LT(found.duv, 0.0045) << kelvin;
  }
}

TEST(WhiteOfTemperature, MovesWithoutAJumpThroughTheJoin) {
  for (const double mired : test::steps(240, 310, 0.25)) {
    const Xy here = *white_of_temperature(1e6 / mired);
    const Xy next = *white_of_temperature(1e6 / (mired + 0.25));
    EXPECT_LT(uv_distance(here, next), 1.5e-4) << mired;  // the steps are up to 0.9e-4; the loci are 30e-4 apart
  }
  EXPECT_EQ(*white_of_temperature(3000), *planckian_xy(3000));
  EXPECT_EQ(*white_of_temperature(4000), *daylight_xy(4000));
  EXPECT_FALSE(white_of_temperature(1666));
  EXPECT_FALSE(white_of_temperature(25001));
}

}  // namespace
}  // namespace lowlux::isp
