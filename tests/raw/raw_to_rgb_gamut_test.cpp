#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "isp/raw/kernel/raw_to_rgb.h"
#include "tests/raw/raw_to_rgb_support.h"

namespace lowlux {
namespace {

using namespace raw_to_rgb_testing;
using reference::Rgb;

constexpr std::array<float, 3> weights{0.2126f, 0.7152f, 0.0722f};

double luminance(const Rgb& v) { return weights[0] * v[0] + weights[1] * v[1] + weights[2] * v[2]; }

bool inside(const Rgb& v) {
  return std::all_of(v.begin(), v.end(), [](double c) { return c >= 0 && c <= 1; });
}

/// What linear() makes of colours already in the output's primaries.
std::vector<Rgb> moved(const std::vector<Rgb>& colours, const std::array<float, 3>& luminance_weights = weights) {
  const int n = static_cast<int>(colours.size());
  std::vector<Strided<float>> in(3, Strided<float>(n, 1, 0, 0)), out = in;
  for (int i = 0; i < n; ++i) {
    for (int c = 0; c < 3; ++c) in[c].memory[i] = static_cast<float>(colours[i][c]);
  }
  InlineExecutor one;
  isp::RawToRgb kernel(n, 1);
  const isp::RgbTransform transform{{1, 0, 0, 0, 1, 0, 0, 0, 1}, luminance_weights, HUGE_VALF, true};
  kernel.linear(isp::CameraPlanes{{in[0].view(), in[1].view(), in[2].view()}}, transform,
                {out[0].view(), out[1].view(), out[2].view()}, one);
  std::vector<Rgb> result(n);
  for (int i = 0; i < n; ++i) result[i] = {out[0].memory[i], out[1].memory[i], out[2].memory[i]};
  return result;
}

/// Colours around the unit cube, every one representable in float.
std::vector<Rgb> random_colours(int n, float least, float greatest) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> value(least, greatest);
  std::vector<Rgb> out(n);
  for (Rgb& colour : out) {
    for (double& c : colour) c = value(random);
  }
  return out;
}

TEST(RawToRgbGamut, NeverLeavesTheUnitCube) {
  for (const float reach : {0.001f, 1.0f, 30.0f, 1e4f, 9e8f}) {
    for (const Rgb& v : moved(random_colours(20000, -reach, 1 + reach))) ASSERT_TRUE(inside(v));
  }
}

TEST(RawToRgbGamut, KeepsLuminanceAndDirectionBetweenBlackAndWhite) {
  const auto colours = random_colours(20000, -1.0f, 2.0f);
  const auto results = moved(colours);
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const double y = luminance(colours[i]);
    if (y <= 0 || y >= 1) continue;
    ASSERT_NEAR(luminance(results[i]), y, 1e-5);
    // out' - Y = t (out - Y): cross products vanish, and t is not negative.
    const Rgb from{colours[i][0] - y, colours[i][1] - y, colours[i][2] - y};
    const Rgb to{results[i][0] - y, results[i][1] - y, results[i][2] - y};
    for (int c = 0; c < 3; ++c) {
      const int d = (c + 1) % 3;
      ASSERT_NEAR(from[c] * to[d], from[d] * to[c], 2e-6);
      ASSERT_GE(from[c] * to[c], -1e-6);
    }
  }
}

TEST(RawToRgbGamut, MovesNoFartherThanTheSurfaceOfTheCube) {
  const auto colours = random_colours(20000, -1.0f, 2.0f);
  const auto results = moved(colours);
  for (std::size_t i = 0; i < colours.size(); ++i) {
    if (inside(colours[i])) continue;
    const auto [least, greatest] = std::minmax_element(results[i].begin(), results[i].end());
    ASSERT_LT(std::min(*least, 1 - *greatest), 1e-6) << "a colour that was outside ends inside the cube";
  }
}

TEST(RawToRgbGamut, LeavesColoursInsideUntouchedWhateverTheirNeighboursAre) {
  auto colours = random_colours(4000, 0.0f, 1.0f);
  for (std::size_t i = 0; i < colours.size(); i += 5) colours[i] = {-0.5, 0.5, 1.5};
  const auto results = moved(colours);
  for (std::size_t i = 0; i < colours.size(); ++i) {
    if (i % 5 != 0) {
      ASSERT_EQ(results[i], colours[i]);
    }
  }
}

TEST(RawToRgbGamut, MakesBlackBelowBlackAndWhiteAboveWhite) {
  const auto results = moved({{-1, -0.2, 2}, {-0.1, -0.1, -0.1}, {0, 0, 0}, {1, 1, 1}, {3, 2, -1}, {0.9, 1.2, 1.5}});
  const Rgb black{0, 0, 0}, white{1, 1, 1};
  EXPECT_EQ(results[0], black);
  EXPECT_EQ(results[1], black);
  EXPECT_EQ(results[2], black);
  EXPECT_EQ(results[3], white);
  for (const int i : {4, 5}) {
    for (const double c : results[i]) EXPECT_NEAR(c, 1, 1e-6);
  }
}

TEST(RawToRgbGamut, MakesBlackAndWhiteOfColoursWhoseLuminanceIsExactlyThat) {
  const auto results = moved({{2, 0, 0}, {-0.5, 0, 0}, {0.5, 1, -0.25}, {2, 1, 1}}, {0, 1, 0});
  const Rgb black{0, 0, 0}, white{1, 1, 1};
  EXPECT_EQ(results[0], black);
  EXPECT_EQ(results[1], black);
  EXPECT_EQ(results[2], white);
  EXPECT_EQ(results[3], white);
}

TEST(RawToRgbGamut, EqualsTheReference) {
  const auto colours = random_colours(20000, -2.0f, 3.0f);
  const auto results = moved(colours);
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const Rgb expected = reference::moved_into_gamut(colours[i], weights);
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(results[i][c], expected[c], 2e-6);
  }
}

}  // namespace
}  // namespace lowlux
