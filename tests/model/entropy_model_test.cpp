#include "isp/model/appearance/entropy_model.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>

#include "isp/base/random/philox.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

NodePower even_power() {
  NodePower power;
  power.fill(1);
  return power;
}

/// 0.1 + exp(-((nm - centre) / 40)^2 / 2).
NodePower bump(double centre_nm) {
  NodePower power{};
  for (int i = 0; i < entropy_nodes; ++i) {
    const double d = (entropy_wavelength_nm(i) - centre_nm) / 40;
    power[i] = 0.1 + std::exp(-0.5 * d * d);
  }
  return power;
}

EntropyModel model_at(double m, const EntropyOptions& options = {}) { return *entropy_model(m, even_power(), options); }

TEST(EntropyModel, RodShareAndWeightAreThoseOfTheLevelsPublished) {
  struct Row {
    double luminance_cd_m2, m, gamma, xi;
  };
  const Row rows[] = {{0.01, 0.185634, 1.628731, 0.731977},
                      {0.1, 0.480425, 1.039150, 0.396508},
                      {1, 0.784125, 0.431749, 0.140225},
                      {3, 0.931238, 0.137523, 0.041426}};
  for (const Row& row : rows) {
    const double m = mesopic_state({row.luminance_cd_m2, 2.26 * row.luminance_cd_m2}).m;
    EXPECT_NEAR(m, row.m, 2e-6) << "six decimals";
    EXPECT_NEAR(entropy_weight(m), row.gamma, 4e-6) << "twice that of m";
    EXPECT_NEAR(entropy_rod_fraction(m), row.xi, 3.2e-6) << "e / (e - 1) times that of m";
  }
  EXPECT_EQ(entropy_rod_fraction(1), 0);
  EXPECT_EQ(entropy_rod_fraction(0), 1);
  EXPECT_EQ(entropy_weight(1), 1e-4) << "the floor";
  EXPECT_EQ(entropy_weight(0), 2);
}

struct Seen {
  double m;
  Vector3 eta, theta;
  double psi, entropy;
  Xy thesis, rendering;
};

// Of bump(540) beside the equal-energy white, by an independent program, six decimals.
const Seen published[] = {
    {1,
     {0.602328, 0.574760, 0.101380},
     {0.102491, 2.064765, 0.199139},
     6.784676,
     5.516009,
     {0.320761, 0.513064},
     {0.320761, 0.513064}},
    {0.784125,
     {0.807189, 0.779621, 0.442815},
     {0.587723, 0.630907, 0.079080},
     6.533327,
     5.693882,
     {0.318261, 0.448656},
     {0.342164, 0.413795}},
    {0.480425,
     {1.181601, 1.154033, 1.066835},
     {0.381727, 0.360595, 0.039261},
     6.476378,
     5.711376,
     {0.289203, 0.420826},
     {0.338957, 0.378118}},
    {0,
     {2.063263, 2.035696, 2.536272},
     {0.224583, 0.199126, -0.005967},
     6.460987,
     5.697510,
     {0.267914, 0.403721},
     {0.336628, 0.358664}},
};

TEST(EntropyModel, SeesTheGreenOfBothVariantsAsPublished) {
  const double digits = 2e-6;  // of the table, and of m in it
  for (const Seen& row : published) {
    SCOPED_TRACE(row.m);
    EntropyOptions options{.variant = EntropyVariant::thesis};
    if (row.m == 1) options.gamma_fixed = 1e-8;
    const EntropyModel literal = model_at(row.m, options);
    const Vector3 eta = entropy_moments(literal, bump(540));
    const auto fit = entropy_fit(literal, eta);
    ASSERT_TRUE(fit);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(eta[c], row.eta[c], digits);
      EXPECT_NEAR(fit->theta[c], row.theta[c], digits);
    }
    EXPECT_NEAR(fit->psi, row.psi, digits);
    EXPECT_NEAR(fit->entropy, row.entropy, digits);
    const Xy by_thesis = *xy_of(xyz_of(literal, *fit));
    EXPECT_NEAR(by_thesis.x, row.thesis.x, digits);
    EXPECT_NEAR(by_thesis.y, row.thesis.y, digits);
    options.variant = EntropyVariant::rendering;
    const EntropyModel shown = model_at(row.m, options);
    const auto rendered = entropy_fit(shown, entropy_moments(shown, bump(540)));
    ASSERT_TRUE(rendered);
    const Xy by_rendering = *xy_of(xyz_of(shown, *rendered));
    EXPECT_NEAR(by_rendering.x, row.rendering.x, digits);
    EXPECT_NEAR(by_rendering.y, row.rendering.y, digits);
  }
}

