#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

#include "isp/base/random/exact_draw.h"
#include "isp/base/random/random.h"
#include "isp/base/random/random_rows.h"
#include "tests/reference/poisson_ref.h"

namespace lowlux {
namespace {

struct Pairs {
  std::vector<std::uint32_t> r;
  std::vector<float> mean;

  void add(std::uint32_t word, float lambda) {
    r.push_back(word);
    mean.push_back(lambda);
  }
  std::vector<float> counts() const {
    std::vector<float> out(r.size());
    draws::poisson_of_words(r.data(), mean.data(), r.size(), out.data());
    return out;
  }
};

/// A quarter of the words are in the tails: one in eight shifted right by 0..31, one in eight the complement of that.
std::uint32_t word_with_tails(std::mt19937_64& random) {
  const auto kind = static_cast<std::uint32_t>(random() % 8), r = static_cast<std::uint32_t>(random());
  if (kind > 1) return r;
  const std::uint32_t small = r >> (random() % 32);
  return kind == 0 ? small : ~small;
}

Pairs pairs(std::size_t count, double least, double most, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> log_mean(std::log(least), std::log(most));
  Pairs out;
  for (std::size_t i = 0; i < count; ++i) {
    out.add(word_with_tails(random), static_cast<float>(std::exp(log_mean(random))));
  }
  return out;
}

/// How many counts are not those of the reference; the first few are printed.
std::size_t mismatches(const Pairs& in) {
  const std::vector<float> counts = in.counts();
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double expected = reference::poisson_count(in.r[i], in.mean[i]);
    if (counts[i] == expected) continue;
    if (++wrong <= 5) {
      ADD_FAILURE() << "r " << in.r[i] << " mean " << in.mean[i] << ": " << counts[i] << " for " << expected;
    }
  }
  return wrong;
}

bool nightly() { return std::getenv("LOWLUX_NIGHTLY") != nullptr; }

TEST(Poisson, IsTheSmallestCountWhoseCdfReachesTheWord) {
  EXPECT_EQ(mismatches(pairs(nightly() ? 20'000'000 : 1'000'000, 1e-3, 1e5, 1)), 0U);
}

TEST(Poisson, IsExactAroundTheChangeOfMethod) {
  Pairs in = pairs(nightly() ? 4'000'000 : 200'000, 8, 16, 2);
  std::mt19937_64 random(3);
  for (const float mean : {std::nextafter(12.0f, 0.0f), 12.0f, std::nextafter(12.0f, 13.0f)}) {
    for (int i = 0; i < 20'000; ++i) in.add(word_with_tails(random), mean);
  }
  EXPECT_EQ(mismatches(in), 0U);
}

TEST(Poisson, IsExactFromVanishingToTheLargestMeans) {
  EXPECT_EQ(mismatches(pairs(20'000, 1e-12, 1e-3, 4)), 0U);
  EXPECT_EQ(mismatches(pairs(20'000, 1e5, 1e6, 5)), 0U);
}

TEST(Poisson, OfExtremeWordsIsExactAndNotFarFromTheMean) {
  Pairs in;
  for (const float mean : {0.0f, -1.0f, 1e-30f, 1e-42f, std::numeric_limits<float>::quiet_NaN(), 1e-9f, 0.5f, 3.0f,
                           11.999999f, 12.0f, 100.0f, 1e4f, 999999.94f, 1e6f}) {
    for (const std::uint32_t r : {0U, 1U, 0x7fffffffU, 0x80000000U, 0xFFFFFFFEU, 0xFFFFFFFFU}) in.add(r, mean);
  }
  const std::vector<float> counts = in.counts();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double mean = in.mean[i] > 0 ? in.mean[i] : 0.0;
    EXPECT_EQ(counts[i], reference::poisson_count(in.r[i], mean)) << "r " << in.r[i] << " mean " << mean;
    EXPECT_LE(counts[i], mean + 7 * std::sqrt(mean) + 15) << "r " << in.r[i] << " mean " << mean;
  }
}

TEST(Poisson, IsExactWhereTheCdfIsCloserToTheWordThanDoubleSeparatesNearOne) {
  // 1 - F(14340) is 1 - u and 7.5e-8 of it, which is 2.6e-17: found among 2e7 random pairs.
  constexpr std::uint32_t r = 0xFFFFFFFE;
  constexpr float mean = 13614.8427734375f;
  EXPECT_EQ(reference::poisson_count(r, mean), 14341);
  EXPECT_EQ(poisson_of_word(r, mean), 14341);
}

TEST(Poisson, InDoubleIsTheQuantileByItself) {
  const Pairs in = pairs(100'000, 1e-6, 1e6, 6);
  for (std::size_t i = 0; i < in.r.size(); ++i) {
    ASSERT_EQ(exact_poisson(in.r[i], in.mean[i]), reference::poisson_count(in.r[i], in.mean[i]))
        << "r " << in.r[i] << " mean " << in.mean[i];
  }
}

TEST(Poisson, ReferenceAgreesWithTheIncompleteGammaFunction) {
  // F(k; mean) = Q(k + 1, mean). Q of Boost is good to 1e-12 here; words are 2e-10 apart.
  constexpr double tolerance = 1e-12;
  const Pairs in = pairs(20'000, 1e-3, 1e6, 7);
  for (std::size_t i = 0; i < in.r.size(); ++i) {
    const double u = reference::probability_of_word(in.r[i]), mean = in.mean[i];
    const double k = reference::poisson_count(in.r[i], mean);
    ASSERT_GE(boost::math::gamma_q(k + 1, mean), u - tolerance);
    if (k > 0) {
      ASSERT_LT(boost::math::gamma_q(k, mean), u + tolerance);
    }
  }
}

TEST(Poisson, NeverFallsWhenTheMeanRises) {
  std::mt19937_64 random(8);
  const Pairs lower = pairs(400'000, 1e-3, 1e6, 9);
  Pairs higher = lower;
  std::uniform_real_distribution<float> log_step(-17, 1);
  for (float& mean : higher.mean) mean += std::max(mean * std::exp(log_step(random)), 1e-8f);
  const std::vector<float> few = lower.counts(), many = higher.counts();
  for (std::size_t i = 0; i < few.size(); ++i) {
    ASSERT_LE(few[i], many[i]) << "r " << lower.r[i] << " means " << lower.mean[i] << ", " << higher.mean[i];
  }
}

TEST(Poisson, NeverFallsWhenTheWordRises) {
  std::mt19937_64 random(10);
  const Pairs lower = pairs(400'000, 1e-3, 1e6, 11);
  Pairs higher = lower;
  for (std::uint32_t& r : higher.r) {
    const auto step = static_cast<std::uint32_t>(random()) >> (random() % 32);
    r = step > ~r ? ~0U : r + step;
  }
  const std::vector<float> few = lower.counts(), many = higher.counts();
  for (std::size_t i = 0; i < few.size(); ++i) {
    ASSERT_LE(few[i], many[i]) << "words " << lower.r[i] << ", " << higher.r[i] << " mean " << lower.mean[i];
  }
}

TEST(Poisson, NeverFallsAlongNeighbouringMeansAcrossTheChangeOfMethod) {
  for (const std::uint32_t r : {0U, 77U, 0x1000000U, 0x70000000U, 0x9abcdef0U, 0xF0000000U, 0xFFFFFF00U, 0xFFFFFFFFU}) {
    float mean = 11.9999f, before = 0;
    for (; mean < 12.0001f; mean = std::nextafter(mean, 13.0f)) {
      const float count = poisson_of_word(r, mean);
      ASSERT_GE(count, before) << "r " << r << " mean " << mean;
      before = count;
    }
  }
}

}  // namespace
}  // namespace lowlux
