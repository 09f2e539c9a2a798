#include "isp/model/appearance/entropy_model.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <optional>

#include "isp/base/random/random.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/vision/mesopic.h"
#include "tests/support/numbers.h"

namespace lowlux::isp {
namespace {

using test::inf;
using test::nan;

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

/// The covariance of X, Y and Z of channels of equal noise behind the matrix of sRGB, and with the noise of one channel
/// five times as large.
Matrix3 covariance_of_xyz(const Vector3& std_e = {1, 1, 1}) {
  const Matrix3 to_xyz{{{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};
  return noise_covariance_of_xyz(
      {.variance_e2 = {std_e[0] * std_e[0], std_e[1] * std_e[1], std_e[2] * std_e[2]}, .camera_to_xyz = to_xyz});
}

/// Uniform in 0..1, by the index of the draw.
double drawn(std::uint32_t index) { return (philox4x32_10({index, 0, 0, 0}, {20261124, 5})[0] + 0.5) / 4294967296.0; }

// The optimality condition of the fit, with the noise at any size: moments = eta - (gamma / 2 I + variance C) theta.
TEST(EntropyModel, WeighsEntropyAndNoiseAsTheEquationSays) {
  for (std::uint32_t i = 0; i < 200; ++i) {
    const double m = drawn(4 * i), variance = std::pow(10.0, 12 * drawn(4 * i + 1) - 8);
    const EntropyModel model =
        model_at(m, {.noise_covariance = covariance_of_xyz({0.2 + drawn(4 * i + 2), 1, 0.2 + 5 * drawn(4 * i + 3)})});
    const Vector3 eta = entropy_moments(model, bump(420 + 250 * drawn(4 * i + 2)));
    const auto fit = entropy_fit(model, eta, variance);
    ASSERT_TRUE(fit) << i;
    const Vector3 by_noise = model.noise * fit->theta;
    for (int c = 0; c < 3; ++c) {
      const double entropy = model.gamma / 2 * fit->theta[c], noise = variance * by_noise[c];
      EXPECT_NEAR(fit->moments[c], eta[c] - entropy - noise, 1e-6) << "the iteration ends near 1e-8: " << i;
    }
  }
}

// Where blue is noisier than red and green, an error of blue moves the answer less than where all are alike.
TEST(EntropyModel, TrustsNoisyChannelsLess) {
  constexpr double variance = 0.01, green = 0.7152 * 0.7152, red = 0.2126 * 0.2126, blue_y = 0.0722 * 0.0722;
  constexpr double noisier = variance * (red + green + 25 * blue_y) / (red + green + blue_y);  // same red and green
  for (const double m : {0.1, 0.4, 0.7, 1.0}) {
    const EntropyModel even = model_at(m, {.noise_covariance = covariance_of_xyz()});
    const EntropyModel noisy = model_at(m, {.noise_covariance = covariance_of_xyz({1, 1, 5})});
    const Vector3 blue =
        diagonal3(even.adaptation) * (response_matrix(even.measured) * Vector3{0.1805, 0.0722, 0.9505});
    const auto moved_by_error = [&](const EntropyModel& model, double of_variance) {
      const Vector3 eta = entropy_moments(model, even_power());
      Vector3 wrong = eta;
      for (int c = 0; c < 3; ++c) wrong[c] += 0.01 * blue[c];
      const auto first = entropy_fit(model, eta, of_variance), second = entropy_fit(model, wrong, of_variance);
      if (!first || !second) return nan;
      return dot(blue, second->theta) - dot(blue, first->theta);  // falls with every covariance that is added
    };
    EXPECT_GT(moved_by_error(even, 0), moved_by_error(even, variance)) << m;
    EXPECT_GT(moved_by_error(even, variance), 1.05 * moved_by_error(noisy, noisier)) << m;
    EXPECT_GT(moved_by_error(noisy, noisier), 0) << m;
  }
}

constexpr Xyz display_white{0.95047, 1, 1.08883};

ColourMap map_with_noise(double noise_to_signal, double white_cd_m2, const Xyz& white = display_white) {
  ViewingConditions scene{.white_cd_m2 = white_cd_m2, .white = white};
  scene.noise = ColourNoise{.covariance = covariance_of_xyz(), .to_signal = noise_to_signal};
  return *entropy_appearance().at(scene);
}

double distance(const Xy& a, const Xy& b) { return std::hypot(a.x - b.x, a.y - b.y); }

double colour_left(const ColourMap& map, const Xyz& colour) {
  return distance(*xy_of(map(colour)), *xy_of(display_white));
}

constexpr std::array<Xyz, 6> test_colours{{{0.30, 0.20, 0.05},
                                           {0.15, 0.30, 0.10},
                                           {0.20, 0.15, 0.60},
                                           {0.45, 0.50, 0.10},
                                           {0.30, 0.20, 0.55},
                                           {0.25, 0.35, 0.50}}};

// The limits: without noise the model is the published one, bit for bit; with much noise a colour is the grey of its
// luminance. In between colours fade all the way by day; at night, where little colour is left, its hue may turn.
TEST(EntropyModel, ColoursFadeFromThoseWithoutNoiseToGrey) {
  for (const double white_cd_m2 : {0.05, 0.5, 5.0, 100.0}) {
    const ColourMap plain = *entropy_appearance().at({.white_cd_m2 = white_cd_m2});
    for (const Xyz& colour : test_colours) {
      EXPECT_EQ(vector_of(map_with_noise(0, white_cd_m2)(colour)), vector_of(plain(colour)));
      EXPECT_NEAR(colour_left(map_with_noise(0x1p-7, white_cd_m2), colour), colour_left(plain, colour), 1e-3);
      double before = colour_left(plain, colour);
      for (double ratio = 0x1p-7; ratio <= 0x1p10; ratio *= 2) {
        const double left = colour_left(map_with_noise(ratio, white_cd_m2), colour);
        if (white_cd_m2 == 100) {
          EXPECT_LT(left, before * (1 + 1e-9)) << ratio;
        }
        before = left;
      }
      EXPECT_LT(before, 2e-5) << "at a thousand times the signal";
    }
  }
}

// The solution's norm in the covariance falls with the noise, whatever the light: a property of all penalties.
TEST(EntropyModel, ThePenaltyOfNoiseFallsAsNoiseGrows) {
  for (std::uint32_t i = 0; i < 50; ++i) {
    const EntropyModel model = model_at(drawn(2 * i), {.noise_covariance = covariance_of_xyz({1, 1, 3})});
    const Vector3 eta = entropy_moments(model, bump(420 + 250 * drawn(2 * i + 1)));
    double before = inf;
    for (double variance = 1e-8; variance < 1e6; variance *= 4) {
      const auto fit = entropy_fit(model, eta, variance);
      ASSERT_TRUE(fit) << variance;
      const double penalty = dot(fit->theta, model.noise * fit->theta);
      EXPECT_LT(penalty, before * (1 + 1e-6)) << i << " " << variance;
      before = penalty;
    }
  }
}

TEST(EntropyModel, NeutralsAndLuminanceDoNotDependOnNoise) {
  for (std::uint32_t i = 0; i < 100; ++i) {
    const double ratio = std::pow(10.0, 5 * drawn(3 * i) - 2.5), white_cd_m2 = std::pow(10.0, 3 * drawn(3 * i + 1) - 2);
    const Xyz white{0.85 + 0.2 * drawn(3 * i + 2), 1, 0.4 + 0.7 * drawn(3 * i + 2)};
    const ColourMap noisy = map_with_noise(ratio, white_cd_m2, white), plain = map_with_noise(0, white_cd_m2, white);
    EXPECT_LT(colour_left(noisy, white), 1e-9) << i;
    for (const Xyz& colour : test_colours) EXPECT_NEAR(noisy(colour).y, plain(colour).y, 1e-12) << i;
  }
}

// Pixels of one and of ten thousand electrons of light have a ratio of noise to signal of sqrt(5) and of 0.01 at a read
// noise of 2 e-: by day the one loses half of its colour or more, the other nothing that could be seen.
TEST(EntropyModel, OneElectronAndTenThousandDiffer) {
  const auto ratio = [](double mean_e) { return std::sqrt(mean_e + 4) / mean_e; };
  const ColourMap dark = map_with_noise(ratio(1), 100), bright = map_with_noise(ratio(1e4), 100);
  const ColourMap plain = *entropy_appearance().at({.white_cd_m2 = 100});
  int halved = 0;
  for (const Xyz& colour : test_colours) {
    EXPECT_GT(colour_left(bright, colour), 0.995 * colour_left(plain, colour));
    EXPECT_LT(colour_left(dark, colour), 0.8 * colour_left(plain, colour));
    halved += colour_left(dark, colour) < 0.5 * colour_left(plain, colour) ? 1 : 0;
  }
  EXPECT_GE(halved, 3) << "of six";
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
    EXPECT_FALSE(entropy_appearance().at({.noise = ColourNoise{.covariance = covariance, .to_signal = 1}}));
  }
  const Matrix3 full{{{2, 1, 0.1}, {1, 2, 0.2}, {0.1, 0.2, 1}}};
  EXPECT_TRUE(entropy_model(0.5, even_power(), {.noise_covariance = full}));
  for (const double ratio : {-1.0, nan, inf}) {
    EXPECT_FALSE(entropy_appearance().at({.noise = ColourNoise{.to_signal = ratio}})) << ratio;
  }
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
    const Matrix3 m = response_matrix(model_at(1, {.cones = set}).measured);
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

TEST(EntropyModel, CarriesTheNoiseOfChannelsToXyzAndToResponses) {
  const Matrix3 to_xyz{{{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};
  const ChannelNoise noise{.variance_e2 = {4, 9, 16}, .rgb_per_e = {0.5, 1, 2}, .camera_to_xyz = to_xyz};
  const Matrix3 s = noise_covariance_of_xyz(noise);
  const EntropyModel model = model_at(0.4, {.noise_covariance = s});
  const Matrix3 responses = diagonal3(model.adaptation) * response_matrix(model.measured);
  // Drawn instead of propagated: the sum over the eight sign patterns of one standard deviation in each channel.
  Matrix3 sum{}, of_responses{};
  for (int pattern = 0; pattern < 8; ++pattern) {
    const Vector3 rgb{pattern & 1 ? 1.0 : -1.0, pattern & 2 ? 3.0 : -3.0, pattern & 4 ? 8.0 : -8.0};
    const Vector3 xyz = to_xyz * rgb, eta = responses * xyz;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        sum[i][j] += xyz[i] * xyz[j] / 8;
        of_responses[i][j] += eta[i] * eta[j] / 8;
      }
    }
  }
  EXPECT_DOUBLE_EQ(s[1][1], 1);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      EXPECT_NEAR(s[i][j], sum[i][j] / sum[1][1], 1e-14) << "rounding";
      EXPECT_NEAR(model.noise[i][j], of_responses[i][j] / sum[1][1], 1e-13) << "rounding";
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