TEST(EntropyModel, GivesAFixedWeightWhateverTheLight) {
  EXPECT_EQ(model_at(0.9, {.gamma_fixed = 2}).gamma, 2);
  EXPECT_DOUBLE_EQ(model_at(0.9).gamma, 0.2);
  const EntropyModel adaptive = model_at(0.9), fixed = model_at(0.9, {.gamma_fixed = 2});
  const Vector3 eta = entropy_moments(adaptive, bump(540));
  EXPECT_GT(entropy_fit(fixed, eta)->entropy, entropy_fit(adaptive, eta)->entropy + 0.02);
}

/// Draws in 0..1.
struct Draws {
  std::uint32_t next = 0;
  double operator()() {
    const auto words = philox4x32_10({next++, 1, 2, 3}, {4, 5});
    return (static_cast<double>(words[0]) + 0.5) / 4294967296.0;
  }
};

// Half of the measurements are of spectra, half are any three numbers, most of which are no light's.
TEST(EntropyModel, SettlesOrRefusesForAnyMeasurement) {
  const int count = std::getenv("LOWLUX_NIGHTLY") == nullptr ? 10'000 : 100'000;
  Draws draw;
  int refused = 0;
  for (int i = 0; i < count / 100; ++i) {
    const EntropyModel model =
        model_at(draw(), {.variant = i % 2 == 0 ? EntropyVariant::thesis : EntropyVariant::rendering});
    for (int k = 0; k < 100; ++k) {
      Vector3 eta{2 * draw() - 0.5, 2 * draw() - 0.5, 2 * draw() - 0.5};
      if (k % 2 == 0) {
        NodePower power{};
        for (double& value : power) value = draw() * draw() * draw();
        eta = entropy_moments(model, power);
      }
      const auto fit = entropy_fit(model, eta);
      if (!fit) {
        ++refused;
        EXPECT_EQ(k % 2, 1) << "a light's own moments can be met";
        continue;
      }
      const Xyz seen = xyz_of(model, *fit);
      EXPECT_TRUE(std::isfinite(seen.x + seen.y + seen.z) && seen.y > 0);
      EXPECT_TRUE(std::isfinite(fit->entropy) && fit->entropy <= std::log(345.0) + 1e-9) << "of an even spectrum";
    }
  }
  RecordProperty("refused", refused);
  EXPECT_EQ(refused, 0) << "with gamma of 1e-4 and more Newton's method has always settled";
}

TEST(EntropyModel, RefusesMeasurementsThatAreNoNumbers) {
  const EntropyModel model = model_at(0.5);
  for (const double bad : {nan, inf, -inf}) {
    EXPECT_FALSE(entropy_fit(model, {0.5, bad, 0.1}));
    EXPECT_FALSE(entropy_fit_of_luminance(model, {0.5, bad, 0.1}, 1));
  }
}

// Where S is noisier than L and M, an error of S moves the answer less, towards the smoothest spectrum that L and M
// allow, and one of L and M moves it more than if all were trusted alike.
TEST(EntropyModel, TrustsNoisyResponsesLess) {
  const EntropyModel plain = model_at(0.9);
  const EntropyModel noisy = model_at(0.9, {.noise_covariance = diagonal3({1, 1, 25})});
  const EntropyModel alike = model_at(0.9, {.noise_covariance = diagonal3({7, 7, 7})});
  for (const double nm : {430.0, 460.0, 540.0, 640.0}) {
    const Vector3 eta = entropy_moments(plain, bump(nm));
    const auto moved_by_errors = [&](const EntropyModel& model, int c) {
      Vector3 wrong = eta;
      wrong[c] += 0.01;
      const auto first = entropy_fit(model, eta), second = entropy_fit(model, wrong);
      return first && second ? second->moments[c] - first->moments[c] : nan;
    };
    EXPECT_GT(moved_by_errors(plain, 2), 0);
    EXPECT_LT(moved_by_errors(noisy, 2), 0.6 * moved_by_errors(plain, 2)) << nm;
    for (int c = 0; c < 2; ++c) EXPECT_GT(moved_by_errors(noisy, c), 1.5 * moved_by_errors(plain, c)) << nm;
    const auto before = entropy_fit(plain, eta), same = entropy_fit(alike, eta);
    ASSERT_TRUE(before && same);
    for (int c = 0; c < 3; ++c) EXPECT_DOUBLE_EQ(same->theta[c], before->theta[c]) << "alike in all directions: A = I";
  }
}

