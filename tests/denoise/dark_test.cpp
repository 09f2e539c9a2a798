#include "denoise/picture/resaturate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "isp/model/colour/chroma_bound.h"
#include "isp/model/colour/chromaticity_cloud.h"
#include "isp/model/colour/dark_desaturation.h"
#include "tests/denoise/draws.h"
#include "tests/support/numbers.h"

namespace lowlux::denoise::dark_test {
namespace {

using isp::Xyz;
using test::nan;
constexpr float inf = std::numeric_limits<float>::infinity();

/// Three planes of one colour.
SceneLinear even(int width, int height, const Xyz& colour) {
  SceneLinear out(width, height);
  const Vector3 values = isp::vector_of(colour);
  for (int k = 0; k < 3; ++k) std::fill_n(out.plane[k].data(), out.plane[k].size(), static_cast<float>(values[k]));
  return out;
}

TEST(BoxMean, IsTheMeanOfTheSquareCutAtTheEdges) {
  Plane<double> in(3, 3);
  for (int i = 0; i < 9; ++i) in.data()[i] = i;
  const Plane<double> out = box_mean(in, 1);
  EXPECT_DOUBLE_EQ(out.at(1, 1), 4);
  EXPECT_DOUBLE_EQ(out.at(0, 0), 2);       // of 0 1 3 4
  EXPECT_DOUBLE_EQ(out.at(2, 1), 4.5);     // of 1 2 4 5 7 8
  EXPECT_EQ(box_mean(in, 0).at(2, 1), 5);  // a copy
  EXPECT_DOUBLE_EQ(box_mean(in, 64).at(0, 2), 4);
  EXPECT_TRUE(box_mean(Plane<double>(), 3).empty());
}

TEST(BoxMean, IgnoresValuesThatAreNotFinite) {
  Plane<double> in(5, 1);
  for (int i = 0; i < 5; ++i) in.data()[i] = i;
  in.data()[1] = nan;
  in.data()[4] = std::numeric_limits<double>::infinity();
  const Plane<double> out = box_mean(in, 1);
  EXPECT_EQ(out.at(0, 0), 0);
  EXPECT_EQ(out.at(1, 0), 1);  // of 0 and 2
  EXPECT_EQ(out.at(4, 0), 3);
  EXPECT_TRUE(std::isnan(box_mean(in, 0).at(1, 0)));
}

TEST(BoxMean, LargeValuesLeaveNothingBehind) {
  Plane<double> in(9, 9);
  std::fill_n(in.data(), in.size(), 0.1);
  in.at(4, 4) = 1e30;
  EXPECT_DOUBLE_EQ(box_mean(in, 1).at(6, 6), 0.1);
}

TEST(SubtractDark, TakesEachSitesDarkAndKeepsTheSign) {
  RawElectrons charge{Plane<float>(3, 3), BayerPhase::grbg};
  std::fill_n(charge.value.data(), 9, 1.5f);
  charge.value.at(2, 2) = -7;
  const SignalElectrons signal = subtract_dark(std::move(charge), {1, 2, 4, 8});
  EXPECT_EQ(signal.value.at(0, 0), 0.5f);
  EXPECT_EQ(signal.value.at(1, 0), -0.5f);
  EXPECT_EQ(signal.value.at(0, 1), -2.5f);
  EXPECT_EQ(signal.value.at(1, 1), -6.5f);
  EXPECT_EQ(signal.value.at(2, 2), -8);
  EXPECT_EQ(signal.phase, BayerPhase::grbg);
  EXPECT_TRUE(subtract_dark(RawElectrons{}, {}).value.empty());
}

struct Drawn {
  test::MeanOf plane[3];
  Xyz xyz() const {
    return isp::xyz_of(test::table_camera * Vector3{plane[0].mean(), plane[1].mean(), plane[2].mean()});
  }
  /// Five standard errors of the chromaticity, to first order.
  double xy_error() const {
    Matrix3 covariance{};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        for (int k = 0; k < 3; ++k) {
          covariance[i][j] +=
              test::table_camera[i][k] * test::table_camera[j][k] * plane[k].variance() / plane[k].count;
        }
      }
    }
    return 5 * isp::rss_std(isp::propagated_cloud(xyz(), covariance)->covariance);
  }
};

