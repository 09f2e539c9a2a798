// The counts equal the CDF (poisson_test.cpp), so that these are tests of the words, and of the CDF. Seeds are fixed:
// what passes once passes always.
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <span>
#include <vector>

#include "isp/base/random/random.h"
#include "tests/reference/poisson_ref.h"

namespace lowlux {
namespace {

constexpr std::uint32_t width = 2000, height = 2000;
constexpr double samples = static_cast<double>(width) * height;

const std::vector<float> means{1e-3f,  1e-2f, 0.1f,  0.5f,    1.0f, 3.0f, 7.3f,
                               11.99f, 12.0f, 20.5f, 100.25f, 1e3f, 1e4f, 1e5f};

/// Counts[k - first] of 4 million draws.
struct Histogram {
  int first;
  std::vector<double> counts;
};

Histogram histogram_of(float mean, std::uint64_t seed) {
  const double reach = 8 * std::sqrt(mean) + 16;  // no draw is further than 6.4 sigma, with its skewness
  Histogram out{std::max(0, static_cast<int>(mean - reach)), {}};
  const int counts = static_cast<int>(mean + reach) - out.first + 1;
  out.counts.resize(static_cast<std::size_t>(counts));
  const std::vector<float> row_means(width, mean);
  std::vector<float> row(width);
  for (std::uint32_t y = 0; y < height; ++y) {
    poisson_row({.seed = seed}, 0, y, row_means, row);
    for (const float count : row) out.counts.at(static_cast<std::size_t>(static_cast<int>(count) - out.first)) += 1;
  }
  return out;
}

struct Moments {
  double mean;
  double variance;
};

Moments moments_of(const Histogram& h, double about) {
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < h.counts.size(); ++i) {
    const double d = static_cast<double>(h.first) + static_cast<double>(i) - about;
    sum += h.counts[i] * d;
    squares += h.counts[i] * d * d;
  }
  const double shift = sum / samples;
  return {about + shift, (squares - samples * shift * shift) / (samples - 1)};
}

/// Upper tail probability of Pearson's chi-square of a histogram against the Poisson law, neighbouring cells pooled to
/// expectations of at least 10.
double p_value(const Histogram& h, double mean) {
  struct Cell {
    double expected = 0;
    double observed = 0;
  };
  std::vector<Cell> cells(1);
  double still_expected = samples;
  for (std::size_t i = 0; i < h.counts.size(); ++i) {
    if (cells.back().expected >= 10 && still_expected >= 10) cells.emplace_back();
    const double here = samples * reference::poisson_probability(h.first + static_cast<double>(i), mean);
    still_expected -= here;
    cells.back().expected += here;
    cells.back().observed += h.counts[i];
  }
  double chi2 = 0;
  for (const Cell& cell : cells) chi2 += std::pow(cell.observed - cell.expected, 2) / cell.expected;
  return boost::math::gamma_q(0.5 * static_cast<double>(cells.size() - 1), 0.5 * chi2);
}

TEST(PoissonStatistics, MeanAndVarianceAreTheMeanAndTheLawIsPoissons) {
  int upper_half = 0;
  for (std::size_t i = 0; i < means.size(); ++i) {
    const double lambda = means[i];
    const Histogram h = histogram_of(means[i], 1000 + i);
    const Moments m = moments_of(h, std::round(lambda));
    EXPECT_LT(std::abs(m.mean - lambda), 4 * std::sqrt(lambda / samples)) << lambda << ": standard errors";
    EXPECT_LT(std::abs(m.variance / lambda - 1), 4 * std::sqrt((2 + 1 / lambda) / samples)) << lambda;
    const double p = p_value(h, lambda);
    EXPECT_GT(p, 1e-4) << lambda;
    upper_half += p > 0.5;
  }
  EXPECT_GT(upper_half, 0) << "of " << means.size();
  EXPECT_LT(upper_half, static_cast<int>(means.size()));
}

/// Rows of normal deviates of one frame.
std::vector<float> plane_of_normals(std::uint32_t frame, std::uint32_t purpose, int word) {
  std::vector<float> plane(static_cast<std::size_t>(width) * height);
  for (std::uint32_t y = 0; y < height; ++y) {
    normal_row({.seed = 5, .frame = frame, .purpose = purpose}, 0, y, word, std::span(plane).subspan(y * width, width));
  }
  return plane;
}

/// Correlation of a plane with another moved on by `shift` samples. Mean 0 and variance 1 are known.
double correlation(const std::vector<float>& a, const std::vector<float>& b, std::size_t shift) {
  double sum = 0;
  for (std::size_t i = 0; i + shift < a.size(); ++i)
    sum += static_cast<double>(a[i]) * static_cast<double>(b[i + shift]);
  return sum / static_cast<double>(a.size() - shift);
}

TEST(PoissonStatistics, NeighboursFramesPurposesAndWordsAreNotCorrelated) {
  const double limit = 4 / std::sqrt(samples);  // standard errors
  const std::vector<float> plane = plane_of_normals(1, draw_purpose::electrons, 0);
  EXPECT_LT(std::abs(correlation(plane, plane, 1)), limit) << "in x";
  EXPECT_LT(std::abs(correlation(plane, plane, width)), limit) << "in y";
  EXPECT_LT(std::abs(correlation(plane, plane_of_normals(2, draw_purpose::electrons, 0), 0)), limit) << "in time";
  EXPECT_LT(std::abs(correlation(plane, plane_of_normals(1, draw_purpose::scene, 0), 0)), limit) << "purposes";
  for (const int word : {1, 2, 3}) {
    EXPECT_LT(std::abs(correlation(plane, plane_of_normals(1, draw_purpose::electrons, word), 0)), limit) << word;
  }
}

}  // namespace
}  // namespace lowlux
