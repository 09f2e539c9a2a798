#include "isp/render/white_balance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "isp/model/colour/correlated_colour_temperature.h"
#include "isp/model/spectrum/cie_data.h"
#include "tests/support/sweep.h"
#include "tests/support/synthetic_chart.h"

namespace lowlux::isp {
namespace {

/// A thumbnail with one block for each colour.
CameraRgb thumbnail_of(const std::vector<Vector3>& colours) {
  CameraRgb blocks(static_cast<int>(colours.size()), 1);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < colours.size(); ++i) {
      blocks.plane[c].row(0)[i] = static_cast<float>(colours[i][c]);
    }
  }
  return blocks;
}

RgbView<const float> view_of(const CameraRgb& blocks) { return blocks.view(); }

double angle_degrees(const Vector3& a, const Vector3& b) {
  double dot = 0, aa = 0, bb = 0;
  for (int i = 0; i < 3; ++i) dot += a[i] * b[i], aa += a[i] * a[i], bb += b[i] * b[i];
  return std::acos(std::fmin(1, dot / std::sqrt(aa * bb))) * 180 / std::numbers::pi;
}

/// The matrices of a Nikon D5100 for A and D65, and the neutral it measures under `light`.
CameraColour nikon(const std::string& light) {
  return test::photograph_chart({"Nikon_D5100", light, {"A", "D65"}})->colour;
}

TEST(AsShotWhiteBalance, IsTheNeutralOrTheWhiteThatTheFileStates) {
  CameraColour colour = nikon("D50");
  const Vector3 neutral = *colour.as_shot_neutral;
  colour.as_shot_neutral = Vector3{2 * neutral[0], 2 * neutral[1], 2 * neutral[2]};
  const auto by_neutral = as_shot_white_balance(colour);
  ASSERT_TRUE(by_neutral);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(by_neutral->neutral[i], neutral[i], 1e-12);
  ASSERT_TRUE(by_neutral->white);
  EXPECT_NEAR(by_neutral->white->cct_k, 5000, 100);  // the fitted matrices are no colorimeter
  EXPECT_EQ(by_neutral->source, WhiteSource::as_shot);

  colour.as_shot_neutral.reset();
  colour.as_shot_white_xy = {by_neutral->white->xy.x, by_neutral->white->xy.y};
  const auto by_white = as_shot_white_balance(colour);
  ASSERT_TRUE(by_white);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(by_white->neutral[i], neutral[i], 1e-6);
}

TEST(AsShotWhiteBalance, IsAnErrorIfTheFileStatesNoneOrAnImpossibleOne) {
  CameraColour colour = nikon("D65");
  colour.as_shot_neutral = Vector3{0, 1, 1};
  EXPECT_EQ(as_shot_white_balance(colour).error().code, ErrorCode::malformed);
  EXPECT_NE(as_shot_white_balance(colour).error().message.find("--wb auto"), std::string::npos);
  colour.as_shot_neutral.reset();
  EXPECT_EQ(as_shot_white_balance(colour).error().code, ErrorCode::insufficient);
  colour.as_shot_white_xy = {0.3, 0};
  EXPECT_EQ(as_shot_white_balance(colour).error().code, ErrorCode::malformed);
}

TEST(AsShotWhiteBalance, NeedsNoMatricesForANeutral) {
  CameraColour colour;
  colour.as_shot_neutral = Vector3{0.5, 1, 0.7};
  const auto balance = as_shot_white_balance(colour);
  ASSERT_TRUE(balance);
  EXPECT_EQ(balance->neutral, (Vector3{0.5, 1, 0.7}));
  EXPECT_FALSE(balance->white);
}

TEST(TemperatureWhiteBalance, GivesTheNeutralOfThatWhiteAndRunsFromRedToBlue) {
  const CameraColour colour = nikon("D65");
  double red_to_blue = 1e9;
  for (const double kelvin : test::ratios(1667, 25000, 1.05)) {
    const auto balance = white_balance_of_temperature(colour, kelvin);
    ASSERT_TRUE(balance) << kelvin << balance.error().message;
    EXPECT_EQ(balance->neutral, *neutral_of_white(colour, *white_of_temperature(kelvin)));
    EXPECT_LT(balance->neutral[0] / balance->neutral[2], red_to_blue) << kelvin;
    red_to_blue = balance->neutral[0] / balance->neutral[2];
  }
  // 0.5 degrees: what a fitted matrix predicts of D65's neutral against what the camera measures
  EXPECT_LT(angle_degrees(white_balance_of_temperature(colour, 6504)->neutral, *colour.as_shot_neutral), 0.5);
}

