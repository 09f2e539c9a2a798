#include "isp/model/vision/mesopic.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::isp {
namespace {

double m_of(double photopic, double ratio) { return mesopic_state({photopic, ratio * photopic}).m; }

// h(m) of CIE 191 in long double: the root must lie at a change of its sign.
long double residual(long double m, long double photopic, long double scotopic) {
  const long double v0 = 683.0L / 1699.0L;
  return 0.7670L + 0.3334L * std::log10((m * photopic + (1 - m) * scotopic * v0) / (m + (1 - m) * v0)) - m;
}

TEST(MesopicState, HasTheCheckValuesOfTheSpecification) {
  struct Row {
    double photopic, ratio, m, luminance;
  };
  for (const Row& row : {Row{0.005, 1, 0, 0.005},
                         {0.01, 1, 0.100200, 0.010000},
                         {0.01, 2.3, 0.187393, 0.018261},
                         {0.1, 0.5, 0.403757, 0.081375},
                         {0.1, 1, 0.433600, 0.100000},
                         {0.1, 2.3, 0.481560, 0.139268},
                         {0.3, 2.26, 0.624440, 0.373598},
                         {0.5, 2.3, 0.692648, 0.598396},
                         {1, 0.6, 0.760335, 0.955015},
                         {1, 2.3, 0.784596, 1.129215},
                         {3, 1, 0.926072, 3.000000},
                         {4.5, 2.5, 0.986008, 4.538288},
                         {5, 2.3, 1, 5}}) {
    const MesopicState state = mesopic_state({row.photopic, row.ratio * row.photopic});
    EXPECT_NEAR(state.m, row.m, 6e-7) << row.photopic << " " << row.ratio;  // six printed decimals
    EXPECT_NEAR(state.luminance_cd_m2, row.luminance, 6e-7) << row.photopic << " " << row.ratio;
  }
  EXPECT_NEAR(m_of(0.63, 50), 0.881757, 6e-7) << "where the plain iteration alternates for ever";
}

TEST(MesopicState, IsARootForEveryRatioAndLuminance) {
  for (int i = 0; i <= 200; ++i) {
    const double photopic = std::pow(10.0, -6 + i * 0.05);  // 1e-6 to 1e4
    for (int j = 0; j <= 60; ++j) {
      const double ratio = 0.1 * std::pow(600.0, j / 60.0);  // 0.1 to 60
      const MesopicState s = mesopic_state({photopic, ratio * photopic});
      ASSERT_TRUE(s.m >= 0 && s.m <= 1);
      if (s.m == 0) {
        ASSERT_LE(residual(0, photopic, ratio * photopic), 1e-12L) << photopic << " " << ratio;
      } else if (s.m == 1) {
        ASSERT_GE(residual(1, photopic, ratio * photopic), -1e-12L) << photopic << " " << ratio;
      } else {
        ASSERT_NEAR(static_cast<double>(residual(s.m, photopic, ratio * photopic)), 0, 2e-12);
      }
    }
  }
}

TEST(MesopicState, RisesWithoutAJumpWithLuminanceWhereThereIsOneRoot) {
  for (const double ratio : {0.3, 0.6, 1.0, 2.46, 10.0, 18.0, 60.0}) {
    double before = m_of(1e-4, ratio);
    for (int i = 0; i <= 4000; ++i) {
      const double m = m_of(std::pow(10.0, -4 + i * 0.0015), ratio);
      ASSERT_GE(m, before - 1e-11) << ratio;
      ASSERT_LT(m - before, 0.01) << ratio << " at step " << i;
      before = m;
    }
    EXPECT_EQ(before, 1);
  }
}

TEST(MesopicState, IsLogarithmicForEqualLuminances) {
  for (const double l : {0.006, 0.02, 0.3, 2.0, 4.9}) EXPECT_NEAR(m_of(l, 1), 0.7670 + 0.3334 * std::log10(l), 1e-11);
}

TEST(MesopicState, ClampsAtItsPublishedLimits) {
  EXPECT_EQ(m_of(0.0050056, 1), 0);
  EXPECT_GT(m_of(0.0050057, 1), 0);
  EXPECT_LT(m_of(4.99873, 1), 1);
  EXPECT_EQ(m_of(4.99875, 1), 1);
}

TEST(MesopicState, WithThreeRootsIsZeroBelowTheThresholdAndOneOfThemAbove) {
  EXPECT_EQ(m_of(0.04, 0.1), 0) << "h(0) < 0";
  double jump = 0, before = 0;
  for (int i = 0; i <= 1000; ++i) {
    const double m = m_of(0.02 + 0.0001 * i, 0.1);
    jump = std::max(jump, m - before);
    before = m;
  }
  EXPECT_GT(jump, 0.2) << "the documented jump";
}

TEST(MesopicState, OfDarkAbsurdAndBrokenFieldsIsDefined) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const LuminancePair& dark : {LuminancePair{0, 0}, {-1, -1}, {nan, nan}}) {
    EXPECT_EQ(mesopic_state(dark).m, 0);
    EXPECT_EQ(mesopic_state(dark).luminance_cd_m2, 0);
  }
  EXPECT_EQ(mesopic_state({infinity, infinity}).m, 1);
  const MesopicState no_rods = mesopic_state({1, 0}), no_cones = mesopic_state({0, 1});
  EXPECT_TRUE(std::isfinite(no_rods.m) && std::isfinite(no_rods.luminance_cd_m2));
  EXPECT_TRUE(no_cones.m > 0 && no_cones.m < 1);
  EXPECT_EQ(mesopic_state({1e-6, 2e-6}).luminance_cd_m2, 2e-6) << "scotopic luminance where m = 0";
}

