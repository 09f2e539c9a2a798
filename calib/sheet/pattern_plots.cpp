#include "calib/sheet/pattern_plots.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "isp/base/cfa.h"

namespace lowlux::calib {
namespace {

/// Discrete Fourier transform in place, Cooley and Tukey's of radix 2. The size is a power of two.
void transform(std::vector<std::complex<double>>& values) {
  const std::size_t n = values.size();
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n >> 1;
    for (; (j & bit) != 0; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(values[i], values[j]);
  }
  for (std::size_t size = 2; size <= n; size *= 2) {
    for (std::size_t k = 0; k < size / 2; ++k) {
      const auto turn = std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(size));
      for (std::size_t first = k; first < n; first += size) {
        const std::complex<double> low = values[first], high = values[first + size / 2] * turn;
        values[first] = low + high;
        values[first + size / 2] = low - high;
      }
    }
  }
}

}  // namespace

Plane<float> deviations_of(const DarkGroup& group) {
  const Plane<float>& mean = group.mean_dn;
  PerSite<double> sum{}, count{};
  for (int y = 0; y < mean.height(); ++y) {
    for (int x = 0; x < mean.width(); ++x) {
      const auto site = static_cast<std::size_t>(site_of(x, y));
      sum[site] += static_cast<double>(mean.at(x, y));
      ++count[site];
    }
  }
  Plane<float> out(mean.width(), mean.height());
  for (int y = 0; y < mean.height(); ++y) {
    for (int x = 0; x < mean.width(); ++x) {
      const auto site = static_cast<std::size_t>(site_of(x, y));
      out.at(x, y) = static_cast<float>(static_cast<double>(mean.at(x, y)) - sum[site] / count[site]);
    }
  }
  return out;
}

std::vector<double> spectrogram(const Plane<float>& deviations, Direction direction) {
  const bool rows = direction == Direction::along_rows;
  const int length = rows ? deviations.width() : deviations.height();
  const int lines = rows ? deviations.height() : deviations.width();
  const auto n = std::bit_floor(static_cast<std::size_t>(length));
  std::vector<double> power(n / 2 + 1);
  std::vector<std::complex<double>> values(n);
  for (int line = 0; line < lines; ++line) {
    for (std::size_t i = 0; i < n; ++i) {
      const int at = static_cast<int>(i);
      values[i] = static_cast<double>(rows ? deviations.at(at, line) : deviations.at(line, at));
    }
    transform(values);
    for (std::size_t k = 0; k < power.size(); ++k) power[k] += std::norm(values[k]) / static_cast<double>(n) / lines;
  }
  std::ranges::transform(power, power.begin(), [](double p) { return std::sqrt(p); });
  return power;
}

Histogram histogram_of(const Plane<float>& deviations, int bins) {
  assert(bins >= 1 && !deviations.empty());
  const auto [least, most] = std::minmax_element(deviations.data(), deviations.data() + deviations.size());
  const double low = *least, width = std::max((static_cast<double>(*most) - low) / bins, 1e-9);
  Histogram out{std::vector<double>(static_cast<std::size_t>(bins)),
                std::vector<double>(static_cast<std::size_t>(bins))};
  for (int i = 0; i < bins; ++i) out.centre[static_cast<std::size_t>(i)] = low + (i + 0.5) * width;
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    const int bin = static_cast<int>((static_cast<double>(deviations.data()[i]) - low) / width);
    ++out.count[static_cast<std::size_t>(std::clamp(bin, 0, bins - 1))];
  }
  return out;
}

}  // namespace lowlux::calib
