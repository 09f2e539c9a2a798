#include "isp/model/colour/camera_colour.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "isp/model/colour/correlated_colour_temperature.h"
#include "tests/support/sweep.h"

namespace lowlux::isp::camera_colour_test {
namespace {

// Two made-up but camera-like calibrations.
constexpr Matrix3 warm_matrix{{{0.90, -0.20, -0.10}, {-0.40, 1.20, 0.20}, {-0.05, 0.15, 0.60}}};
constexpr Matrix3 cool_matrix{{{0.80, -0.25, -0.08}, {-0.45, 1.25, 0.22}, {-0.08, 0.20, 0.65}}};
constexpr Matrix3 forward_matrix{{{0.65, 0.20, 0.11}, {0.25, 0.72, 0.03}, {0.01, -0.10, 0.91}}};

ColourCalibration calibration(double cct_k, const Matrix3& matrix) {
  ColourCalibration c;
  c.cct_k = cct_k;
  c.xyz_to_camera = matrix;
  return c;
}

CameraColour two_calibrations() {
  CameraColour colour;
  colour.calibrations = {calibration(2856, warm_matrix), calibration(6504, cool_matrix)};
  return colour;
}

void expect_near(const Matrix3& found, const Matrix3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(found[i][j], expected[i][j], tolerance) << "row " << i << " column " << j;
  }
}

TEST(CameraColour, InterpolatesLinearlyInReciprocalTemperature) {
  // By hand: at 4000 K the weight of 6504 K is (1/2856 - 1/4000) / (1/2856 - 1/6504) = 0.50990...
  const double weight = (1 / 2856.0 - 1 / 4000.0) / (1 / 2856.0 - 1 / 6504.0);
  const Matrix3 found = *xyz_to_camera(two_calibrations(), *planckian_xy(4000));
  Matrix3 expected{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) expected[i][j] = (1 - weight) * warm_matrix[i][j] + weight * cool_matrix[i][j];
  }
  expect_near(found, expected, 1e-9);  // the temperature search stops at 1e-10 relative
}

TEST(CameraColour, HoldsTheMatricesBeyondTheCalibrations) {
  expect_near(*xyz_to_camera(two_calibrations(), *planckian_xy(2000)), warm_matrix, 1e-15);
  expect_near(*xyz_to_camera(two_calibrations(), *planckian_xy(12000)), cool_matrix, 1e-15);
  expect_near(*xyz_to_camera(two_calibrations(), {0.71, 0.28}), warm_matrix, 1e-15);
}

TEST(CameraColour, MultipliesBalanceCalibrationAndColourMatrixInThisOrder) {
  CameraColour colour;
  colour.calibrations = {calibration(6504, cool_matrix)};
  colour.analog_balance = {2, 1, 0.5};
  colour.calibrations[0].camera_calibration = {{{1, 0.1, 0}, {0, 1, 0}, {0, 0, 1}}};
  Matrix3 expected = cool_matrix;
  for (int j = 0; j < 3; ++j) {
    expected[0][j] = 2 * (cool_matrix[0][j] + 0.1 * cool_matrix[1][j]);
    expected[2][j] = 0.5 * cool_matrix[2][j];
  }
  expect_near(*xyz_to_camera(colour, white_d65), expected, 1e-15);
}

TEST(CameraColour, NeutralAndWhiteRoundTripOverAllLights) {
  for (const double kelvin : test::ratios(1800, 20000, 1.1)) {
    for (const double duv : {-0.015, 0.0, 0.015}) {
      const Xy white = *planckian_xy(kelvin, duv);
      const Vector3 neutral = *neutral_of_white(two_calibrations(), white);
      EXPECT_EQ(std::fmax(neutral[0], std::fmax(neutral[1], neutral[2])), 1);
      const WhitePoint found = *white_of_neutral(two_calibrations(), {3 * neutral[0], 3 * neutral[1], 3 * neutral[2]});
      EXPECT_NEAR(found.xy.x, white.x, 1e-8) << kelvin << " " << duv;  // the iteration stops at 1e-10
      EXPECT_NEAR(found.xy.y, white.y, 1e-8) << kelvin << " " << duv;
      EXPECT_NEAR(found.cct_k / kelvin, 1, 1e-5);
      EXPECT_NEAR(found.duv, duv, 1e-6);
    }
  }
}