TEST(MesopicLuminance, MixesByTheShareOfTheRods) {
  EXPECT_EQ(mesopic_luminance_cd_m2(1, {3, 7}), 3);
  EXPECT_DOUBLE_EQ(mesopic_luminance_cd_m2(0, {3, 7}), 7);
  EXPECT_DOUBLE_EQ(rod_fraction(0), 1);
  const double m = 0.4, v0 = 683.0 / 1699.0;
  EXPECT_NEAR(mesopic_luminance_cd_m2(m, {-3, 7}), (m * -3 + (1 - m) * 7 * v0) / (m + (1 - m) * v0), 1e-14);
}

TEST(ScotopicObserver, IsTheOneOf1951) {
  double sum = 0;
  for (const double value : scotopic_observer().values()) sum += value;
  EXPECT_NEAR(sum, 97.0713, 5e-5);
  EXPECT_EQ(scotopic_observer().at(507), 1);
}

// S/P by 1 nm sums with 1699/683 in the specification; 1700 here, and the 5 nm nodes of the lights.
TEST(ScotopicLuminance, OfLightsHasTheirRatio) {
  struct Row {
    const char* light;
    double exact, from_xyz, ward;
  };
  for (const Row& row : {Row{"E", 2.2598, 2.284, 2.310}, {"D65", 2.4631, 2.457, 2.573}, {"A", 1.4115, 1.427, 1.292}}) {
    const Spectrum light = *light_named(row.light);
    const LuminancePair pair = luminance_of(light);
    EXPECT_NEAR(pair.scotopic / pair.photopic / row.exact, 1700.0 / 1699.0, 1e-3) << row.light;
    const Xyz xyz = xyz_of(light), relative{xyz.x / xyz.y, 1, xyz.z / xyz.y};
    EXPECT_NEAR(scotopic_luminance(relative), row.from_xyz, 2e-3) << row.light;
    EXPECT_NEAR(scotopic_luminance_ward(relative), row.ward, 6e-3) << row.light;
  }
}

TEST(ScotopicLuminance, IsNeverNegative) {
  EXPECT_EQ(scotopic_luminance({1, 0.1, 0}), 0) << "a saturated red";
  EXPECT_GT(scotopic_luminance_ward({0, 1, 1}), 0) << "no X to divide by";
  EXPECT_EQ(scotopic_luminance_ward({1, 0, 0}), 0);
}

TEST(Pupil, NarrowsWithLight) {
  EXPECT_NEAR(pupil_diameter_mm(0.1), 4.9, 1e-12);
  EXPECT_NEAR(pupil_diameter_mm(100), 4.9 - 3 * std::tanh(1.2), 1e-12);
  EXPECT_EQ(pupil_diameter_mm(0), 7.9);
  EXPECT_NEAR(pupil_diameter_mm(1e-30), 7.9, 1e-6);
  EXPECT_EQ(retinal_illuminance_td(0), 0);
  EXPECT_NEAR(retinal_illuminance_td(0.1), 0.1 * 3.14159265358979 * 4.9 * 4.9 / 4, 1e-12);
}

}  // namespace
}  // namespace lowlux::isp
