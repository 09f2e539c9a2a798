#include "isp/merge/block_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>

namespace lowlux::merge::rows {
namespace {

constexpr int side = 8, stride = side + 4;
constexpr std::size_t corner = 2 * stride + 2;

/// A block with two sites of the reference around it.
struct Block {
  std::array<float, static_cast<std::size_t>(stride) * stride> reference{};
  std::array<float, static_cast<std::size_t>(side) * side> frame{};

  double r(int x, int y) const {
    return static_cast<double>(reference[corner + static_cast<std::size_t>(y) * stride + x]);
  }
  double f(int x, int y) const { return static_cast<double>(frame[static_cast<std::size_t>(y) * side + x]); }
};

/// The same in double precision, site by site as compare_mosaics describes it.
struct Reference {
  double spread = 0, spread_variance = 0, count = 0;
  std::array<double, 4> d{}, v{}, fourth{};
  int outliers = 0;
  double closest = 1e9;  // least relative distance of a difference to the threshold of outliers
};

class BlockReference {
 public:
  BlockReference(const Block& block, const BlockNoise& noise, const BlockLimits& limits)
      : block_(block), noise_(noise), limits_(limits) {
    for (int site = 0; site < 4; ++site) measure(site);
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) add(x, y);
    }
  }
  const Reference& result() const { return out_; }

 private:
  double reference_variance(int site, double level) const {
    return static_cast<double>(noise_.reference_slope) * level + static_cast<double>(noise_.reference_offset[site]);
  }
  double frame_variance(int site, double level) const {
    return static_cast<double>(noise_.frame_slope) * level + static_cast<double>(noise_.frame_offset[site]);
  }
  double combined(double r, double f, int site, double level) const {
    double a = reference_variance(site, level), b = frame_variance(site, level);
    if (!(a + b > 0)) {
      a = static_cast<double>(noise_.reference_slope);
      b = static_cast<double>(noise_.frame_slope);
    }
    return (r * b + f * a) / (a + b);
  }

  void measure(int site) {
    double r = 0, f = 0, n = 0;
    for (int y = site >> 1; y < side; y += 2) {
      for (int x = site & 1; x < side; x += 2) {
        if (std::isnan(block_.r(x, y)) || std::isnan(block_.f(x, y))) continue;
        r += block_.r(x, y);
        f += block_.f(x, y);
        n += 1;
      }
    }
    mean_[site] = n > 0 ? combined(r / n, f / n, site, 0) : 0;
  }

  double square_to(int x, int y, int dx, int dy) const {
    const double d = block_.r(x + dx, y + dy) - block_.r(x, y);
    return std::isnan(d) ? 0 : d * d;
  }

  void add(int x, int y) {
    const double r = block_.r(x, y), f = block_.f(x, y), d = f - r;
    if (std::isnan(d)) return;
    const int site = 2 * (y & 1) + (x & 1);
    double mu = std::max(mean_[site], 0.0);
    const double a = reference_variance(site, mu), b = frame_variance(site, mu);
    const double own_variance = a + b > 0 ? a * b / (a + b) : 0;
    mu += std::max(combined(r, f, site, mu) - mu - 3 * std::sqrt(own_variance), 0.0);
    const double slopes = std::max(square_to(x, y, -2, 0), square_to(x, y, 2, 0)) +
                          std::max(square_to(x, y, 0, -2), square_to(x, y, 0, 2));
    const double detail = static_cast<double>(limits_.displacement_variance_px2) / 4 *
                          std::max(slopes - 8 * reference_variance(site, mu), 0.0);
    const double v = static_cast<double>(noise_.slope) * mu + static_cast<double>(noise_.offset[site]) + detail;
    if (!(v > 0)) return;
    const auto z = static_cast<double>(limits_.site_deviate);
    if (z > 0) {
      const double sigma = std::sqrt(v), skewness = static_cast<double>(noise_.third) * mu / (v * sigma);
      const double shift = (z * z - 1) * skewness / 6;
      const double above = (z + std::max(shift, 0.0)) * sigma, below = -(z - std::min(shift, 0.0)) * sigma;
      out_.closest = std::min({out_.closest, std::abs(d / above - 1), std::abs(d / below - 1)});
      if (d > above || d < below) {
        ++out_.outliers;
        return;
      }
    }
    const double fourth = static_cast<double>(noise_.fourth) * mu;
    out_.d[site] += d;
    out_.v[site] += v;
    out_.fourth[site] += fourth;
    out_.spread += d * d / v;
    out_.count += 1;
    out_.spread_variance += 2 + fourth / (v * v);
  }

  const Block& block_;
  const BlockNoise& noise_;
  const BlockLimits& limits_;
  std::array<double, 4> mean_{};
  Reference out_;
};

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : words_(seed) {}
  double uniform(double least, double most) { return std::uniform_real_distribution(least, most)(words_); }
  double log_uniform(double least, double most) { return std::exp(uniform(std::log(least), std::log(most))); }
  bool chance(double p) { return uniform(0, 1) < p; }
  double normal() { return std::normal_distribution()(words_); }

 private:
  std::mt19937_64 words_;
};

