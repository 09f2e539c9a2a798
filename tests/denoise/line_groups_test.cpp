#include "denoise/lines/line_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/numbers.h"
#include "tests/support/only_target.h"

namespace lowlux::denoise {
namespace {

using test::nan;

Plane<float> noise(int width, int height, double fraction_of_nan, std::uint32_t seed) {
  std::mt19937 draw(seed);
  std::normal_distribution<float> value(20, 5);
  std::uniform_real_distribution<double> lost;
  Plane<float> out(width, height);
  for (std::size_t i = 0; i < out.size(); ++i) {
    out.data()[i] = lost(draw) < fraction_of_nan ? std::numeric_limits<float>::infinity() : value(draw);
  }
  return out;
}

/// The mean of group g of a line, by its definition: every second pixel of an eighth of the line.
double mean_by_definition(const std::vector<float>& line, int g) {
  const auto pairs = static_cast<long long>(line.size() + 1) / 2;
  double sum = 0;
  int count = 0;
  for (std::size_t i = static_cast<std::size_t>(g % 2); i < line.size(); i += 2) {
    if (static_cast<long long>(i / 2) * segments / pairs != g / 2 || !std::isfinite(line[i])) continue;
    sum += static_cast<double>(line[i]);
    ++count;
  }
  return count > 0 ? sum / count : nan;
}

std::vector<float> line_of(const Plane<float>& pixels, Lines lines, int i) {
  std::vector<float> out;
  if (lines == Lines::rows) {
    for (int x = 0; x < pixels.width(); ++x) out.push_back(pixels.at(x, i));
  } else {
    for (int y = 0; y < pixels.height(); ++y) out.push_back(pixels.at(i, y));
  }
  return out;
}

void expect_same(double got, double wanted) {
  if (std::isnan(wanted)) {
    EXPECT_TRUE(std::isnan(got));
  } else {
    EXPECT_EQ(got, wanted);
  }
}

TEST(LineGroups, AreMeansOfEverySecondPixelOfEighths) {
  for (const auto& [width, height] : {std::array{1, 1}, {3, 40}, {16, 16}, {33, 18}, {130, 67}}) {
    const Plane<float> pixels = noise(width, height, 0.05, 3);
    for (const Lines lines : {Lines::rows, Lines::columns}) {
      const Plane<double> means = group_means(pixels.view(), lines);
      ASSERT_EQ(means.width(), lines == Lines::rows ? height : width);
      ASSERT_EQ(means.height(), groups);
      for (int i = 0; i < means.width(); ++i) {
        const std::vector<float> line = line_of(pixels, lines, i);
        for (int g = 0; g < groups; ++g) expect_same(means.at(i, g), mean_by_definition(line, g));
      }
    }
  }
}

/// The median over the groups that are finite, from all of them in order.
double sorted_median(const Plane<double>& means, int line, int other) {
  std::vector<double> all;
  for (int g = 0; g < groups; ++g) {
    const double d = means.at(line, g) - means.at(other, g);
    if (std::isfinite(d)) all.push_back(d);
  }
  if (all.empty()) return nan;
  std::ranges::sort(all);
  const std::size_t middle = all.size() / 2;
  return all.size() % 2 == 1 ? all[middle] : (all[middle] + all[middle - 1]) / 2;
}

void expect_medians(const Plane<double>& means, int distance) {
  const std::vector<double> got = differences(means, distance);
  ASSERT_EQ(got.size(), static_cast<std::size_t>(std::max(means.width() - distance, 0)));
  for (int line = 0; line + distance < means.width(); ++line) {
    expect_same(got[static_cast<std::size_t>(line)], sorted_median(means, line + distance, line));
  }
}

TEST(LineGroups, DifferencesAreMediansWithEachInstructionSet) {
  ASSERT_FALSE(test::kernel_targets().empty());
  for (const std::int64_t target : test::kernel_targets()) {
    const test::OnlyTarget only(target);
    for (const int lines : {1, 2, 5, 16, 61, 200}) {
      for (const double fraction_of_nan : {0.0, 0.1}) {
        const Plane<double> means = group_means(noise(32, lines, fraction_of_nan, 7).view(), Lines::rows);
        for (const int distance : {1, 2, 16}) expect_medians(means, distance);
      }
    }
  }
}

TEST(LineGroups, DifferencesOfEqualAndOfExtremeValuesAreMediansToo) {
  Plane<double> means(40, groups);
  for (int g = 0; g < groups; ++g) {
    for (int i = 0; i < means.width(); ++i) {
      const int kind = (g * 7 + i * 3) % 5;
      means.at(i, g) = kind == 0 ? 1e300 : kind == 1 ? -1e300 : kind == 2 ? 5e-324 : 0.0;
    }
  }
  expect_medians(means, 2);
}

}  // namespace
}  // namespace lowlux::denoise