/// 4096 draws of a patch, dark subtracted, signed or clipped at 0.
Drawn drawn(const Vector3& signal_e, double dark_e, double subtracted_e, bool clipped) {
  Drawn out;
  for (std::uint32_t k = 0; k < 3; ++k) {
    RawElectrons charge{Plane<float>(64, 64), BayerPhase::rggb};
    for (std::uint32_t i = 0; i < 4096; ++i) {
      charge.value.data()[i] = static_cast<float>(test::noisy_charge_e(31, i, k, signal_e[k] + dark_e, 1.5));
    }
    const double d = subtracted_e;
    const SignalElectrons signal = subtract_dark(std::move(charge), {d, d, d, d});
    for (int i = 0; i < 4096; ++i) {
      const float value = signal.value.data()[i];
      out.plane[k].add(clipped ? std::max(value, 0.0f) : value);
    }
  }
  return out;
}

double xy_distance(const isp::Xy& a, const isp::Xy& b) { return std::hypot(a.x - b.x, a.y - b.y); }

TEST(SubtractDark, MakesTheMeanChromaticityOneForAllDarksAndTheNaiveWayIsOffByWhatAlphaPredicts) {
  const Vector3 signal_e{1.741 * 20, 0.877 * 20, 0.383 * 20};
  const Xyz truth = isp::xyz_of(test::table_camera * signal_e);
  const isp::Xy c = *isp::xy_of(truth);
  for (const double dark_e : {0.0, 10.0, 20.0, 40.0}) {
    const Drawn undone = drawn(signal_e, dark_e, dark_e, false);
    EXPECT_LT(xy_distance(*isp::xy_of(undone.xyz()), c), undone.xy_error()) << dark_e;
    if (dark_e == 0) continue;
    const Drawn naive = drawn(signal_e, dark_e, 0, false);
    const Xyz dark = isp::xyz_of(test::table_camera * Vector3{dark_e, dark_e, dark_e});
    const isp::Xy predicted = isp::desaturated(c, *isp::xy_of(dark), *isp::signal_fraction(truth, dark));
    EXPECT_LT(xy_distance(*isp::xy_of(naive.xyz()), predicted), naive.xy_error()) << dark_e;
    EXPECT_GT(xy_distance(predicted, c), 3 * naive.xy_error()) << dark_e;
  }
}

TEST(SubtractDark, ClippingAfterwardsLiftsTheMeanAsComputedAndSignedMeansDoNot) {
  const Drawn kept = drawn({0, 0, 0}, 2, 2, false), clipped = drawn({0, 0, 0}, 2, 2, true);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(kept.plane[k].mean(), 0, 5 * kept.plane[k].standard_error());
    // v phi(0) = 0.822 e- for a normal law of v^2 = 2 + 1.5^2; 0.01 e- for the skewness of Poisson's.
    EXPECT_NEAR(clipped.plane[k].mean(), 0.822, 0.01 + 5 * clipped.plane[k].standard_error());
  }
}

TEST(AlphaMap, IsTheShareInItsOwnWeights) {
  const Xyz signal{0.7, 0.4, 0.1}, dark{0.2, 0.25, 0.3};
  const SceneLinear picture = even(5, 4, signal);
  const Plane<float> xy = alpha_map(picture, dark, ShareWeights::xy, 2);
  const Plane<float> uv = alpha_map(picture, dark, ShareWeights::uv, 2);
  const float by_model = static_cast<float>(*isp::signal_fraction(signal, dark));
  const float by_hand = static_cast<float>(7.0 / (7.0 + 4.85));  // W: 0.7 + 6 + 0.3, and 0.2 + 3.75 + 0.9
  for (int i = 0; i < 20; ++i) {
    EXPECT_NEAR(xy.data()[i], by_model, 1e-7);  // float
    EXPECT_NEAR(uv.data()[i], by_hand, 1e-7);
  }
}

