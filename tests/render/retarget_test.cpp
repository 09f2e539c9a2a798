#include "isp/render/retarget/retarget.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "isp/model/appearance/shin.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

RetargetMap map_for(RetargetMethod method, double source, double display, ShinUnits units = ShinUnits::lux) {
  RetargetOptions options;
  options.method = method;
  options.source_cd_m2 = source;
  options.display_cd_m2 = display;
  options.units = units;
  const auto map = retargeting(options);
  EXPECT_TRUE(map) << map.error().message;
  return map.value_or([](const Vector3&) { return RetargetedColour{}; });
}

double largest_difference(const Vector3& a, const Vector3& b) {
  return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

double chroma(const Vector3& code) { return std::ranges::max(code) - std::ranges::min(code); }

Vector3 encoded(const Vector3& light) {
  Vector3 code{};
  for (std::size_t c = 0; c < 3; ++c) code[c] = encode_transfer(OutputSpace::srgb, light[c]);
  return code;
}

TEST(Retarget, EveryMethodKeepsThePictureOnItsOwnDisplay) {
  std::mt19937 draw(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const auto& [method, name] : retarget_methods) {
    for (const double white : {2.0, 250.0}) {
      const RetargetMap map = map_for(method, white, white);
      for (int i = 0; i < 30; ++i) {
        const Vector3 code{uniform(draw), uniform(draw), uniform(draw)};
        EXPECT_LT(largest_difference(map(code).code, code), 1e-6) << name << " at " << white;
        EXPECT_FALSE(map(code).held) << name;
      }
    }
  }
}

TEST(Retarget, GreysRiseAndStayGrey) {
  for (const auto& [method, name] : retarget_methods) {
    const RetargetMap map = map_for(method, 250, 2);
    double before = -1;
    for (int i = 0; i <= 64; ++i) {
      const Vector3 code = map({i / 64.0, i / 64.0, i / 64.0}).code;
      if (method != RetargetMethod::cao) {  // adds the rods' own colour
        EXPECT_LT(chroma(code), 2e-5) << name << " " << i << ": derivatives by differences of 1e-5";
      }
      EXPECT_GE(code[1], before - 1e-9) << name << " " << i;
      before = code[1];
    }
  }
}

TEST(Retarget, MethodsThatMindTheRodsSaturateForADimDisplay) {
  const Vector3 skin{0.78, 0.60, 0.50};
  for (const RetargetMethod method :
       {RetargetMethod::constrained, RetargetMethod::shin, RetargetMethod::shin_consistent, RetargetMethod::wanat}) {
    double before = chroma(skin);
    for (const double display : {50.0, 10.0, 5.0}) {
      const double now = chroma(map_for(method, 250, display)(skin).code);
      EXPECT_GT(now, before) << name_of(method) << " " << display;
      before = now;
    }
  }
}

TEST(Retarget, ThePublishedInverseIsThatOfTheThesisEquations) {
  // A colour that stays in the gamut: the signals of the source at 250, the linear system solved at 50 by hand, K'_w =
  // 0.784 and Y' of the source; E = 50 is photopic, so that beta is 0 and only l and m matter.
  const RetargetMap map = map_for(RetargetMethod::shin, 250, 50, ShinUnits::luminance_as_is);
  const double l = (0.1 + 0.9 * (std::log10(250.0) + 1) / 4) / (0.1 + 0.9 * (std::log10(50.0) + 1) / 4);
  const double m = (0.1 + 0.9 * std::log10(250.0) / 3) / (0.1 + 0.9 * std::log10(50.0) / 3);
  const Matrix3 to_xyz = *rgb_to_xyz(primaries_rec709);
  const Matrix3 cones{{{0.155, 0.543, -0.033}, {-0.155, 0.457, 0.033}, {0, 0, 1}}};
  const Vector3 light{0.4, 0.3, 0.28}, white = cones * (to_xyz * Vector3{1, 1, 1});
  Vector3 lms = cones * (to_xyz * light);
  const Vector3 equal{2.0 / 3, 1.0 / 3, 1};
  for (int i = 0; i < 3; ++i) lms[i] *= equal[i] / white[i];
  const double s = lms[0] + lms[1], d = l * (lms[0] - 2 * lms[1]), t = m * (lms[0] + lms[1] - lms[2]);
  Vector3 shown{(2 * s + d) / 3, (s - d) / 3, s - t};
  for (int i = 0; i < 3; ++i) shown[i] *= white[i] / equal[i];
  const Vector3 wanted = encoded(*inverse(cones * to_xyz) * shown);
  const RetargetedColour got = map(encoded(light));
  EXPECT_LT(largest_difference(got.code, wanted), 1e-9);
  EXPECT_FALSE(got.held);
}

TEST(Retarget, SelfConsistentInverseLooksAlikeThePublishedOneDoesNot) {
  const Vector3 light{0.3, 0.28, 0.27};
  RetargetOptions options;
  options.units = ShinUnits::luminance_as_is;
  const Matrix3 to_xyz = *rgb_to_xyz(primaries_rec709);
  const ShinEye eye = shin_eye({.white = xyz_of(to_xyz * Vector3{1, 1, 1})});
  const ShinTable& table = shin_substitute();
  const auto signals = [&](const Vector3& code, double e) {
    Vector3 rgb{};
    for (std::size_t c = 0; c < 3; ++c) rgb[c] = decode_transfer(OutputSpace::srgb, code[c]);
    return shin_forward(xyz_of(to_xyz * rgb), shin_coefficients(table, e), eye);
  };
  const OpponentSignals wanted = signals(encoded(light), 250);
  for (const RetargetMethod method : {RetargetMethod::shin, RetargetMethod::shin_consistent}) {
    const auto got = map_for(method, 250, 2, options.units)(encoded(light));
    ASSERT_FALSE(got.held);
    const double off = std::abs(signals(got.code, 2).a - wanted.a);
    if (method == RetargetMethod::shin) {
      EXPECT_GT(off, 1e-5);
    } else {
      EXPECT_LT(off, 1e-9);
    }
  }
}

// Lab as Shin's eye sees codes on a display, relative to D65.
Lab seen(const Vector3& code, double white_cd_m2) {
  const Matrix3 to_xyz = *rgb_to_xyz(primaries_rec709);
  const Xyz white = xyz_of(to_xyz * Vector3{1, 1, 1});
  const ShinEye eye = shin_eye({.white = white});
  Vector3 light{};
  for (std::size_t c = 0; c < 3; ++c) light[c] = decode_transfer(OutputSpace::srgb, code[c]);
  const ShinCoefficients at = shin_coefficients(shin_substitute(), shin_level(white_cd_m2, ShinUnits::lux));
  return lab_of(shin_daylight(shin_forward(xyz_of(to_xyz * light), at, eye), eye), white);
}

TEST(Retarget, TheOptimumLooksMoreAlikeThanThePublishedInverseMovedIntoTheGamut) {
  for (const double display : {1.0, 2.0, 10.0}) {
    const RetargetMap ours = map_for(RetargetMethod::constrained, 250, display);
    const RetargetMap published = map_for(RetargetMethod::shin, 250, display);
    constexpr int levels = 8;
    double our_sum = 0, published_sum = 0, none_sum = 0;
    for (int i = 0; i < levels * levels * levels; ++i) {
      const double step = 1.0 / (levels - 1);
      const Vector3 code{step * (i / levels / levels), step * (i / levels % levels), step * (i % levels)};
      const Lab original = seen(code, 250);
      our_sum += delta_e_94c(original, seen(ours(code).code, display));
      published_sum += delta_e_94c(original, seen(published(code).code, display));
      none_sum += delta_e_94c(original, seen(code, display));
    }
    EXPECT_LT(our_sum, 0.95 * published_sum) << display;
    EXPECT_LT(published_sum, none_sum) << display;
  }
}

// Between neighbouring nodes of a table of 17 levels, of the code range.
double largest_jump(const RetargetMap& map) {
  constexpr int levels = 17;
  std::vector<Vector3> node;
  node.reserve(levels * levels * levels);
  for (int i = 0; i < levels * levels * levels; ++i) {
    const double step = 1.0 / (levels - 1);
    node.push_back(map({step * (i / levels / levels), step * (i / levels % levels), step * (i % levels)}).code);
  }
  double largest = 0;
  for (int i = 0; i < levels * levels * levels; ++i) {
    const int place[]{i / levels / levels, i / levels % levels, i % levels}, stride[]{levels * levels, levels, 1};
    for (int axis = 0; axis < 3; ++axis) {
      if (place[axis] + 1 < levels) largest = std::max(largest, largest_difference(node[i], node[i + stride[axis]]));
    }
  }
  return largest;
}

TEST(Retarget, NeighbouringColoursStayCloserTogetherThanWithThePublishedInverse) {
  for (const ShinUnits units : {ShinUnits::lux, ShinUnits::luminance_as_is}) {
    const double ours = largest_jump(map_for(RetargetMethod::constrained, 250, 2, units));
    const double published = largest_jump(map_for(RetargetMethod::shin, 250, 2, units));
    RecordProperty(units == ShinUnits::lux ? "ours_lux" : "ours_luminance", std::to_string(ours));
    EXPECT_LT(ours, published);
    EXPECT_LT(ours, 0.65) << "sRGB codes just above 0 are steep in light: 0.6 is what a dark blue does";
  }
}

TEST(Retarget, ADisplaysBlackIsTakenOff) {
  for (const RetargetMethod method : {RetargetMethod::shin, RetargetMethod::constrained}) {
    RetargetOptions options;
    options.method = method;
    options.display_black_cd_m2 = 0.02;
    const auto map = retargeting(options);
    ASSERT_TRUE(map);
    options.display_black_cd_m2 = 0;
    const auto without = retargeting(options);
    EXPECT_LT((*map)({0.3, 0.3, 0.3}).code[1], (*without)({0.3, 0.3, 0.3}).code[1]) << name_of(method);
    EXPECT_LT(largest_difference((*map)({0, 0, 0}).code, {0, 0, 0}), 1e-9) << name_of(method);
  }
}

TEST(Retarget, CoefficientsAreNamedWhereTheyAreUsed) {
  RetargetOptions options;
  EXPECT_EQ(coefficients_name(options), "SHIN-SUB-1");
  const auto table = read_shin_table("1 1 0 0.5 0 0.4 0\n1000 1 0 1 0 1 0\n", "mine.csv");
  ASSERT_TRUE(table);
  options.shin = &*table;
  EXPECT_EQ(coefficients_name(options), "mine.csv");
  EXPECT_TRUE(retargeting(options));
  options.method = RetargetMethod::wanat;
  EXPECT_EQ(coefficients_name(options), "");
}

TEST(Retarget, RefusesWhatItCannotDo) {
  const auto refused = [](double source, double display, double black) {
    RetargetOptions options;
    options.source_cd_m2 = source;
    options.display_cd_m2 = display;
    options.display_black_cd_m2 = black;
    const auto map = retargeting(options);
    return map ? std::string() : map.error().message;
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, 0.99e-11, 1.01e12, nan, inf}) {
    EXPECT_NE(refused(bad, 2, 0).find("source's luminance must be within 1e-11 and 1e12"), std::string::npos) << bad;
    EXPECT_NE(refused(250, bad, 0).find("display's luminance must be within 1e-11 and 1e12"), std::string::npos) << bad;
  }
  for (const double good : {1e-11, 1e12}) EXPECT_EQ(refused(good, good, 0), "");
  for (const double bad : {2.0, 3.0, -0.1, nan}) {
    EXPECT_NE(refused(250, 2, bad).find("black must be 0 or more and below its white"), std::string::npos) << bad;
  }
}

}  // namespace
}  // namespace lowlux::isp
