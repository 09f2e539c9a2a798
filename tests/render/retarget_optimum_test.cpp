#include "isp/render/retarget/retarget_optimum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "isp/model/appearance/shin.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/render/output_space.h"

namespace lowlux::isp::retarget_optimum_test {
namespace {

Xyz white() { return xyz_of(*rgb_to_xyz(primaries_rec709) * Vector3{1, 1, 1}); }

// A display on which chroma looks `chroma` times as strong and light `light` times as bright.
ColourMap faded(double chroma, double light = 1) {
  return [=](const Xyz& c) {
    const double y = light * c.y, w = white().x, v = white().z;
    return Xyz{y * w + chroma * light * (c.x - c.y * w), y, y * v + chroma * light * (c.z - c.y * v)};
  };
}

AppearanceMatch match_for(double chroma, double light = 1) { return {faded(1), faded(chroma, light), 0, {}}; }

Vector3 random_code(std::mt19937& draw) {
  std::uniform_real_distribution<double> uniform(0, 1);
  return {uniform(draw), uniform(draw), uniform(draw)};
}

Lab lab_of_code(const Vector3& code, const ColourMap& seen) {
  Vector3 light{};
  for (std::size_t c = 0; c < 3; ++c) light[c] = decode_transfer(OutputSpace::srgb, code[c]);
  return lab_of(seen(xyz_of(*rgb_to_xyz(primaries_rec709) * light)), white());
}

double largest_difference(const Vector3& a, const Vector3& b) {
  return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

// The best of a grid over the cube, then of finer grids about the best.
Vector3 best_of_grids(const AppearanceMatch& match, const Vector3& source) {
  Vector3 best{0.5, 0.5, 0.5};
  double cost = match_cost(match, source, best), half = 0.5;
  for (int points = 17; half > 1e-5; points = 7, half *= 0.4) {
    const Vector3 centre = best;
    for (int i = 0; i < points * points * points; ++i) {
      Vector3 code = centre;
      for (int c = 0, rest = i; c < 3; ++c, rest /= points) {
        code[c] = std::clamp(centre[c] + half * (2.0 * (rest % points) / (points - 1) - 1), 0.0, 1.0);
      }
      const double there = match_cost(match, source, code);
      if (there < cost) {
        cost = there;
        best = code;
      }
    }
  }
  return best;
}

TEST(ClosestDisplayable, GivesTheColourBackUnderEqualConditions) {
  std::mt19937 draw(1);
  for (int i = 0; i < 200; ++i) {
    const Vector3 code = random_code(draw);
    const MatchedColour found = closest_displayable(match_for(1), code);
    EXPECT_TRUE(found.converged);
    EXPECT_FALSE(found.held);
    EXPECT_LT(largest_difference(found.code, code), 1e-9) << "no step: the slope is 0 there";
  }
}

TEST(ClosestDisplayable, MatchesWhatCanBeMatchedWhereFaithfulnessIsNotAskedFor) {
  std::mt19937 draw(2);
  AppearanceMatch match = match_for(0.6, 0.9);
  match.weights.faithfulness = 0;
  for (int i = 0; i < 100; ++i) {
    Vector3 code = random_code(draw);
    for (double& v : code) v = 0.45 + 0.1 * v;  // no colour so strong that it has to leave the cube
    const MatchedColour found = closest_displayable(match, code);
    const Lab wanted = lab_of_code(code, match.seen_source), got = lab_of_code(found.code, match.seen_display);
    EXPECT_FALSE(found.held);
    EXPECT_NEAR(got.l, wanted.l, 1e-4) << "steps end at 1e-7 of the code range, 100 L* or 500 a*";
    EXPECT_NEAR(got.a, wanted.a, 1e-4);
    EXPECT_NEAR(got.b, wanted.b, 1e-4);
  }
}

void expect_best_of_grids(const AppearanceMatch& match, unsigned seed, int colours) {
  std::mt19937 draw(seed);
  for (int i = 0; i < colours; ++i) {
    const Vector3 code = random_code(draw);
    const MatchedColour found = closest_displayable(match, code);
    const Vector3 grid = best_of_grids(match, code);
    EXPECT_TRUE(found.converged);
    // Lab has slopes of 500 or so per code range, squared and times (1e-5)^2: 3e-5.
    EXPECT_LE(found.cost, match_cost(match, code, grid) + 1e-6);
    EXPECT_LT(largest_difference(found.code, grid), 0.02)
        << "codes near 0 matter least: the cost differs by " << match_cost(match, code, grid) - found.cost;
  }
}

TEST(ClosestDisplayable, IsTheBestOfAFineGrid) {
  for (const double chroma : {0.25, 0.6, 1.5}) expect_best_of_grids(match_for(chroma, 0.95), 3, 12);
}

TEST(ClosestDisplayable, IsTheBestOfAFineGridAsShinsModelSees) {
  ViewingConditions source, display;
  source.white = display.white = white();
  source.shin_units = display.shin_units = ShinUnits::luminance_as_is;
  source.white_cd_m2 = 250;
  const AppearanceModel model = shin_appearance();
  for (const double white_cd_m2 : {1.0, 2.0, 10.0}) {
    display.white_cd_m2 = white_cd_m2;
    const auto seen_source = model.at(source), seen_display = model.at(display);
    ASSERT_TRUE(seen_source && seen_display);
    expect_best_of_grids({*seen_source, *seen_display, 0, {}}, 8, 12);
  }
}

TEST(ClosestDisplayable, GreysStayGreyAndRise) {
  const AppearanceMatch match = match_for(0.3, 0.97);
  double before = -1;
  for (int i = 0; i <= 255; ++i) {
    const MatchedColour found = closest_displayable(match, {i / 255.0, i / 255.0, i / 255.0});
    EXPECT_LT(std::abs(found.code[0] - found.code[1]), 2e-5) << i << ": derivatives by differences of 1e-5";
    EXPECT_LT(std::abs(found.code[2] - found.code[1]), 2e-5) << i;
    EXPECT_GE(found.code[1], before) << i;
    before = found.code[1];
  }
  EXPECT_TRUE(closest_displayable(match, {1, 1, 1}).held) << "a white 3 % too dark cannot be made up for";
  EXPECT_EQ(closest_displayable(match, {0, 0, 0}).code, (Vector3{0, 0, 0}));
}

TEST(ClosestDisplayable, MovesContinuouslyWithTheColour) {
  const AppearanceMatch match = match_for(0.3);
  std::mt19937 draw(5);
  for (const double step : {1e-2, 1e-4}) {
    for (int i = 0; i < 400; ++i) {
      const Vector3 code = random_code(draw), way = random_code(draw);
      Vector3 near = code;
      for (int c = 0; c < 3; ++c) near[c] = std::clamp(code[c] + step * (way[c] - 0.5), 0.0, 1.0);
      const Vector3 one = closest_displayable(match, code).code, other = closest_displayable(match, near).code;
      Vector3 light{}, light_near{};
      for (int c = 0; c < 3; ++c) {
        light[c] = decode_transfer(OutputSpace::srgb, one[c]);
        light_near[c] = decode_transfer(OutputSpace::srgb, other[c]);
      }
      // Chroma is given 1/0.3 times over, light has a slope of up to 2.3 over codes: 7.6, and 3 times that as L* and
      // hue make room for one another where a face of the cube is met.
      EXPECT_LT(largest_difference(light, light_near), 25 * step);
    }
  }
}

TEST(ClosestDisplayable, ADisplaysBlackIsTakenIntoAccount) {
  AppearanceMatch match = match_for(1);
  match.display_black = 0.05;
  match.weights.faithfulness = 0;
  const MatchedColour grey = closest_displayable(match, {0.5, 0.5, 0.5});
  const double wanted = (decode_transfer(OutputSpace::srgb, 0.5) - 0.05) / 0.95;
  EXPECT_NEAR(grey.code[1], encode_transfer(OutputSpace::srgb, wanted), 1e-5);
  const MatchedColour black = closest_displayable(match, {0, 0, 0});
  EXPECT_EQ(black.code, (Vector3{0, 0, 0}));
  EXPECT_TRUE(black.held);
}

TEST(ClosestDisplayable, CodesBeyondTheCubeCountAsTheNearest) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const AppearanceMatch match = match_for(0.4);
  EXPECT_EQ(closest_displayable(match, {-3, 0.5, inf}).code, closest_displayable(match, {0, 0.5, 1}).code);
  EXPECT_EQ(closest_displayable(match, {nan, 0.5, 0.5}).code, closest_displayable(match, {0, 0.5, 0.5}).code);
}

}  // namespace
}  // namespace lowlux::isp::retarget_optimum_test
