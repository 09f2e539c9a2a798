#include "calib/chart/colour_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include "isp/model/spectrum/cie_data.h"
#include "tests/calib/chart_frame.h"

namespace lowlux::calib {
namespace {

const Spectrum& daylight() {
  static const Spectrum light = *isp::light_named("D65");
  return light;
}

isp::Xyz white_of(const Spectrum& light) {
  const isp::Xyz sum = isp::xyz_of(light);
  return {sum.x / sum.y, 1, sum.z / sum.y};
}

constexpr Matrix3 some_matrix{{{0.8, 0.3, 0.2}, {0.3, 1.1, -0.1}, {0.02, -0.2, 1.4}}};

/// A camera that some_matrix is exact for, under light that falls off; `noise` is relative to each value.
std::vector<ColourSample> exact_samples(const LightGradient& light, double noise = 0, unsigned seed = 1) {
  const auto reference = *chart_reference(daylight());
  const Matrix3 to_camera = *inverse(some_matrix);
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  std::vector<ColourSample> out;
  for (std::size_t i = 0; i < 24; ++i) {
    ColourSample sample{to_camera * vector_of(reference[i]), reference[i], (static_cast<double>(i % 6) - 2.5) / 3,
                        (static_cast<double>(i / 6) - 1.5) / 2};
    for (double& value : sample.camera_rgb) value *= light.at(sample.x, sample.y) * (1 + noise * normal(engine));
    out.push_back(sample);
  }
  return out;
}

/// What a real camera makes of the chart: no matrix is exact for it.
std::vector<ColourSample> camera_samples() {
  const test::SyntheticChart& chart = test::daylight_chart();
  std::vector<ColourSample> out = exact_samples({});
  for (std::size_t i = 0; i < 24; ++i) out[i].camera_rgb = chart.camera_rgb[i];
  return out;
}

double square_sum(const std::vector<double>& errors) {
  double sum = 0;
  for (const double error : errors) sum += error * error;
  return sum;
}

void expect_near(const Matrix3& found, const Matrix3& expected, double tolerance) {
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(found[i][j], expected[i][j], tolerance) << i << " " << j;
  }
}

TEST(FitColour, GivesBackTheMatrixAndTheLightOfExactSamples) {
  for (const bool refine : {false, true}) {
    const auto fit =
        fit_colour(exact_samples({0.15, -0.08}), {.white = white_of(daylight()), .minimise_ciede2000 = refine});
    ASSERT_TRUE(fit);
    // 1e-9: doubles at a condition number near 10; the refinement may stop where all differences are below 1e-7.
    expect_near(fit->camera_to_xyz, some_matrix, 1e-9);
    EXPECT_NEAR(fit->light.per_x, 0.15, 1e-9);
    EXPECT_NEAR(fit->light.per_y, -0.08, 1e-9);
    EXPECT_LT(summary_of(colour_errors(*fit, exact_samples({0.15, -0.08}), white_of(daylight()))).largest, 1e-6);
  }
}

TEST(FitColour, IsWrongUnderUnevenLightThatItIsNotToFit) {
  const auto samples = exact_samples({0.15, -0.08});
  const auto fit = fit_colour(samples, {.white = white_of(daylight()), .uneven_light = false});
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->light.per_x, 0);
  EXPECT_GT(summary_of(colour_errors(*fit, samples, white_of(daylight()))).mean, 0.5);  // 15 % of light is about 5 L*
}

TEST(FitColour, LowersTheSumOfSquaredDifferencesOfLeastSquares) {
  const auto samples = camera_samples();
  const isp::Xyz white = white_of(daylight());
  const auto least_squares = fit_colour(samples, {.white = white, .minimise_ciede2000 = false});
  const auto refined = fit_colour(samples, {.white = white});
  ASSERT_TRUE(least_squares && refined);
  const double before = square_sum(colour_errors(*least_squares, samples, white));
  const double after = square_sum(colour_errors(*refined, samples, white));
  EXPECT_LT(after, before);
  // A minimum: no step along a matrix element, up or down, lowers it.
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (const double step : {-0.01, 0.01}) {
        ColourFit beside = *refined;
        beside.camera_to_xyz[i][j] += step;
        EXPECT_GT(square_sum(colour_errors(beside, samples, white)), after) << i << " " << j << " " << step;
      }
    }
  }
}

TEST(FitColour, TakesAGivenNeutralToWhiteExactly) {
  const Vector3 neutral = *test::daylight_chart().colour.as_shot_neutral;
  const isp::Xyz white = white_of(daylight());
  const auto fit = fit_colour(camera_samples(), {.white = white, .neutral = neutral});
  ASSERT_TRUE(fit);
  const Vector3 found = fit->camera_to_xyz * neutral;
  EXPECT_NEAR(found[0] / found[1], white.x, 1e-12);  // doubles
  EXPECT_NEAR(found[2] / found[1], white.z, 1e-12);
  const auto free = fit_colour(camera_samples(), {.white = white});
  ASSERT_TRUE(free);
  EXPECT_GE(square_sum(colour_errors(*fit, camera_samples(), white)),
            square_sum(colour_errors(*free, camera_samples(), white)));
}