TEST(CameraColour, TheNeutralBecomesTheOutputWhiteAtFullLuminance) {
  for (const bool with_forward : {false, true}) {
    CameraColour colour = two_calibrations();
    colour.analog_balance = {1.1, 1, 0.9};
    colour.calibrations[0].camera_calibration = diagonal3({0.98, 1, 1.03});
    if (with_forward) colour.calibrations[0].forward = colour.calibrations[1].forward = forward_matrix;
    for (const Xy& scene : {white_d65, *planckian_xy(2100), *planckian_xy(9000, 0.01)}) {
      for (const Xy& output : {white_d50, white_d65, white_e}) {
        const Vector3 white = *camera_to_xyz(colour, scene, output) * *neutral_of_white(colour, scene);
        const Vector3 expected = vector_of(*xyz_of(output));
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(white[i], expected[i], 1e-12);
      }
    }
  }
}

TEST(CameraColour, WithoutForwardMatrixTheSceneColoursComeBackAdapted) {
  const Xy scene = *planckian_xy(3500);
  const Matrix3 to_camera = *xyz_to_camera(two_calibrations(), scene);
  const Matrix3 product = *camera_to_xyz(two_calibrations(), scene, white_d65) * to_camera;
  const Matrix3 bradford = *bradford_adaptation(scene, white_d65);
  // Equal up to the exposure scale, the largest channel of the white.
  const double scale = product[0][0] / bradford[0][0];
  EXPECT_GT(scale, 0);
  expect_near(product, scale * bradford, 1e-12);
}

TEST(CameraColour, ForwardMatrixIsAppliedToBalancedRgbByHand) {
  CameraColour colour;
  colour.calibrations = {calibration(6504, cool_matrix)};
  colour.calibrations[0].forward = forward_matrix;
  const Vector3 neutral = *neutral_of_white(colour, white_d65);
  const Vector3 d50 = vector_of(*xyz_of(white_d50));
  Matrix3 expected{};
  for (int i = 0; i < 3; ++i) {
    const double sum = forward_matrix[i][0] + forward_matrix[i][1] + forward_matrix[i][2];
    for (int j = 0; j < 3; ++j) expected[i][j] = forward_matrix[i][j] * d50[i] / sum / neutral[j];
  }
  expect_near(*camera_to_xyz(colour, white_d65, white_d50), expected, 1e-12);
}

TEST(CameraColour, OneForwardMatrixServesForBothCalibrations) {
  CameraColour colour = two_calibrations();
  colour.calibrations[0].forward = forward_matrix;
  CameraColour both = colour;
  both.calibrations[1].forward = forward_matrix;
  const Xy scene = *planckian_xy(5000);
  expect_near(*camera_to_xyz(colour, scene, white_d65), *camera_to_xyz(both, scene, white_d65), 1e-14);
}

/// Returns cool_matrix with each element changed by up to a tenth, and a reference camera that is not the sensor.
CameraColour drawn_single_calibration(std::mt19937_64& random, double cct_k) {
  std::uniform_real_distribution<double> change(-0.1, 0.1);
  CameraColour colour;
  colour.calibrations = {calibration(cct_k, cool_matrix)};
  for (Vector3& row : colour.calibrations[0].xyz_to_camera) {
    for (double& value : row) value += change(random);
  }
  for (int i = 0; i < 3; ++i) {
    colour.analog_balance[i] = 1 + change(random);
    colour.calibrations[0].camera_calibration[i][i] = 1 + change(random);
  }
  return colour;
}

// At the white of the calibration the matrix that is implied is the inverse of ColorMatrix; at others it is the same
// after white balance: von Kries adaptation in camera RGB.
TEST(CameraColour, ALoneCalibrationIsBalancedInCameraRgb) {
  constexpr unsigned seed = 1;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> temperature(2000, 12000);
  for (int draw = 0; draw < 200; ++draw) {
    const double cct_k = temperature(random), scene_k = temperature(random);
    SCOPED_TRACE(testing::Message() << "seed " << seed << " draw " << draw << " " << cct_k << " K " << scene_k << " K");
    const CameraColour colour = drawn_single_calibration(random, cct_k);
    const Xy own = *white_of_temperature(cct_k), scene = *white_of_temperature(scene_k);
    const Matrix3 to_xyz = *camera_to_xyz(colour, own, white_d65);
    const Matrix3 inverted = *bradford_adaptation(own, white_d65) * *inverse(*xyz_to_camera(colour, own));
    const Vector3 own_neutral = *neutral_of_white(colour, own), neutral = *neutral_of_white(colour, scene);
    expect_near(to_xyz, (1 / (inverted * own_neutral)[1]) * inverted, 1e-9);  // condition numbers near 10, twice
    expect_near(*camera_to_xyz(colour, scene, white_d65) * diagonal3(neutral), to_xyz * diagonal3(own_neutral), 1e-9);
  }
}

