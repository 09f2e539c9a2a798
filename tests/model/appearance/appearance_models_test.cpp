#include "isp/model/appearance/appearance_model.h"

#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "isp/model/appearance/lightness_match.h"
#include "isp/model/appearance/seen_scene.h"
#include "isp/model/appearance/shin_table.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

const Matrix3& rec709() {
  static const Matrix3 matrix = *rgb_to_xyz(primaries_rec709);
  return matrix;
}

Xyz rgb(double r, double g, double b) { return xyz_of(rec709() * Vector3{r, g, b}); }

ViewingConditions at_white(double white_cd_m2) {
  ViewingConditions conditions;
  conditions.white_cd_m2 = white_cd_m2;
  conditions.white = rgb(1, 1, 1);
  return conditions;
}

ColourMap map_of(std::string_view name, const ViewingConditions& conditions) {
  return (*appearance_model_named(name)).at(conditions).value();
}

double largest_difference(const ColourMap& map, const Xyz& colour) {
  const Vector3 out = vector_of(map(colour)), in = vector_of(colour);
  double largest = 0;
  for (int i = 0; i < 3; ++i) largest = std::fmax(largest, std::fabs(out[i] - in[i]));
  return largest;
}

bool is_finite(const Xyz& c) { return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z); }

TEST(AppearanceModels, HaveUniqueNamesAndStateTheirLimitations) {
  std::set<std::string_view> names;
  for (const AppearanceModel& model : appearance_models()) {
    names.insert(model.name);
    EXPECT_FALSE(model.source.empty() || model.needs.empty() || model.limits.empty()) << model.name;
    EXPECT_LT(model.valid_from_cd_m2, model.valid_to_cd_m2) << model.name;
    EXPECT_EQ((*appearance_model_named(model.name)).name, model.name);
  }
  EXPECT_EQ(names.size(), appearance_models().size());
  const auto unknown = appearance_model_named("ciecam99");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::invalid_argument);
  EXPECT_NE(unknown.error().message.find("shin"), std::string::npos) << unknown.error().message;
}

TEST(AppearanceModels, RefuseConditionsNoEyeIsIn) {
  const double infinity = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<ViewingConditions> bad;
  for (const double value : {0.0, -1.0, nan, infinity, 1e-13, 1e13}) {
    bad.push_back(at_white(value));
    bad.push_back({.adaptation_cd_m2 = value});
  }
  for (const double value : {0.0, -1.0, nan, infinity}) {
    bad.push_back({.scotopic_ratio = value});
    bad.push_back({.colour_temperature_k = value});
  }
  for (const Xyz& white : {Xyz{0, 0, 0}, {1, -1, 1}, {1, 0, 1}, {nan, 1, 1}, {1, 1, infinity}, {1, 0.1, 0}}) {
    bad.push_back({.white = white});
  }
  for (const AppearanceModel& model : appearance_models()) {
    for (const ViewingConditions& conditions : bad) {
      const auto map = model.at(conditions);
      ASSERT_FALSE(map) << model.name << " " << conditions.white_cd_m2 << " " << conditions.adaptation();
      EXPECT_EQ(map.error().code, ErrorCode::invalid_argument);
    }
  }
}

// What each calls daylight, and how far from the identity it is there, in parts of white.
TEST(AppearanceModels, LeaveColoursAsTheyAreByDay) {
  struct Row {
    const char* name;
    double white_cd_m2, tolerance;
  };
  for (const Row& row : {Row{"hunt", 318.31 * 5, 1e-9},  // bisection to 1e-12 of a signal
                         {"kwak", 318.31 * 5, 1e-9},
                         {"khan_pattanaik", 30, 1e-12},         // m = 1 from 5 cd/m2 of adaptation
                         {"shin", 1000 * 0.9 / 3.1415, 1e-12},  // 1000 lx
                         {"icam06", 318.31, 1e-12},
                         {"cao", 50, 1e-12},           // 10 cd/m2 of adaptation
                         {"kirk_obrien", 1e11, 1e-4},  // with the root of luminance: 1e-4 of white is far away
                         {"filament", 1e8, 1e-3},
                         {"mikamo", 1000, 1e-9},  // 150 Td
                         {"wanat_mantiuk", 1000, 1e-12}}) {
    for (const double brighter : {1.0, 10.0}) {
      const ColourMap map = map_of(row.name, at_white(brighter * row.white_cd_m2));
      // The exponent of Wanat & Mantiuk goes on to rise by 5e-4 above its reference.
      const double tolerance = brighter > 1 && std::string_view(row.name) == "wanat_mantiuk" ? 1e-3 : row.tolerance;
      for (const Xyz& colour : {rgb(1, 1, 1), rgb(0.5, 0.2, 0.1), rgb(0.02, 0.1, 0.6), rgb(0.1, 0.7, 0.05)}) {
        EXPECT_LT(largest_difference(map, colour), tolerance) << row.name;
      }
      EXPECT_LT(largest_difference(map, {0, 0, 0}), 1e-15) << row.name;
    }
  }
}