TEST(FitColour, CrossValidationExceedsTheFittedErrorOfNoise) {
  const isp::Xyz white = white_of(daylight());
  double fitted = 0, left_out = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto samples = exact_samples({}, 0.02, seed);
    const auto fit = fit_colour(samples, {.white = white});
    const auto crossed = cross_validated(samples, {.white = white});
    ASSERT_TRUE(fit && crossed);
    const double mean = summary_of(colour_errors(*fit, samples, white)).mean;
    EXPECT_GT(summary_of(*crossed).mean, mean) << seed;
    fitted += mean;
    left_out += summary_of(*crossed).mean;
  }
  // Linear theory: with 11 of 72 equations' freedom fitted, left-out squares exceed fitted ones by about
  // (72+11)/(72-11); the root of that is 1.17. Refinement spends its freedom on 24 differences: more, not less.
  EXPECT_GT(left_out / fitted, 1.1);
  EXPECT_LT(left_out / fitted, 3);
}

TEST(FitColour, RefusesWhatDoesNotDetermineAMatrix) {
  const isp::Xyz white = white_of(daylight());
  auto samples = exact_samples({});
  const auto few = fit_colour(std::span(samples).first(min_colour_samples - 1), {.white = white});
  ASSERT_FALSE(few);
  EXPECT_NE(few.error().message.find("needs 17 patches, found 16"), std::string::npos) << few.error().message;
  EXPECT_TRUE(fit_colour(std::span(samples).first(min_colour_samples), {.white = white}));
  EXPECT_FALSE(cross_validated(std::span(samples).first(min_colour_samples), {.white = white}));
  EXPECT_TRUE(cross_validated(std::span(samples).first(min_colour_samples + 1), {.white = white}));

  auto grey = samples;
  for (ColourSample& sample : grey) sample.camera_rgb = {sample.reference.y, sample.reference.y, sample.reference.y};
  const auto singular = fit_colour(grey, {.white = white});
  ASSERT_FALSE(singular);
  EXPECT_NE(singular.error().message.find("condition number"), std::string::npos) << singular.error().message;

  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    auto broken = samples;
    broken[3].camera_rgb[1] = bad;
    EXPECT_FALSE(fit_colour(broken, {.white = white}));
  }
  auto dark = samples;
  dark[5].reference = {0, 0, 0};
  EXPECT_FALSE(fit_colour(dark, {.white = white}));
  for (ColourSample& sample : samples) sample.camera_rgb = {};
  EXPECT_FALSE(fit_colour(samples, {.white = white}));
}

TEST(ScaledToChart, FindsTheExposureAndTheLightOfARightMatrix) {
  const isp::Xyz white = white_of(daylight());
  const Matrix3 darker = 0.01 * some_matrix;
  const auto scaled = scaled_to_chart(darker, exact_samples({0.1, 0.2}), {.white = white});
  ASSERT_TRUE(scaled);
  expect_near(scaled->camera_to_xyz, some_matrix, 1e-10);  // doubles
  EXPECT_NEAR(scaled->light.per_y, 0.2, 1e-10);
  EXPECT_FALSE(scaled_to_chart(-1.0 * some_matrix, exact_samples({}), {.white = white}));
  EXPECT_FALSE(scaled_to_chart(0.0 * some_matrix, exact_samples({}), {.white = white}));
}

TEST(CalibrationOf, MeansWhatDngMeans) {
  const isp::Xyz white = white_of(daylight());
  const auto calibration = calibration_of({0.37 * some_matrix, {}, 1}, white);
  ASSERT_TRUE(calibration);
  const Vector3 neutral = calibration->xyz_to_camera * vector_of(white);
  EXPECT_NEAR(*std::max_element(neutral.begin(), neutral.end()), 1, 1e-12);
  const Matrix3 round_trip = some_matrix * calibration->xyz_to_camera;  // a multiple of the identity
  expect_near((1 / round_trip[0][0]) * round_trip, identity3(), 1e-12);
  const Vector3 d50 = *calibration->forward * Vector3{1, 1, 1};
  const isp::Xyz expected = *isp::xyz_of(isp::white_d50);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(d50[i], vector_of(expected)[i], 1e-12) << i;
  EXPECT_NEAR(calibration->cct_k, 6500, 10);  // K: D65 is 6504
}

TEST(CalibrationOf, RefusesAWhiteThatLeavesAChannelDark) {
  EXPECT_FALSE(calibration_of({{{{1, 0, 0}, {0, 1, 0}, {0, 0, -1}}}, {}, 1}, white_of(daylight())));
  EXPECT_FALSE(calibration_of({{}, {}, 1}, white_of(daylight())));
}

TEST(SummaryOf, KnowsEvenOddAndNoFigures) {
  const ErrorSummary even = summary_of({4, 1, 3, 2});
  EXPECT_EQ(even.mean, 2.5);
  EXPECT_EQ(even.median, 2.5);
  EXPECT_EQ(even.largest, 4);
  EXPECT_EQ(summary_of({7, 1, 2}).median, 2);
  EXPECT_EQ(summary_of({}).mean, 0);
}

}  // namespace
}  // namespace lowlux::calib
