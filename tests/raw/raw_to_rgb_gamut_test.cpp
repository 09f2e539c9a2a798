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

/// Differences of the channels say the direction of chroma: those of `to` are those of `from`, times one factor >= 0.
void expect_same_direction(const Rgb& from, const Rgb& to) {
  const Rgb before{from[0] - from[1], from[1] - from[2], from[2] - from[0]};
  const Rgb after{to[0] - to[1], to[1] - to[2], to[2] - to[0]};
  for (int c = 0; c < 3; ++c) {
    const int d = (c + 1) % 3;
    ASSERT_NEAR(before[c] * after[d], before[d] * after[c], 2e-6);
    ASSERT_GE(before[c] * after[c], -1e-6);
  }
}

TEST(RawToRgbGamut, KeepsTheDirectionOfChromaOfAllThatIsBrighterThanBlack) {
  const auto colours = random_colours(20000, -1.0f, 2.0f);
  const auto results = moved(colours);
  for (std::size_t i = 0; i < colours.size(); ++i) {
    if (luminance(colours[i]) <= 0) continue;
    ASSERT_NO_FATAL_FAILURE(expect_same_direction(colours[i], results[i]));
  }
}

TEST(RawToRgbGamut, KeepsTheLuminanceOfColoursBelowBlack) {
  const auto colours = random_colours(20000, -1.0f, 2.0f);
  const auto results = moved(colours);
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const double y = luminance(colours[i]);
    if (y <= 0 || *std::max_element(results[i].begin(), results[i].end()) > 0.999) continue;
    ASSERT_NEAR(luminance(results[i]), y, 1e-5);
  }
}

TEST(RawToRgbGamut, KeepsTheLeastChannelOfColoursAboveWhite) {
  const auto colours = random_colours(20000, 0.0f, 3.0f);
  const auto results = moved(colours);
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const auto [least, greatest] = std::minmax_element(colours[i].begin(), colours[i].end());
    if (*greatest <= 1) continue;
    ASSERT_NEAR(*std::min_element(results[i].begin(), results[i].end()), std::min(*least, 1.0), 1e-6);
    ASSERT_NEAR(*std::max_element(results[i].begin(), results[i].end()), 1, 1e-6);
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

TEST(RawToRgbGamut, MakesBlackBelowBlackAndWhiteOnlyWhereEveryChannelIs) {
  const auto results = moved({{-1, -0.2, 2}, {-0.1, -0.1, -0.1}, {0, 0, 0}, {1, 1, 1}, {3, 2, 1}, {1.2, 1.01, 1.5}});
  const Rgb black{0, 0, 0}, white{1, 1, 1};
  for (const int i : {0, 1, 2}) EXPECT_EQ(results[i], black);
  for (const int i : {3, 4, 5}) EXPECT_EQ(results[i], white);
}

TEST(RawToRgbGamut, FollowsTheEquations) {
  // Beyond white alone; yellow brighter than white; beyond both ends; luminance exactly 0, exactly 1.
  const auto results =
      moved({{1.5, 0.5, 0.25}, {2, 1.5, 0.5}, {3, 2, -1}, {2, 0, 0}, {-0.5, 0, 0}, {0.5, 1, -0.25}}, {0, 1, 0});
  const Rgb expected[] = {{1, 0.4, 0.25}, {1, 0.5 + 1.0 / 3, 0.5}, {1, 0.75, 0}, {1, 0, 0}, {0, 0, 0}, {0.6, 1, 0}};
  for (std::size_t i = 0; i < results.size(); ++i) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(results[i][c], expected[i][c], 1e-6) << i << ' ' << c;
  }
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
