#include "isp/bench/stages/count_laws.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "isp/base/random/random.h"

namespace lowlux::isp {
namespace {

TEST(CountLaws, PoissonsHasItsClosedFormsAndItsVariance) {
  EXPECT_NEAR(poisson_law(0.1)[0], std::exp(-0.1), 1e-15);
  EXPECT_NEAR(poisson_law(3)[2], std::exp(-3.0) * (1 + 3 + 4.5), 1e-15);
  for (const double mean : {0.1, 1.0, 10.5, 1e4, 1e6}) {
    const auto law = poisson_law(mean);
    EXPECT_NEAR(variance_of_law(law) / mean, 1, 1e-9) << mean;  // sums of up to 1e6 doubles
    EXPECT_EQ(law.back(), 1);
    EXPECT_TRUE(std::ranges::is_sorted(law));
  }
}

TEST(CountLaws, TheLawOfWordsCountsThem) {
  const auto quarters = law_of_words([](std::uint32_t r) { return static_cast<double>(r >> 30); }, 5);
  EXPECT_EQ(quarters, (std::vector<double>{0.25, 0.5, 0.75, 1, 1}));
  EXPECT_NEAR(variance_of_law(quarters), 1.25, 1e-12);
  for (const float mean : {0.1F, 2.0F, 300.0F}) {
    const auto exact = poisson_law(static_cast<double>(mean));
    const auto ours = law_of_words([=](std::uint32_t r) { return poisson_of_word(r, mean); }, exact.size());
    EXPECT_LT(kolmogorov_distance(ours, exact), 0x1p-32) << mean;  // of 2^32 words none can be split
  }
}

TEST(CountLaws, TheRoundedNormalHasTheSharesOfTheErrorFunction) {
  const float mean = 4;
  const auto law = law_of_words([=](std::uint32_t r) { return rounded_normal_count(mean, normal_of_word(r)); }, 12);
  for (std::size_t k = 0; k < law.size(); ++k) {
    const double z = (static_cast<double>(k) + 0.5 - 4) / 2;
    EXPECT_NEAR(law[k], 0.5 * std::erfc(-z / std::numbers::sqrt2), 2e-6);  // deviates are good to 1e-6
  }
}

TEST(CountLaws, KolmogorovsDistanceIsTheLargestStepApart) {
  const auto one = poisson_law(1), two = poisson_law(2);
  EXPECT_EQ(kolmogorov_distance(one, one), 0);
  EXPECT_NEAR(kolmogorov_distance(one, two), 2 * std::exp(-1.0) - 3 * std::exp(-2.0), 1e-14);  // at k = 1
  const std::vector<double> coin{0.5, 1};
  EXPECT_DOUBLE_EQ(kolmogorov_distance(std::vector<float>{1, 0}, coin), 0);
  EXPECT_DOUBLE_EQ(kolmogorov_distance(std::vector<float>{0, 0, 0, 1}, coin), 0.25);
  EXPECT_DOUBLE_EQ(kolmogorov_distance(std::vector<float>{0.5F, 0.5F}, coin), 0.5);    // none at 0, all below 1
  EXPECT_DOUBLE_EQ(kolmogorov_distance(std::vector<float>{-1, 0, 1, 1}, coin), 0.25);  // below 0 the law has nothing
  EXPECT_DOUBLE_EQ(kolmogorov_distance(std::vector<float>{7, 7}, coin), 1);
  EXPECT_NEAR(kolmogorov_limit(10'000), 0.0217, 1e-4);
}

}  // namespace
}  // namespace lowlux::isp
