#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "isp/base/random/exact_draw.h"
#include "isp/base/random/random.h"
#include "tests/reference/poisson_ref.h"

namespace lowlux {
namespace {

/// Both ends, the middle, and the neighbourhood of every power of two, where exponents change.
std::vector<std::uint32_t> telling_words() {
  std::vector<std::uint32_t> words;
  for (std::uint32_t i = 0; i < 2000; ++i) {
    words.push_back(i);
    words.push_back(~i);
    words.push_back(0x80000000U + i);
    words.push_back(0x7fffffffU - i);
  }
  for (int bit = 0; bit < 32; ++bit) {
    for (std::uint32_t i = 0; i < 9; ++i) words.push_back((1U << bit) + i - 4);
  }
  std::mt19937 random(1);
  for (int i = 0; i < 200'000; ++i) words.push_back(random());
  return words;
}

TEST(Normal, IsTheQuantileToAMillionth) {
  double worst = 0;
  for (const std::uint32_t r : telling_words()) {
    const double expected = reference::normal_deviate(r);
    worst = std::max(worst, std::abs(normal_of_word(r) - expected) / std::abs(expected));
  }
  EXPECT_LT(worst, 1e-6) << "relative, the promise of random.h";
  RecordProperty("worst", std::to_string(worst));
}

TEST(Normal, InDoubleIsTheQuantileToRounding) {
  for (const std::uint32_t r : telling_words()) {
    const double expected = reference::normal_deviate(r);
    ASSERT_NEAR(exact_normal(r), expected, 1e-14) << r << ": absolute, as exact_draw.h promises";
  }
}

TEST(Normal, IsOddToAMillionth) {
  for (const std::uint32_t r : telling_words()) {
    const float z = normal_of_word(r);
    ASSERT_LE(std::abs(z + normal_of_word(~r)), 1e-6 * std::abs(z)) << r << ": the half step rounds differently";
    ASSERT_EQ(exact_normal(r), -exact_normal(~r)) << r;
  }
}

TEST(Normal, HardlyEverFallsWhereTheWordRises) {
  std::vector<std::uint32_t> words = telling_words();
  std::sort(words.begin(), words.end());
  float before = -7;
  for (const std::uint32_t r : words) {
    const float z = normal_of_word(r);
    ASSERT_GE(z - before, -1e-6f * std::abs(z)) << r << ": relative, the sum of two errors";
    before = z;
  }
}

TEST(Normal, StaysWithinItsLimits) {
  EXPECT_NEAR(normal_of_word(0), -6.338, 0.001);  // quantile of 2^-33
  EXPECT_NEAR(normal_of_word(~0U), 6.338, 0.001);
  for (const std::uint32_t r : telling_words()) ASSERT_LE(std::abs(normal_of_word(r)), 6.4f);
}

}  // namespace
}  // namespace lowlux