TEST(TemperatureWhiteBalance, IsRefusedOutsideItsRangeAndWithoutMatrices) {
  EXPECT_EQ(white_balance_of_temperature(nikon("D65"), 1600).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(white_balance_of_temperature(nikon("D65"), 25001).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(white_balance_of_temperature(CameraColour{}, 5000).error().code, ErrorCode::insufficient);
}

TEST(PresetWhiteBalance, WhitesAreThoseOfTheIlluminantsSpectra) {
  const std::pair<WhitePreset, const char*> lights[] = {
      {WhitePreset::daylight, "D55"}, {WhitePreset::flash, "D55"},  {WhitePreset::cloudy, "D65"},
      {WhitePreset::shade, "D75"},    {WhitePreset::tungsten, "A"}, {WhitePreset::fluorescent, "FL2"}};
  const CameraColour colour = nikon("D50");
  for (const auto& [preset, name] : lights) {
    const Xy xy = *xy_of(xyz_of(*light_named(name)));
    EXPECT_NEAR(white_of(preset).x, xy.x, 1e-4) << name;  // sums over 5 nm, see cie_data_test
    EXPECT_NEAR(white_of(preset).y, xy.y, 1e-4) << name;
    const auto balance = white_balance_of_preset(colour, preset);
    ASSERT_TRUE(balance) << name;
    EXPECT_EQ(balance->source, WhiteSource::preset);
    const Vector3 neutral = *neutral_of_white(colour, white_of(preset));
    EXPECT_EQ(balance->neutral, neutral);
  }
}

TEST(TemperatureWhiteBalance, TintMovesTheWhiteAlongTheNormalOfTheLocus) {
  const CameraColour colour = nikon("D50");
  for (const double kelvin : {2500.0, 3600.0, 5500.0, 12000.0}) {
    const auto plain = white_balance_of_temperature(colour, kelvin);
    for (const double tint : {-60.0, -5.0, 12.0, 60.0}) {
      const auto tinted = white_balance_of_temperature(colour, kelvin, tint);
      ASSERT_TRUE(plain && tinted);
      EXPECT_NEAR(tinted->white->duv - plain->white->duv, tint / 3000, 1e-6);
      EXPECT_NEAR(tinted->white->cct_k, plain->white->cct_k, 1e-3 * kelvin);  // the nearest point of the locus stays
      // A greener light has more green in its neutral, and so less green in the image.
      const auto green = [](const Vector3& n) { return n[1] / std::sqrt(n[0] * n[2]); };
      EXPECT_EQ(green(tinted->neutral) > green(plain->neutral), tint > 0);
    }
  }
  EXPECT_EQ(white_balance_of_temperature(colour, 5000, 151).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(white_balance_of_temperature(colour, 5000, NAN).error().code, ErrorCode::invalid_argument);
}

// 3 degrees of camera RGB is some 900 K at 6500 K. These scenes hold a fairly even mix of colours, as the method
// supposes; the worst found is 1.8 degrees.
TEST(AutoWhiteBalance, FindsTheLightOfAMixedSceneForDaylightTungstenAndLamps) {
  for (const char* light : {"D65", "D50", "D75", "A", "FL2", "LED-B3", "HPS_super", "HPS_generic"}) {
    const test::ChartSetup setup{"Nikon_D5100", light, {"A", "D65"}, false};
    const auto mixed = test::photograph_training_set(setup);
    const auto chart = test::photograph_chart(setup);
    ASSERT_TRUE(mixed && chart);
    for (const std::vector<Vector3>& scene :
         {*mixed, std::vector(chart->camera_rgb.begin(), chart->camera_rgb.end())}) {
      const WhiteBalance found = auto_white_balance(view_of(thumbnail_of(scene)), 0, chart->colour);
      EXPECT_EQ(found.source, WhiteSource::estimated);
      const double error = angle_degrees(found.neutral, *chart->colour.as_shot_neutral);
      std::printf("  %-12s %3zu colours: %.2f degrees, %.0f K %s\n", light, scene.size(), error, found.white->cct_k,
                  found.reason.c_str());
      EXPECT_LT(error, 3) << light;
    }
  }
}

TEST(AutoWhiteBalance, OfAGreyWorldIsItsNeutralWhateverTheExposure) {
  const CameraColour colour = nikon("D50");
  const Vector3 neutral = *colour.as_shot_neutral;
  for (const double exposure : {1e-4, 1e-2, 0.8}) {
    std::vector<Vector3> greys;
    for (int i = 1; i <= 100; ++i) {
      const double level = exposure * i / 100;
      greys.push_back({level * neutral[0], level * neutral[1], level * neutral[2]});
    }
    const WhiteBalance found = auto_white_balance(view_of(thumbnail_of(greys)), 0, colour);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.neutral[c], neutral[c], 1e-6);  // float blocks
    EXPECT_EQ(found.reason, "");
  }
}

TEST(AutoWhiteBalance, IsHeldToTheWhitesOfLights) {
  const CameraColour colour = nikon("D65");
  for (const Vector3& monochrome :
       {Vector3{0.1, 0.8, 0.1}, Vector3{0.8, 0.2, 0.7}, Vector3{0.8, 0.1, 0.02}, Vector3{0.1, 0.3, 0.8}}) {
    const WhiteBalance found =
        auto_white_balance(view_of(thumbnail_of(std::vector<Vector3>(100, monochrome))), 0, colour);
    ASSERT_TRUE(found.white);
    EXPECT_GT(found.white->cct_k, 1899);
    EXPECT_LT(found.white->cct_k, 12001);
    const double usual_duv = colour_temperature_of(*white_of_temperature(found.white->cct_k))->duv;
    EXPECT_LE(std::fabs(found.white->duv - usual_duv), 0.01 + 1e-5)
        << monochrome[0];  // the clamped temperature is rounded
    EXPECT_NE(found.reason, "");
  }
}

TEST(AutoWhiteBalance, LeavesOutClippedAndBlackBlocks) {
  const CameraColour colour = nikon("D65");
  const Vector3 neutral = *colour.as_shot_neutral;
  std::vector<Vector3> blocks(50, {0.4 * neutral[0], 0.4 * neutral[1], 0.4 * neutral[2]});
  blocks.insert(blocks.end(), 100, {0.95, 1, 1});            // clipped
  blocks.insert(blocks.end(), 100, {0.001, -0.002, 0.004});  // noise
  blocks.push_back({std::numeric_limits<double>::quiet_NaN(), 0.4, 0.4});
  const WhiteBalance found = auto_white_balance(view_of(thumbnail_of(blocks)), 0.001, colour);
  EXPECT_EQ(found.source, WhiteSource::estimated);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.neutral[c], neutral[c], 1e-6);
}

TEST(AutoWhiteBalance, FallsBackWithAReasonWhereThereIsTooLittleSignal) {
  const CameraRgb black = thumbnail_of(std::vector<Vector3>(100, {0, 0, 0}));
  CameraColour colour = nikon("D50");
  const WhiteBalance as_shot = auto_white_balance(view_of(black), 0, colour);
  EXPECT_EQ(as_shot.source, WhiteSource::as_shot);
  EXPECT_NE(as_shot.reason.find("as shot instead"), std::string::npos);

  colour.as_shot_neutral.reset();
  const WhiteBalance daylight = auto_white_balance(view_of(black), 0, colour);
  EXPECT_EQ(daylight.source, WhiteSource::daylight);
  EXPECT_EQ(daylight.neutral, *neutral_of_white(colour, white_d65));

  const WhiteBalance none = auto_white_balance(view_of(black), 0, CameraColour{});
  EXPECT_EQ(none.source, WhiteSource::none);
  EXPECT_EQ(none.neutral, (Vector3{1, 1, 1}));
  EXPECT_NE(none.reason, "");
}

TEST(AutoWhiteBalance, WithoutMatricesItIsNotLimitedWithAWarning) {
  const CameraRgb blocks = thumbnail_of(std::vector<Vector3>(100, {0.1, 0.8, 0.1}));
  const WhiteBalance found = auto_white_balance(view_of(blocks), 0, CameraColour{});
  EXPECT_EQ(found.source, WhiteSource::estimated);
  EXPECT_FALSE(found.white);
  EXPECT_NEAR(found.neutral[0], 0.125, 1e-6);
  EXPECT_NE(found.reason.find("the colour matrix is missing or unusable"), std::string::npos);
}

TEST(WhiteSources, HaveNames) {
  EXPECT_EQ(name_of(WhiteSource::as_shot), "as-shot");
  EXPECT_EQ(name_of(WhiteSource::estimated), "auto");
  EXPECT_EQ(name_of(WhiteSource::temperature), "temperature");
  EXPECT_EQ(name_of(WhiteSource::daylight), "daylight");
  EXPECT_EQ(name_of(WhiteSource::none), "none");
}

}  // namespace
}  // namespace lowlux::isp
