// What has to hold on every processor and compiler, and so is run on Arm too (scripts/cross-aarch64).
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/base/random/random.h"
#include "isp/base/random/random_rows.h"
#include "tests/support/draw_bits.h"

namespace lowlux::random_bits_test {
namespace {

constexpr DrawStream stream{.seed = 0x0123456789abcdef, .frame = 3, .purpose = draw_purpose::electrons};
constexpr std::size_t width = 1003;

std::vector<float> poisson(std::uint32_t x0, std::uint32_t y, std::span<const float> mean) {
  std::vector<float> counts(mean.size());
  poisson_row(stream, x0, y, mean, counts);
  return counts;
}

std::vector<float> normals(std::uint32_t x0, std::uint32_t y, std::size_t size) {
  std::vector<float> deviates(size);
  normal_row(stream, x0, y, 1, deviates);
  return deviates;
}

TEST(RandomBits, PoissonCountsHaveThisHashOnEveryMachine) {
  std::uint64_t hash = test::hash_of<float>({});
  for (std::uint32_t y = 0; y < 200; ++y) {
    hash = test::hash_of<float>(poisson(5, y, test::scattered_means(y, width)), hash);
  }
  EXPECT_EQ(hash, 1519117368029416330ULL);
}

TEST(RandomBits, NormalDeviatesHaveThisHashOnEveryMachine) {
  std::uint64_t hash = test::hash_of<float>({});
  for (std::uint32_t y = 0; y < 200; ++y) hash = test::hash_of<float>(normals(5, y, width), hash);
  EXPECT_EQ(hash, 16439677379979714783ULL);
}

TEST(RandomBits, ProductsAreRoundedBeforeTheyAreAddedTo) { EXPECT_TRUE(draws::products_are_rounded()); }

TEST(RandomBits, ARowInPiecesIsTheRow) {
  const std::vector<float> mean = test::scattered_means(1, width);
  const std::vector<float> counts = poisson(11, 1, mean), deviates = normals(11, 1, width);
  for (const std::size_t piece : {1U, 7U, 16U, 64U, 333U}) {
    for (std::size_t i = 0; i < width; i += piece) {
      const std::size_t size = std::min(piece, width - i);
      const auto x0 = static_cast<std::uint32_t>(11 + i);
      const std::vector<float> some = poisson(x0, 1, std::span(mean).subspan(i, size)), z = normals(x0, 1, size);
      ASSERT_TRUE(std::equal(some.begin(), some.end(), counts.begin() + static_cast<std::ptrdiff_t>(i))) << piece;
      ASSERT_TRUE(std::equal(z.begin(), z.end(), deviates.begin() + static_cast<std::ptrdiff_t>(i))) << piece;
    }
  }
}

TEST(RandomBits, ThreadsDoNotChangeAPlane) {
  const std::vector<float> mean = test::scattered_means(2, width);
  const auto plane_with = [&](int threads) {
    Plane<float> counts(width, 41);
    PoolExecutor pool(threads);
    for_each_band(pool, 41, [&](RowBand band, int) {
      for (int y = band.first; y < band.last; ++y) {
        poisson_row(stream, 0, static_cast<std::uint32_t>(y), mean, std::span(counts.row(y), width));
      }
    });
    std::uint64_t hash = test::hash_of<float>({});
    for (int y = 0; y < 41; ++y) hash = test::hash_of<float>(std::span<const float>(counts.row(y), width), hash);
    return hash;
  };
  for (const int threads : {2, 3, 7}) EXPECT_EQ(plane_with(threads), plane_with(1)) << threads;
}

TEST(RandomBits, OneWordGivesWhatTheRowGives) {
  const std::vector<float> mean = test::scattered_means(4, width);
  const std::vector<float> counts = poisson(0, 4, mean), deviates = normals(0, 4, width);
  for (std::uint32_t x = 0; x < width; ++x) {
    const PhiloxWords words = words_at(stream, x, 4);
    ASSERT_EQ(poisson_of_word(words[0], mean[x]), counts[x]);
    ASSERT_EQ(normal_of_word(words[1]), deviates[x]);
  }
}

TEST(RandomBits, CountsMayReplaceTheirMeans) {
  std::vector<float> memory = test::scattered_means(5, width);
  const std::vector<float> counts = poisson(0, 5, memory);
  poisson_row(stream, 0, 5, memory, memory);
  EXPECT_EQ(memory, counts);
}

TEST(RandomBits, NothingIsWrittenBesideTheRow) {
  for (std::size_t size = 0; size <= 40; ++size) {
    std::vector<float> memory(size + 2, -7), mean(size, 30);
    poisson_row(stream, 0, 0, mean, std::span(memory).subspan(1, size));
    ASSERT_TRUE(memory.front() == -7 && memory.back() == -7) << size;
    normal_row(stream, 0, 0, 0, std::span(memory).subspan(1, size));
    ASSERT_TRUE(memory.front() == -7 && memory.back() == -7) << size;
  }
}

TEST(RandomBits, MeansThatAreNoneGiveNothing) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  for (const std::uint32_t r : {0U, 1U, 0x7fffffffU, 0x80000000U, 0xFFFFFFFEU, 0xFFFFFFFFU}) {
    for (const float mean : {0.0f, -0.0f, -1.0f, -1e30f, -infinite, nan, -nan, 1e-30f, 1e-42f}) {
      const float count = poisson_of_word(r, mean);
      EXPECT_EQ(test::hash_of<float>(std::span(&count, 1)), test::hash_of<float>(std::vector<float>{0.0f}))
          << "r " << r << " mean " << mean << ": a zero without sign";
    }
    // A mean beside it that is none must not disturb a lane.
    const std::vector<std::uint32_t> words(9, r);
    const std::vector<float> means{nan, 20, nan, 3, -1, infinite, 12, 0, 1e6f};
    std::vector<float> counts(9);
    draws::poisson_of_words(words.data(), means.data(), 9, counts.data());
    for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(counts[i], poisson_of_word(r, means[i])) << "r " << r << " i " << i;
  }
}

TEST(RandomBits, MeansAboveTheLargestCountAsTheLargest) {
  for (const std::uint32_t r : {0U, 0x12345678U, 0xFFFFFFFFU}) {
    const float largest = poisson_of_word(r, poisson_max_mean);
    for (const float mean : {1.0001e6f, 1e30f, std::numeric_limits<float>::infinity()}) {
      EXPECT_EQ(poisson_of_word(r, mean), largest);
    }
  }
}

}  // namespace
}  // namespace lowlux::random_bits_test
