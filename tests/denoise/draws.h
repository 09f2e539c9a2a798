#pragma once

#include <cmath>
#include <cstdint>

#include "isp/base/matrix3.h"
#include "isp/base/random/random.h"

namespace lowlux::test {

/// Running mean of a figure and the standard error of it.
struct MeanOf {
  double sum = 0, squares = 0, count = 0;
  void add(double value) {
    sum += value;
    squares += value * value;
    ++count;
  }
  double mean() const { return sum / count; }
  double variance() const { return (squares - sum * sum / count) / (count - 1); }
  double standard_error() const { return std::sqrt(variance() / count); }
};

/// Poisson(mean) + Normal(0, noise^2), the draw (x, y) of a stream.
inline double noisy_charge_e(std::uint32_t seed, std::uint32_t x, std::uint32_t y, double mean_e, double noise_std_e) {
  const PhiloxWords words = words_at({.seed = seed}, x, y);
  return poisson_of_word(words[0], static_cast<float>(mean_e)) + noise_std_e * normal_of_word(words[1]);
}

/// The camera and the colours for which the published figures of chromaticity noise hold.
inline constexpr Matrix3 table_camera{{{1.2032, 0.2157, 0.1624}, {0.4179, 0.9182, -0.2211}, {0.0533, -0.3260, 2.2189}}};
inline constexpr Vector3 table_neutral{0.734, 1.394, 0.872}, table_red{1.741, 0.877, 0.383},
    table_blue{0.450, 1.023, 1.527};

}  // namespace lowlux::test