BlockNoise drawn_noise(Draw& draw) {
  BlockNoise out{};
  const double s = draw.chance(0.3) ? 1 : draw.log_uniform(0.01, 1),
               f = draw.chance(0.3) ? 1 : draw.log_uniform(0.1, 10);
  const bool noiseless = draw.chance(0.1);
  out.reference_slope = static_cast<float>(s);
  out.frame_slope = static_cast<float>(f);
  out.slope = static_cast<float>(s + f);
  out.third = static_cast<float>(f * f - s * s);
  out.fourth = static_cast<float>(s * s * s + f * f * f);
  for (int i = 0; i < 4; ++i) {
    const double variance = noiseless ? 0 : draw.log_uniform(0.1, 300);
    out.reference_offset[i] = static_cast<float>(s * variance);
    out.frame_offset[i] = static_cast<float>(f * variance);
    out.offset[i] = out.reference_offset[i] + out.frame_offset[i];
  }
  return out;
}

Block drawn_block(Draw& draw, const BlockNoise& noise) {
  Block out;
  const double level = draw.chance(0.1) ? 0 : draw.log_uniform(0.01, 1e5),
               contrast = draw.chance(0.5) ? 0 : draw.uniform(0, 1);
  const double missing = draw.chance(0.5) ? 0 : draw.uniform(0, 0.6), far = draw.chance(0.5) ? 0 : 0.05;
  for (int y = -2; y < side + 2; ++y) {
    for (int x = -2; x < side + 2; ++x) {
      const auto site = 2 * static_cast<std::size_t>(y & 1) + static_cast<std::size_t>(x & 1);
      const double mean = level * (1 + contrast * draw.uniform(-1, 1));
      const auto taken = [&](double slope, float offset) {
        if (draw.chance(missing)) return std::numeric_limits<float>::quiet_NaN();
        const double sigma = std::sqrt(slope * mean + static_cast<double>(offset));
        return static_cast<float>(mean + sigma * draw.normal() * (draw.chance(far) ? 8 : 1));
      };
      out.reference[static_cast<std::size_t>(y + 2) * stride + static_cast<std::size_t>(x + 2)] =
          taken(static_cast<double>(noise.reference_slope), noise.reference_offset[site]);
      if (x < 0 || y < 0 || x >= side || y >= side) continue;
      out.frame[static_cast<std::size_t>(y) * side + static_cast<std::size_t>(x)] =
          taken(static_cast<double>(noise.frame_slope), noise.frame_offset[site]);
    }
  }
  return out;
}

/// The rounding of 16 values that are added up, and of what they are computed from.
void expect_near(float found, double expected, double magnitude) {
  EXPECT_NEAR(static_cast<double>(found), expected, 1e-4 * std::abs(expected) + 4e-6 * magnitude);
}

TEST(BlockRows, AreThoseOfTheReferenceForDrawnBlocks) {
  int outliers = 0, blocks = 0;
  for (int i = 0; i < 3000; ++i) {
    SCOPED_TRACE(testing::Message() << "draw " << i);
    Draw draw(20261126 + static_cast<std::uint64_t>(i));
    const BlockNoise noise = drawn_noise(draw);
    const BlockLimits limits{draw.chance(0.5) ? 0 : static_cast<float>(draw.uniform(2, 5)),
                             draw.chance(0.5) ? 0 : static_cast<float>(draw.log_uniform(1e-4, 1))};
    Block block = drawn_block(draw, noise);
    const Reference expected = BlockReference(block, noise, limits).result();
    if (expected.closest < 1e-3) continue;  // a rounding decides
    ++blocks;
    double largest = 0;
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const double sum = std::abs(block.r(x, y)) + std::abs(block.f(x, y));
        if (!std::isnan(sum)) largest = std::max(largest, sum);
      }
    }
    const BlockSums found = add_block(block.reference.data() + corner, stride, block.frame.data(), side, noise, limits);
    EXPECT_EQ(found.outliers, expected.outliers);
    outliers += expected.outliers;
    EXPECT_EQ(static_cast<double>(found.count), expected.count);
    // A difference is that of two values, whose roundings V does not know.
    const double min_v = *std::ranges::min_element(noise.offset) + 1e-30;
    const double of_spread = expected.spread + largest * largest * 6e-8 / min_v * expected.count;
    expect_near(found.spread, expected.spread, 100 * of_spread);
    expect_near(found.spread_variance, expected.spread_variance, 0);
    for (std::size_t site = 0; site < 4; ++site) {
      expect_near(found.d[site], expected.d[site], 16 * largest);
      expect_near(found.v[site], expected.v[site], 0);
      expect_near(found.fourth[site], expected.fourth[site], 0);
    }
  }
  EXPECT_GT(blocks, 2500);
  EXPECT_GT(outliers, 500);
}

TEST(BlockRows, OutliersBecomeNaNInTheFrameAlone) {
  Block block;
  block.reference.fill(100);
  block.frame.fill(100);
  block.frame[11] = 400;
  block.frame[50] = -200;
  BlockNoise noise{.reference_slope = 1, .frame_slope = 1, .slope = 2, .third = 0, .fourth = 2};
  const BlockSums sums = add_block(block.reference.data() + corner, stride, block.frame.data(), side, noise, {4, 0});
  EXPECT_EQ(sums.outliers, 2);
  EXPECT_EQ(sums.count, 62);
  for (std::size_t i = 0; i < block.frame.size(); ++i) EXPECT_EQ(std::isnan(block.frame[i]), i == 11 || i == 50) << i;
  for (const float v : block.reference) EXPECT_EQ(v, 100);
}

}  // namespace
}  // namespace lowlux::merge::rows