TEST(AppearanceModels, StayFiniteForWhateverFinitePixel) {
  std::mt19937_64 random(20040811);
  std::uniform_real_distribution<double> exponent(-7, 5), ratio(-1, 1.778), colour(-0.5, 1.5);
  const double huge = std::numeric_limits<double>::max();
  std::vector<Xyz> pixels;
  for (const double x : {0.0, 1e-300, 1.0, -1.0, 1e30, -1e30, huge, -huge}) {
    for (const double y : {0.0, 1e-300, 1.0, -1.0, 1e30, -1e30}) {
      for (const double z : {0.0, 1.0, -1e30, 1e30}) pixels.push_back({x, y, z});
    }
  }
  while (pixels.size() < 400) pixels.push_back({colour(random), colour(random), colour(random)});
  for (const AppearanceModel& model : appearance_models()) {
    for (int i = 0; i < 25; ++i) {  // 400 pixels in each of 25 scenes
      ViewingConditions conditions = at_white(std::pow(10, exponent(random)));
      conditions.scotopic_ratio = std::pow(10, ratio(random));
      if (i % 2) conditions.adaptation_cd_m2 = std::pow(10, exponent(random));
      if (i % 3) conditions.colour_temperature_k = 1000.0 * i;
      const auto map = model.at(conditions);
      ASSERT_TRUE(map);
      for (const Xyz& pixel : pixels) {
        ASSERT_TRUE(is_finite((*map)(pixel))) << model.name << " " << pixel.x << " " << pixel.y << " " << pixel.z;
      }
    }
  }
}

TEST(AppearanceModels, ChangeWithoutAJumpWhenTheLightIsTurnedDown) {
  for (const AppearanceModel& model : appearance_models()) {
    const Xyz blue = rgb(0.1, 0.2, 0.6);
    Vector3 before = vector_of(model.at(at_white(1e4)).value()(blue));
    for (int i = 1; i <= 800; ++i) {
      const Vector3 now = vector_of(model.at(at_white(std::pow(10, 4 - i * 0.01))).value()(blue));
      for (int k = 0; k < 3; ++k) ASSERT_NEAR(now[k], before[k], 0.05) << model.name << " at step " << i;  // of white
      before = now;
    }
  }
}

TEST(AppearanceModels, KeepThePropertiesThatTheyState) {
  const Xyz colour = rgb(0.5, 0.2, 0.1);
  for (const char* name : {"hunt", "kwak"}) {
    const Xyz out = map_of(name, at_white(0.5))(colour);
    EXPECT_NEAR(out.x / out.y, colour.x / colour.y, 1e-12) << name << " keeps chromaticity";
    EXPECT_GT(std::fabs(out.y / colour.y - 1), 0.01) << name;
    const Xyz white = map_of(name, at_white(0.5))(rgb(1, 1, 1));
    EXPECT_NEAR(white.y, 1, 1e-9) << name << " takes white to white";
  }
  EXPECT_NEAR(map_of("wanat_mantiuk", at_white(0.5))(colour).y, colour.y, 1e-14);
  for (const char* name : {"shin", "icam06", "mikamo", "wanat_mantiuk"}) {
    const Xyz white = rgb(1, 1, 1), out = map_of(name, at_white(0.05))(white);
    EXPECT_NEAR(out.x / out.y, white.x / white.y, 1e-9) << name << " keeps the hue of white";
    EXPECT_NEAR(out.z / out.y, white.z / white.y, 1e-9) << name;
  }
  const SeenScene scene = seen_scene(at_white(0.5)).value();
  for (const char* name : {"khan_pattanaik", "kirk_obrien", "filament"}) {
    EXPECT_NEAR(map_of(name, at_white(0.5))(colour).y, relative_mesopic(scene, vector_of(colour)), 1e-12) << name;
  }
}

