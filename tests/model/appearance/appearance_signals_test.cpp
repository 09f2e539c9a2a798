#include <cmath>

#include <gtest/gtest.h>

#include "isp/model/appearance/cao.h"
#include "isp/model/appearance/hunt.h"
#include "isp/model/appearance/icam06.h"
#include "isp/model/appearance/khan_pattanaik.h"
#include "isp/model/appearance/kirk_obrien.h"
#include "isp/model/appearance/kwak.h"
#include "isp/model/appearance/mikamo.h"
#include "isp/model/appearance/seen_scene.h"
#include "isp/model/appearance/wanat_mantiuk.h"

// The equations of each model against figures computed apart in numpy; a tolerance is half of the last digit printed
// there, unless it says otherwise.
namespace lowlux::isp::appearance_signals_test {
namespace {

constexpr Matrix3 srgb_to_xyz{{{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};
constexpr double six_digits = 6e-6;  // relative, of figures printed with six

void expect_relative(double found, double expected, double tolerance = six_digits) {
  EXPECT_NEAR(found, expected, tolerance * std::fabs(expected));
}

void expect_near(const Vector3& found, const Vector3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(found[i], expected[i], tolerance) << "component " << i;
}

TEST(Hunt, RodSignalHasItsCheckValues) {
  struct Row {
    double l_as, j, f_ls, b_s, of_white, of_fifth;
  };
  for (const Row& row : {Row{1e-4, 0.0432453, 0.0503912, 0.987719, 6.7392, 2.37429},
                         {1e-3, 0.00449966, 0.0723593, 0.971662, 8.41832, 2.95499},
                         {0.01, 4.51796e-4, 0.105985, 0.906559, 10.0925, 3.57765},
                         {0.1, 4.5198e-5, 0.155541, 0.657281, 9.43299, 3.48963},
                         {1, 4.51998e-6, 0.228301, 0.403589, 7.45747, 3.01785},
                         {100, 4.52e-8, 0.491859, 0.199213, 5.87779, 2.9602}}) {
    const RodAdaptation rods = rod_adaptation(row.l_as);
    expect_relative(rods.j, row.j, 2e-5);  // printed with as few as three digits
    expect_relative(rods.f_ls, row.f_ls);
    expect_relative(rod_bleaching(rods, 1), row.b_s);
    expect_relative(rod_signal(rods, 1), row.of_white, 1e-5);  // five digits
    expect_relative(rod_signal(rods, 0.2), row.of_fifth);
  }
}

TEST(Hunt, AchromaticSignalIsThatOfAnIndependentImplementation) {
  const double l_as = scotopic_adaptation(318.31, 6504);
  EXPECT_NEAR(l_as, 769.9376287, 6e-8);
  const double a = hunt_achromatic(18.982718664838487, rod_signal(rod_adaptation(l_as), 0.2), 0.725);
  EXPECT_NEAR(a, 15.506854623621885, 1e-6 * a);  // the spec's tolerance; the exponent 4 of (1 - j^2) is 0.4 there
}

TEST(Hunt, RodsHaveAFloorAndLightsAColour) {
  EXPECT_EQ(rod_adaptation(0).j, 1);
  EXPECT_EQ(rod_adaptation(0).f_ls, 0);
  EXPECT_EQ(rod_signal(rod_adaptation(0), 1), 0.3);
  EXPECT_EQ(rod_signal(rod_adaptation(1), -3), 0.3) << "no light below none";
  EXPECT_NEAR(scotopic_adaptation(2, 5600), 2 * 2.26, 1e-12);
  EXPECT_EQ(scotopic_adaptation(2, std::nullopt), 2 * 2.26);
  EXPECT_EQ(scotopic_adaptation(2, 1500), 0);
  EXPECT_GT(rod_signal(rod_adaptation(0.01), 1), rod_signal(rod_adaptation(1), 1)) << "rises and falls with L_AS";
}

TEST(Hunt, LevelFactorHasItsCheckValues) {
  const double table[][2] = {{1e-3, 0.0009869}, {0.01, 0.0093851}, {0.1, 0.0708640},   {1, 0.1715054},
                             {10, 0.3684045},   {100, 0.7937005},  {318.31, 1.1675445}};
  for (const auto& [l, f] : table) EXPECT_NEAR(luminance_level_factor(l), f, 6e-8) << l;
  EXPECT_EQ(luminance_level_factor(0), 0);
}

double kwak_j(double l_a, double alpha) {
  const double level = luminance_level_factor(l_a);
  const RodAdaptation rods = rod_adaptation(2.26 * l_a);
  const auto achromatic = [&](const Vector3& xyz, double y) {
    return kwak_achromatic(level, xyz_to_hpe * xyz, rod_signal(rods, y), alpha);
  };
  return kwak_lightness(achromatic({19.01, 20, 21.78}, 0.2), achromatic({95.05, 100, 108.88}, 1), 0.2,
                        average_surround);
}

TEST(Kwak, LightnessHasItsCheckValues) {
  const double table[][3] = {
      {100, 41.57551, 41.69378}, {1, 41.16425, 38.63493}, {0.1, 41.02175, 35.92771}, {0.01, 40.83940, 31.09494}};
  for (const auto& [l_a, cones, with_rods] : table) {
    EXPECT_NEAR(kwak_j(l_a, 0), cones, 6e-6) << l_a;
    EXPECT_NEAR(kwak_j(l_a, 1), with_rods, 6e-6) << l_a;
  }
  EXPECT_EQ(kwak_lightness(-1, 5, 0.2, average_surround), 0);
  EXPECT_EQ(ciecam02_response(0.5, -20), -ciecam02_response(0.5, 20));
}

TEST(KhanPattanaik, ResponsesHaveTheirCheckValues) {
  const NakaRushton rods = khan_rods(0.03), cones = khan_cones(0.03);
  EXPECT_NEAR(rods.half_saturation, 0.532499, 6e-7);
  EXPECT_NEAR(cones.half_saturation, 14.413061, 6e-7);
  const NakaRushton without_bleaching{rods.half_saturation, 1};
  EXPECT_NEAR(khan_response(without_bleaching, 0.03), 0.109120, 6e-7);
  EXPECT_NEAR(khan_response(rods, 0.03), 0.062354, 6e-7);
  EXPECT_NEAR(khan_response(without_bleaching, 0.3), 0.396787, 6e-7);
  EXPECT_NEAR(khan_response(rods, 0.3), 0.226735, 6e-7);
  EXPECT_EQ(khan_response(rods, -1), 0);
  for (const double i : {1e-6, 0.03, 5.0}) EXPECT_NEAR(khan_intensity(rods, khan_response(rods, i)), i, 1e-12 * i);
  EXPECT_TRUE(std::isfinite(khan_intensity(rods, 1))) << "a response above all";
  EXPECT_NEAR(khan_response(cones, khan_s_cone_excitation(0.3)), 0.2 * khan_response(rods, 0.3), 1e-14);
}

TEST(Cao, WeightsAndMatricesHaveTheirCheckValues) {
  const double table[][3] = {{0.2, 0.113849, 0.225213}, {0.3, 0.079249, 0.148122}, {0.5, 0.035657, 0.050999},
                             {1, 0.014326, 0.008364},   {2, 0.010013, 0.005846},   {5, 0.004313, 0.002518},
                             {0.62, 0.0173, 0.0101},    {0.01, 0.173, 0.357},      {11, 0, 0}};
  for (const auto& [l, k1, k2] : table) {
    EXPECT_NEAR(cao_weights(l).k1, k1, 6e-7) << l;
    EXPECT_NEAR(cao_weights(l).k2, k2, 6e-7) << l;
  }
  // The specification's figures have the rods of V' fitted by (-0.702, 1.039, 0.433).
  const ReceptorMatrix eye = cao_receptors(srgb_to_xyz, {-0.702, 1.039, 0.433});
  expect_near(eye[0], {0.1787269, 0.439848, 0.0358156}, 6e-8);
  expect_near(eye[1], {0.0338731, 0.275352, 0.0363844}, 6e-8);
  expect_near(eye[2], {0.0193, 0.1192, 0.9505}, 6e-8);
  expect_near(eye[3], {-0.07145441, 0.64470559, 0.42674881}, 6e-9);
  const Vector3 pixel{0.6, 0.3, 0.1};
  expect_near(*cao_retargeting(0.1, 100, eye) * pixel, {0.45033, 0.43200, 0.15905}, 6e-6);
  expect_near(*cao_retargeting(100, 0.1, eye) * pixel, {0.69203, 0.21883, 0.06369}, 6e-6);
  expect_near(*cao_retargeting(100, 1, eye) * pixel, {0.61261, 0.28889, 0.09951}, 6e-6);
  EXPECT_FALSE(cao_retargeting(100, 1, ReceptorMatrix{}));
}

constexpr Vector3 luminance709{0.2126, 0.7152, 0.0722};

double luminance(const Vector3& rgb) {
  return luminance709[0] * rgb[0] + luminance709[1] * rgb[1] + luminance709[2] * rgb[2];
}

TEST(WanatMantiuk, SaturationHasItsCheckValues) {
  const double table[][2] = {{0.01, 0.084746}, {0.05, 0.316456}, {0.1, 0.480769}, {0.5, 0.822368},
                             {1, 0.902527},    {2, 0.948767},    {10, 0.989315},  {200, 0.999460}};
  for (const auto& [y, s] : table) EXPECT_NEAR(wanat_saturation(y), s, 6e-7) << y;
  EXPECT_NEAR(wanat_exponent(0.1, 100), 0.481288, 6e-7);
  EXPECT_NEAR(wanat_exponent(250, 2), 1.053545, 6e-7);
  EXPECT_EQ(wanat_exponent(100, 1e-9), 4) << "bounded where the display is dark";
  EXPECT_EQ(wanat_exponent(100, 0), 4);
  EXPECT_EQ(wanat_exponent(0, 0), 1);
}

TEST(WanatMantiuk, SaturatesAtTheSameLuminance) {
  const Vector3 rgb{0.5, 0.2, 0.1};
  const double y = luminance(rgb), exponent = 0.481288;
  const Vector3 out = wanat_saturated(rgb, exponent, luminance709);
  EXPECT_NEAR(luminance(out), y, 1e-15);
  EXPECT_NEAR(out[0] / out[2], std::pow(5, exponent), 1e-12) << "R_i / Y to the power, up to one factor";
  EXPECT_NEAR(out[1] / out[2], std::pow(2, exponent), 1e-12);
  expect_near(wanat_saturated(rgb, 1, luminance709), rgb, 1e-15);
  expect_near(wanat_saturated({-0.1, 0.5, 0.2}, 1, luminance709), {-0.1, 0.5, 0.2}, 1e-15);
  expect_near(wanat_saturated(rgb, 0, luminance709), {y, y, y}, 1e-15);
  const Vector3 mixed{-0.3, 0.5, 0.2};
  for (const double e : {0.2, 3.0}) {
    EXPECT_NEAR(luminance(wanat_saturated(mixed, e, luminance709)), luminance(mixed), 1e-15);
  }
  const Vector3 negative = wanat_saturated({-0.5, -0.2, -0.1}, exponent, luminance709);
  expect_near(negative, {-out[0], -out[1], -out[2]}, 0);
  expect_near(wanat_saturated({}, exponent, luminance709), {}, 0);
}

TEST(KirkObrien, GainsHaveTheirCheckValues) {
  struct Row {
    double q, rods, g_l, g_s, w;
    Vector3 opponent, cones;
  };
  for (const Row& row :
       {Row{0.1, 0.2, 0.976133, 0.971561, 1.897291, {0.995718, -0.127832, 1.897291}, {0.450786, 1.446504, 1.769458}},
        {1, 1, 0.841406, 0.827040, 1.635426, {4.291445, -0.589896, 8.177129}, {1.942842, 6.234287, 7.587233}},
        {10, 10, 0.441726, 0.421825, 0.858575, {22.529462, -3.558610, 42.928739}, {10.199639, 32.729100, 39.370129}}}) {
    const OpponentGain gain = kirk_opponent_gain({{row.q, row.q, row.q}, row.rods});
    EXPECT_NEAR(gain.gain[0], row.g_l, 6e-7);
    EXPECT_NEAR(gain.gain[2], row.g_s, 6e-7);
    EXPECT_NEAR(gain.opponent[2] / (5 * row.rods), row.w, 6e-7);
    expect_near(gain.opponent, row.opponent, 6e-7);
    expect_near(kirk_cone_change(gain), row.cones, 6e-7);
  }
  const OpponentGain dark = kirk_opponent_gain({{}, 1e-12});
  EXPECT_NEAR(dark.opponent[2] / 5e-12, 1.943681, 6e-7) << "W in the dark";
  const OpponentGain negative = kirk_opponent_gain({{-100, -100, -100}, 1});
  for (const double value : kirk_cone_change(negative)) EXPECT_TRUE(std::isfinite(value));
}

TEST(KirkObrien, FilamentsVariantHasItsCheckValues) {
  expect_near(filament_night({0.01, 0.01, 0.01}), {0.0116625, 0.0175891, 0.0522755}, 6e-8);
  expect_near(filament_night({1, 1, 1}), {1.01708, 1.07619, 1.42624}, 6e-6);
  const double table[][2] = {{100, 1.0089}, {1, 1.0889}, {0.01, 1.8833}};
  for (const auto& [v, brighter] : table) {
    EXPECT_NEAR(luminance(filament_night({v, v, v})) / v, brighter, 6e-5) << v;
  }
  EXPECT_NEAR(luminance(filament_night({1e-4, 1e-4, 1e-4})) / 1e-4, 6.878, 6e-4);
}

TEST(Mikamo, CoefficientsHaveTheirCheckValues) {
  struct Row {
    double td;
    Vector3 red_green, blue_yellow;
  };
  for (const Row& row : {Row{150, {7.4615, -6.9539, 0.3905}, {0.2676, 0.3020, -0.1528}},
                         {1, {0.8027, -0.7725, 0.0471}, {0.0347, 0.2922, -0.2305}},
                         {20, {4.3365, -3.3727, 0.2709}, {0.2136, 0.2980, -0.1821}}}) {
    expect_near(mikamo_coefficients(row.td).red_green, row.red_green, 6e-5);
    expect_near(mikamo_coefficients(row.td).blue_yellow, row.blue_yellow, 6e-5);
  }
  expect_near(mikamo_coefficients(0).red_green, mikamo_coefficients(1e-4).red_green, 0);
  expect_near(mikamo_coefficients(1e-4).shift_nm, {-0.9, 22, 28}, 0.01);  // their ends, to a hundredth of a nanometre
  expect_near(mikamo_coefficients(1e9).shift_nm, {-19.2, -22.6, 71}, 0.01);
}

TEST(Mikamo, ReadsFundamentalsAtTheShiftedWavelength) {
  const Spectrum light = *Spectrum::of({500, 510, 520, 530}, {1, 2, 2, 1}),
                 redder = *Spectrum::of({510, 520, 530, 540}, {1, 2, 2, 1});
  MikamoCoefficients still, moved;
  still.red_green = moved.red_green = {1, 2, 3};
  moved.shift_nm = {10, 10, 10};
  const Matrix3 of_shifted_cones = mikamo_signals(moved, {light, light, light});
  const Matrix3 of_shifted_light = mikamo_signals(still, {redder, redder, redder});
  for (int row = 0; row < 2; ++row) expect_near(of_shifted_cones[row], of_shifted_light[row], 1e-12);
}

TEST(Mikamo, WhiteExcitesLuminanceAloneOnceAdaptedTo) {
  const Matrix3 signals{{{0.2, 0.7, 0.1}, {2, -1, 0.5}, {0.3, 0.3, -0.2}}};
  const Matrix3 adapted = mikamo_adapted(signals);
  expect_near(adapted * Vector3{1, 1, 1}, {1, 0, 0}, 1e-15);
  expect_near(adapted[0], signals[0], 0);
  expect_near(adapted[1], {2 - 1.5 * 0.2, -1 - 1.5 * 0.7, 0.5 - 1.5 * 0.1}, 1e-15);
}

TEST(Icam06, CompressionHasItsCheckValues) {
  const Icam06Response bright = icam06_compress({19.01, 20, 21.78}, {.white_cd_m2 = 100, .scotopic_white_cd_m2 = 100});
  expect_near(bright.cones, {2.822294, 2.902991, 3.042463}, 6e-7);
  EXPECT_NEAR(bright.rods, 2.620095, 6e-7);
  expect_near(bright.xyz_tc, {5.396994, 5.493130, 5.662558}, 6e-7);

  const Icam06Response red = icam06_compress({0.2062, 0.1063, 0.00965}, {.white_cd_m2 = 1, .scotopic_white_cd_m2 = 1});
  expect_near(red.cones, {0.890492, 0.597784, 0.214509}, 6e-7);
  EXPECT_NEAR(red.rods, 1.865165, 6e-7);
  const Xy xy = *xy_of(xyz_of(red.xyz_tc));
  EXPECT_NEAR(xy.x, 0.387665, 6e-7);
  EXPECT_NEAR(xy.y, 0.338543, 6e-7);

  const Icam06State dark{.white_cd_m2 = 0.01, .scotopic_white_cd_m2 = 0.01};
  const Xy grey = *xy_of(xyz_of(icam06_compress({0.002062, 0.001063, 0.0000965}, dark).xyz_tc));
  EXPECT_NEAR(grey.x, 0.337435, 6e-7);
  EXPECT_NEAR(grey.y, 0.333726, 6e-7);
}

TEST(Icam06, ExpansionUndoesCompression) {
  for (const double white : {0.01, 1.0, 318.31}) {
    const Icam06State state{.white_cd_m2 = white, .scotopic_white_cd_m2 = white};
    for (const Vector3& relative : {Vector3{0.95, 1, 1.09}, {0.4, 0.2, 0.02}, {0.002, 0.003, 0.01}, {0, 0, 0}}) {
      const Vector3 xyz{white * relative[0], white * relative[1], white * relative[2]};
      expect_near(icam06_expand(icam06_compress(xyz, state).xyz_tc, state), xyz, 1e-12 * white);
    }
  }
}

TEST(Icam06, CompatibilityWithTheProgramIsItsThreeDifferences) {
  const Icam06State state{
      .white_cd_m2 = 100, .scotopic_white_cd_m2 = 50, .variant = Icam06Variant::icam06_matlab_compat};
  const double s = 20.0 / 100, p = 0.7;  // S_w = 5 L_A = Y_w, whatever is given
  const RodAdaptation rods = rod_adaptation(2.26 * 20);
  const double bleaching = 0.5 / (1 + 0.3 * std::pow(rods.u * s, 3)) + 0.5 / (1 + 5 * rods.u);
  const double power = std::pow(rods.f_ls * s, p);
  const double expected = 3.05 * bleaching * 400 * power / (27.13 + power) + 0.03;
  EXPECT_NEAR(icam06_compress({19.01, 20, 21.78}, state).rods, expected, 1e-13);
}

}  // namespace
}  // namespace lowlux::isp::appearance_signals_test