TEST(CameraColour, ALoneCalibrationOfUnknownTemperatureIsInverted) {
  CameraColour colour;
  colour.calibrations = {calibration(0, cool_matrix)};
  const Xy scene = *planckian_xy(3000);
  const Matrix3 product = *camera_to_xyz(colour, scene, white_d65) * cool_matrix;
  const Matrix3 bradford = *bradford_adaptation(scene, white_d65);
  expect_near(product, (product[0][0] / bradford[0][0]) * bradford, 1e-12);
}

// Bradford adaptation and the inverse of ColorMatrix, as of a calibration without a temperature.
void expect_inverted(const CameraColour& colour, const Xy& scene) {
  const Matrix3 inverted = *bradford_adaptation(scene, white_d65) * *inverse(*xyz_to_camera(colour, scene));
  const Vector3 neutral = *neutral_of_white(colour, scene);
  const auto found = camera_to_xyz(colour, scene, white_d65);
  ASSERT_TRUE(found) << found.error().message;
  expect_near(*found, (1 / (inverted * neutral)[1]) * inverted, 1e-9);
}

TEST(CameraColour, OneOfTwoCalibrationsImpliesNoForwardMatrix) {
  CameraColour colour;
  for (const double other_k : {0.0, 6504.0, 2856.0}) {
    colour.calibrations = {calibration(other_k, warm_matrix), calibration(6504, cool_matrix)};
    expect_inverted(colour, *planckian_xy(3000));
  }
}

TEST(CameraColour, ALoneCalibrationIsInvertedWhereTheReferenceCameraHasNoSuchNeutral) {
  CameraColour colour;
  colour.calibrations = {
      calibration(6504, {{{1.4134, -0.5576, -0.1527}, {0.1991, 1.0719, -0.1273}, {-0.1158, 0.1929, 0.3581}}})};
  colour.calibrations[0].camera_calibration[0][1] = 0.3;
  expect_inverted(colour, {0.2, 0.7});
}

TEST(CameraColour, IdenticalCalibrationsAreOne) {
  CameraColour colour;
  colour.calibrations = {calibration(6504, warm_matrix), calibration(6504, cool_matrix)};
  expect_near(*xyz_to_camera(colour, *planckian_xy(3000)), warm_matrix, 0);
  EXPECT_TRUE(white_of_neutral(colour, {0.5, 1, 0.6}));
}

TEST(CameraColour, ACalibrationWithoutATemperatureIsNotInterpolated) {
  CameraColour colour;
  colour.calibrations = {calibration(0, warm_matrix), calibration(6504, cool_matrix)};
  expect_near(*xyz_to_camera(colour, *planckian_xy(3000)), cool_matrix, 0);
  colour.calibrations = {calibration(2856, warm_matrix), calibration(0, cool_matrix)};
  expect_near(*xyz_to_camera(colour, *planckian_xy(3000)), warm_matrix, 0);
  colour.calibrations = {calibration(0, warm_matrix), calibration(0, cool_matrix)};
  expect_near(*xyz_to_camera(colour, *planckian_xy(3000)), warm_matrix, 0);
  colour.calibrations = {calibration(0, warm_matrix)};
  expect_near(*xyz_to_camera(colour, *planckian_xy(3000)), warm_matrix, 0);
}

TEST(CameraColour, SettlesOnAFixedPointWhereThePlainIterationCycles) {
  // The warm matrix makes this neutral look cool and the cool one makes it look warm: each step jumps to the other end.
  CameraColour colour;
  const Vector3 neutral{1, 1, 1};
  const Vector3 cool = vector_of(*xyz_of(*planckian_xy(9000)));
  const Vector3 warm = vector_of(*xyz_of(*planckian_xy(2500)));
  colour.calibrations = {calibration(2856, diagonal3({1 / cool[0], 1 / cool[1], 1 / cool[2]})),
                         calibration(6504, diagonal3({1 / warm[0], 1 / warm[1], 1 / warm[2]}))};
  const auto white = white_of_neutral(colour, neutral);
  ASSERT_TRUE(white) << white.error().message;
  EXPECT_GT(white->cct_k, 2856);
  EXPECT_LT(white->cct_k, 6504);
  const Vector3 back = *neutral_of_white(colour, white->xy);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(back[i], neutral[i], 1e-6);  // 50 halvings of the weight, and the CCT search
}