TEST(EntropyModel, RefusesCovariancesAndWeightsThatAreNone) {
  const Matrix3 bad[] = {diagonal3({1, 1, 0}),
                         diagonal3({1, -1, 1}),
                         {{{1, 1, 0}, {1, 1, 0}, {0, 0, 1}}},
                         {{{1, 0.5, 0}, {0.4, 1, 0}, {0, 0, 1}}},
                         diagonal3({1, nan, 1}),
                         diagonal3({inf, 1, 1}),
                         diagonal3({0, 0, 0})};
  for (const Matrix3& covariance : bad) {
    const auto model = entropy_model(0.5, even_power(), {.noise_covariance = covariance});
    ASSERT_FALSE(model);
    EXPECT_EQ(model.error().code, ErrorCode::invalid_argument);
    EXPECT_FALSE(entropy_appearance().at({.noise_covariance = covariance}));
  }
  const Matrix3 full{{{2, 1, 0.1}, {1, 2, 0.2}, {0.1, 0.2, 1}}};
  EXPECT_TRUE(entropy_model(0.5, even_power(), {.noise_covariance = full}));
  for (const double gamma : {0.0, -1.0, nan, inf}) {
    EXPECT_FALSE(entropy_model(0.5, even_power(), {.gamma_fixed = gamma}));
  }
  EXPECT_FALSE(entropy_model(0.5, NodePower{}));
  NodePower red{};
  red[entropy_nodes - 1] = 1;  // 730 nm: no S cone
  EXPECT_FALSE(entropy_model(1, red));
}

TEST(EntropyModel, ConeMatrixIsExactOnlyForConesThatAreSumsOfMatchingFunctions) {
  const auto worst = [](ConeSet set) {
    const Matrix3 m = cone_matrix(set);
    const auto cones = cone_fundamentals(set);
    Vector3 most{};
    for (int i = 0; i < entropy_nodes; ++i) {
      const Vector3 xyz{cie_1931_observer()[0].at(entropy_wavelength_nm(i)),
                        cie_1931_observer()[1].at(entropy_wavelength_nm(i)),
                        cie_1931_observer()[2].at(entropy_wavelength_nm(i))};
      const Vector3 fitted = m * xyz;
      for (int c = 0; c < 3; ++c) {
        most[c] = std::fmax(most[c], std::fabs(fitted[c] - cones[c].at(entropy_wavelength_nm(i))));
      }
    }
    return most;
  };
  const Vector3 new_cones = worst(ConeSet::stockman_sharpe_2000), old_cones = worst(ConeSet::smith_pokorny_1975);
  // 0.0266, 0.0298 and 0.1960 by an independent program.
  EXPECT_NEAR(new_cones[0], 0.0266, 1e-4);
  EXPECT_NEAR(new_cones[1], 0.0298, 1e-4);
  EXPECT_NEAR(new_cones[2], 0.1960, 1e-4);
  for (int c = 0; c < 2; ++c) EXPECT_LT(old_cones[c], new_cones[c]);
}

TEST(EntropyModel, CarriesTheNoiseOfChannelsToTheCones) {
  const Matrix3 to_xyz{{{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};
  const ChannelNoise noise{.variance_e2 = {4, 9, 16}, .rgb_per_e = {0.5, 1, 2}, .camera_to_xyz = to_xyz};
  const Matrix3 s = noise_covariance_of_cones(noise);
  // Drawn instead of propagated: the sum over the eight sign patterns of one standard deviation in each channel.
  const Matrix3 m = cone_matrix(ConeSet::stockman_sharpe_2000) * to_xyz;
  Matrix3 sum{};
  for (int pattern = 0; pattern < 8; ++pattern) {
    const Vector3 rgb{pattern & 1 ? 1.0 : -1.0, pattern & 2 ? 3.0 : -3.0, pattern & 4 ? 8.0 : -8.0};
    const Vector3 cones = m * rgb;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) sum[i][j] += cones[i] * cones[j] / 8;
    }
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(s[i][j], sum[i][j], 1e-14) << "rounding: 2e-15 was measured";
  }
  EXPECT_TRUE(entropy_model(0.5, even_power(), {.noise_covariance = s}));
}

}  // namespace
}  // namespace lowlux::isp