TEST(AlphaMap, PutsMeasuredTrueAndDarkChromaticityOnOneLineInBothDiagrams) {
  const Xyz signal{0.7, 0.4, 0.1}, dark{0.2, 0.25, 0.3};
  const Xyz measured{signal.x + dark.x, signal.y + dark.y, signal.z + dark.z};
  const SceneLinear picture = even(3, 3, signal);
  const double in_xy = alpha_map(picture, dark, ShareWeights::xy, 1).at(1, 1);
  const double in_uv = alpha_map(picture, dark, ShareWeights::uv, 1).at(1, 1);
  const isp::Xy c = *isp::xy_of(measured), c_signal = *isp::xy_of(signal), c_dark = *isp::xy_of(dark);
  EXPECT_NEAR(c.x, in_xy * c_signal.x + (1 - in_xy) * c_dark.x, 1e-7);  // alpha is a float
  EXPECT_NEAR(c.y, in_xy * c_signal.y + (1 - in_xy) * c_dark.y, 1e-7);
  const isp::UvPrime u = *isp::uv_prime_of(c), s = *isp::uv_prime_of(c_signal), n = *isp::uv_prime_of(c_dark);
  EXPECT_NEAR(u.u, in_uv * s.u + (1 - in_uv) * n.u, 1e-7);
  EXPECT_NEAR(u.v, in_uv * s.v + (1 - in_uv) * n.v, 1e-7);
  EXPECT_GT(std::abs(u.u - (in_xy * s.u + (1 - in_xy) * n.u)), 1e-3) << "the alpha of xy does not serve u'v'";
}

TEST(AlphaMap, IsThatOfMeansAndNotOfPixels) {
  SceneLinear picture = even(2, 1, {3, 3, 3});
  for (auto& plane : picture.plane) plane.at(1, 0) = -1;
  const Plane<float> alpha = alpha_map(picture, {1, 1, 1}, ShareWeights::xy, 1);
  EXPECT_EQ(alpha.at(0, 0), 0.5f);  // mean 3 over dark 3
  EXPECT_EQ(alpha.at(1, 0), 0.5f);
  EXPECT_EQ(alpha_map(picture, {1, 1, 1}, ShareWeights::xy, 0).at(1, 0), 0);
}

TEST(AlphaMap, HasItsEnds) {
  EXPECT_EQ(alpha_map(even(1, 1, {1, 1, 1}), {}, ShareWeights::xy, 0).at(0, 0), 1);
  EXPECT_EQ(alpha_map(even(1, 1, {0, 0, 0}), {}, ShareWeights::xy, 0).at(0, 0), 0);
  EXPECT_EQ(alpha_map(even(2, 2, {-5, -5, -5}), {1, 1, 1}, ShareWeights::uv, 1).at(0, 0), 0);
  EXPECT_EQ(alpha_map(even(1, 1, {3e38, 3e38, 3e38}), {1, 1, 1}, ShareWeights::uv, 1).at(0, 0), 1);
  EXPECT_TRUE(alpha_map(SceneLinear(), {1, 1, 1}, ShareWeights::xy, 4).empty());
}

TEST(AlphaMap, LeavesOutSaturatedPixelsAndThoseThatAreNotNumbers) {
  SceneLinear picture = even(3, 1, {1, 1, 1});
  picture.plane[0].at(1, 0) = 1e6f;
  Plane<std::uint8_t> saturated(3, 1);
  for (int x = 0; x < 3; ++x) saturated.at(x, 0) = x == 1;
  const Plane<float> alpha = alpha_map(picture, {1, 1, 1}, ShareWeights::xy, 1, std::as_const(saturated).view());
  for (int x = 0; x < 3; ++x) EXPECT_EQ(alpha.at(x, 0), 0.5f) << x;
  EXPECT_EQ(alpha_map(picture, {1, 1, 1}, ShareWeights::xy, 0, std::as_const(saturated).view()).at(1, 0), 0);
  picture.plane[0].at(1, 0) = inf;
  EXPECT_EQ(alpha_map(picture, {1, 1, 1}, ShareWeights::xy, 1).at(0, 0), 0.5f);
  picture.plane[0].at(1, 0) = static_cast<float>(nan);
  EXPECT_EQ(alpha_map(picture, {1, 1, 1}, ShareWeights::xy, 1).at(2, 0), 0.5f);
}

}  // namespace
}  // namespace lowlux::denoise::dark_test
