#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/plane.h"
#include "isp/base/random/random.h"
#include "tests/support/frame_sizes.h"

/// These frames of any size have noise-free values that are known everywhere, and are made fast enough for 150
/// megapixels: a neutral ramp.
namespace lowlux::test {

/// Holds the mean electrons of each site, and their noise.
struct Ramp {
  FrameSize size;
  BayerPhase phase = BayerPhase::rggb;
  double read_noise_e = 2;

  /// States the sensor's response to neutral light.
  static constexpr std::array<double, 3> neutral{0.5, 1, 0.625};

  double mean_e(int x, int y) const {
    return neutral[static_cast<std::size_t>(colour_at(phase, x, y))] * (column_e(x) + row_e(y));
  }
  /// A green site's mean is the sum of its column's and its row's.
  double column_e(int x) const { return 50 + 100 * (x + 0.5) / std::max(size.width, 1000); }
  double row_e(int y) const { return 50 * (y + 0.5) / std::max(size.height, 1000); }
  std::vector<double> columns_e() const {
    std::vector<double> out(static_cast<std::size_t>(size.width));
    for (int x = 0; x < size.width; ++x) out[static_cast<std::size_t>(x)] = column_e(x);
    return out;
  }
  double variance_e2(double mean) const { return mean + read_noise_e * read_noise_e; }

  /// The response of the sites of a row to neutral light, of even columns and of odd ones.
  std::array<double, 2> shares(int y) const {
    return {neutral[static_cast<std::size_t>(colour_at(phase, 0, y))],
            neutral[static_cast<std::size_t>(colour_at(phase, 1, y))]};
  }

  /// Returns codes of gain * (mean + noise) + black, rounded; the noise is normal, from a table traversed in an order
  /// that repeats in no row or column.
  Plane<std::uint16_t> codes(double gain_dn_per_e, double black_dn, std::uint64_t seed) const {
    std::vector<float> normal(65536);
    normal_row({.seed = seed}, 0, 0, 0, normal);
    Plane<std::uint16_t> out(size.width, size.height);
    std::uint32_t state = words_at({.seed = seed}, 0, 1)[0] | 1U;
    const std::vector<double> column = columns_e();
    for (int y = 0; y < size.height; ++y) {
      const std::array share = shares(y);
      const double down = row_e(y);
      std::uint16_t* const row = out.row(y);
      for (std::size_t x = 0; x < column.size(); ++x) {
        state = state * 1664525U + 1013904223U;
        const double mean = share[x % 2] * (column[x] + down);
        const double e = mean + std::sqrt(variance_e2(mean)) * static_cast<double>(normal[state >> 16]);
        row[x] = static_cast<std::uint16_t>(std::max(0.0, black_dn + gain_dn_per_e * e + 0.5));
      }
    }
    return out;
  }
};

/// Expects the means of values over squares of 32 x 32 sites, colour by colour, to be those of the ramp within 6.5
/// standard errors of the values before noise reduction: 1e-10 for one mean, of 3e5 in the largest frame.
/// @param value_e  gives the electrons of the site at column x and row y
/// @param added_e  additional error of a value, from its coding for example
template <class Value>
void expect_means_of(const Ramp& ramp, const Value& value_e, double added_e = 0) {
  constexpr int side = 32;
  int wrong = 0, all = 0;
  std::string first;
  const std::vector<double> column = ramp.columns_e();
  for (int top = 0; top < ramp.size.height; top += side) {
    for (int left = 0; left < ramp.size.width; left += side) {
      std::array<double, 3> sum{}, truth{}, count{};
      for (int y = top; y < std::min(top + side, ramp.size.height); ++y) {
        const std::array share = ramp.shares(y);
        const double down = ramp.row_e(y);
        for (int x = left; x < std::min(left + side, ramp.size.width); ++x) {
          const auto c = static_cast<std::size_t>(colour_at(ramp.phase, x, y));
          sum[c] += value_e(x, y);
          truth[c] += share[static_cast<std::size_t>(x % 2)] * (column[static_cast<std::size_t>(x)] + down);
          count[c] += 1;
        }
      }
      for (std::size_t c = 0; c < 3; ++c) {
        if (count[c] == 0) continue;
        const double mean = truth[c] / count[c], error = sum[c] / count[c] - mean;
        const double most = 6.5 * std::sqrt(ramp.variance_e2(mean) / count[c]) + added_e;
        ++all;
        if (std::abs(error) <= most) continue;
        if (wrong++ == 0) {
          first = "colour " + std::to_string(c) + " at " + std::to_string(left) + ", " + std::to_string(top) +
                  " is off by " + std::to_string(error) + " e-, " + std::to_string(most) + " e- are allowed";
        }
      }
    }
  }
  EXPECT_EQ(wrong, 0) << "of " << all << " means; " << first;
}

}  // namespace lowlux::test