TEST(CameraColour, PlaceholderMatricesStillGiveAWhite) {
  // Wrapped sensor dumps often carry the sRGB matrix for D65 and equal channels.
  CameraColour colour;
  colour.calibrations = {calibration(6504, *inverse(*rgb_to_xyz(primaries_rec709)))};
  const WhitePoint white = *white_of_neutral(colour, {1, 1, 1});
  EXPECT_NEAR(white.xy.x, white_d65.x, 1e-12);
  EXPECT_NEAR(white.xy.y, white_d65.y, 1e-12);
  expect_near(*camera_to_xyz(colour, white.xy, white_d65), *rgb_to_xyz(primaries_rec709), 1e-12);
  colour.calibrations = {calibration(0, identity3())};
  EXPECT_NEAR(white_of_neutral(colour, {1, 1, 1})->xy.x, 1.0 / 3, 1e-12);
}

TEST(CameraColour, ANeutralFarOffTheLocusEitherRoundTripsOrIsRefused) {
  int answered = 0;
  for (const double r : {0.01, 0.1, 0.5, 1.0}) {
    for (const double g : {0.01, 0.1, 0.5, 1.0}) {
      for (const double b : {0.01, 0.1, 0.5, 1.0}) {
        const auto white = white_of_neutral(two_calibrations(), {r, g, b});
        if (!white) {
          EXPECT_EQ(white.error().code, ErrorCode::malformed);
          continue;
        }
        ++answered;
        const auto back = neutral_of_white(two_calibrations(), white->xy);
        ASSERT_TRUE(back) << back.error().message;
        const double largest = std::fmax(r, std::fmax(g, b));
        EXPECT_NEAR((*back)[0], r / largest, 1e-6);
        EXPECT_NEAR((*back)[1], g / largest, 1e-6);
        EXPECT_NEAR((*back)[2], b / largest, 1e-6);
      }
    }
  }
  EXPECT_GT(answered, 30);
}

TEST(CameraColour, RefusesWhatItCannotUse) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CameraColour colour;
  EXPECT_EQ(white_of_neutral(colour, {1, 1, 1}).error().code, ErrorCode::insufficient);
  EXPECT_EQ(camera_to_xyz(colour, white_d65, white_d65).error().code, ErrorCode::insufficient);

  colour = two_calibrations();
  for (const Vector3& bad : {Vector3{0, 1, 1}, Vector3{1, -1, 1}, Vector3{1, 1, nan}}) {
    EXPECT_EQ(white_of_neutral(colour, bad).error().where, "AsShotNeutral");
  }
  EXPECT_FALSE(neutral_of_white(colour, {0.3, 0}));
  EXPECT_FALSE(camera_to_xyz(colour, {nan, 0.3}, white_d65));
  EXPECT_FALSE(camera_to_xyz(colour, white_d65, {0.3, -1}));

  colour.analog_balance = {1, 0, 1};
  EXPECT_EQ(xyz_to_camera(colour, white_d65).error().where, "AnalogBalance");

  colour = two_calibrations();
  colour.calibrations[0].xyz_to_camera[1][1] = nan;
  EXPECT_EQ(white_of_neutral(colour, {1, 1, 1}).error().code, ErrorCode::malformed);

  colour.calibrations = {calibration(6504, {{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}})};
  EXPECT_EQ(white_of_neutral(colour, {1, 1, 1}).error().where, "ColorMatrix");
  EXPECT_EQ(camera_to_xyz(colour, white_d65, white_d65).error().where, "ColorMatrix");

  colour.calibrations = {calibration(6504, cool_matrix)};
  colour.calibrations[0].forward = Matrix3{{{1, -1, 0}, {0, 1, 0}, {0, 0, 1}}};  // takes white to X = 0
  EXPECT_EQ(camera_to_xyz(colour, white_d65, white_d65).error().where, "ForwardMatrix");
  colour.calibrations = {calibration(6504, {{{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}})};
  EXPECT_FALSE(neutral_of_white(colour, white_d65));
}

}  // namespace
}  // namespace lowlux::isp::camera_colour_test