TEST(AppearanceModels, TurnBlueOrGreyInTheDark) {
  const Xyz white = rgb(1, 1, 1), red = rgb(0.5, 0.1, 0.1);
  for (const char* name : {"khan_pattanaik", "kirk_obrien", "filament"}) {
    const Xyz out = map_of(name, at_white(0.02))(white);
    EXPECT_GT(out.z / out.y, 1.2 * white.z / white.y) << name;
  }
  const auto chroma = [&](const Xyz& c) {
    const Lab lab = lab_of(c, white);
    return std::hypot(lab.a, lab.b);
  };
  for (const char* name : {"shin", "icam06", "wanat_mantiuk"}) {
    EXPECT_LT(chroma(map_of(name, at_white(0.02))(red)), 0.7 * chroma(red)) << name;
  }
}

TEST(Shin, TakesTheTableItIsGiven) {
  const ShinTable still = read_shin_table("1 1 0 1 0 1 0\n10 1 0 1 0 1 0", "identity").value();
  ViewingConditions conditions = at_white(0.01);
  conditions.shin = &still;
  EXPECT_LT(largest_difference(map_of("shin", conditions), rgb(0.5, 0.2, 0.1)), 1e-14);
  ViewingConditions as_is = at_white(250);
  as_is.shin_units = ShinUnits::luminance_as_is;
  EXPECT_GT(largest_difference(map_of("shin", as_is), rgb(0.5, 0.2, 0.1)),
            largest_difference(map_of("shin", at_white(250)), rgb(0.5, 0.2, 0.1)));
}

TEST(LightnessMatch, GivesInDaylightTheSignalOfTheDark) {
  const SeenScene scene = seen_scene(at_white(1)).value();
  const AchromaticSignal by_day = [](const Vector3& cones, double) { return std::sqrt(cones[0]); };
  const AchromaticSignal squared = [](const Vector3& cones, double) { return cones[0]; };
  const ColourMap map = lightness_match(scene, squared, by_day);
  EXPECT_NEAR(map(rgb(0.3, 0.3, 0.3)).y, 0.09, 1e-10);
  EXPECT_NEAR(map(rgb(-0.3, -0.3, -0.3)).y, -0.09, 1e-10) << "odd";
  const AchromaticSignal blind = [](const Vector3&, double) { return 0.0; };
  EXPECT_NEAR(lightness_match(scene, blind, by_day)(rgb(1, 1, 1)).y, 1.0 / 1024, 1e-12) << "bounded";
  EXPECT_EQ(map({0, 0, 0}).y, 0);
}

TEST(SeenScene, LuminanceIsGivenToColoursThatHaveAChromaticity) {
  const Vector3 white{0.95, 1, 1.09};
  EXPECT_NEAR(with_luminance({0.2, 0.4, 0.6}, 0.1, white)[0], 0.05, 1e-15);
  EXPECT_NEAR(with_luminance({0.2, 0.001, 0.6}, 0.1, white)[1], 0.008, 1e-15) << "eight times at most";
  EXPECT_NEAR(with_luminance({0.2, -0.4, 0.6}, 0.1, white)[0], 0.095, 1e-15) << "none of its own";
  EXPECT_NEAR(with_luminance({0.2, 0.4, 0.6}, -0.1, white)[2], -0.109, 1e-15) << "none that it could have";
}

TEST(SeenScene, MesopicLuminanceOfWhiteIsOne) {
  for (const double white_cd_m2 : {1e-4, 0.3, 1e3}) {
    const SeenScene scene = seen_scene({.white_cd_m2 = white_cd_m2, .white = {1.1, 1, 0.36}}).value();
    EXPECT_NEAR(relative_mesopic(scene, scene.white), 1, 1e-15);
    EXPECT_NEAR((scene.to_rec709 * scene.white)[0], 1, 1e-12);
    EXPECT_NEAR((scene.to_rec709 * scene.white)[2], 1, 1e-12);
  }
  const SeenScene dark = seen_scene(at_white(1e-4)).value();
  EXPECT_NEAR(relative_mesopic(dark, {0.2, 0.1, 0.1}), relative_scotopic(dark, {0.2, 0.1, 0.1}), 1e-15);
}

}  // namespace
}  // namespace lowlux::isp
