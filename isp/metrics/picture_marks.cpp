#include "isp/metrics/picture_marks.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace lowlux::isp {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Returns squares of the distances from the marked pixels, as far as ring_far_px + 1.
Plane<float> squared_distances(const PlaneView<const float>& mask) {
  constexpr int reach = ring_far_px + 1;
  Plane<float> out(mask.width, mask.height);
  std::fill_n(out.data(), out.size(), static_cast<float>(reach * reach));
  const auto is_marked = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < mask.width && y < mask.height && mask.at(x, y) != 0;
  };
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (!is_marked(x, y)) continue;
      out.at(x, y) = 0;
      if (is_marked(x - 1, y) && is_marked(x + 1, y) && is_marked(x, y - 1) && is_marked(x, y + 1)) continue;
      for (int j = std::max(0, y - reach); j <= std::min(mask.height - 1, y + reach); ++j) {
        for (int i = std::max(0, x - reach); i <= std::min(mask.width - 1, x + reach); ++i) {
          const auto r2 = static_cast<float>((i - x) * (i - x) + (j - y) * (j - y));
          out.at(i, j) = std::min(out.at(i, j), r2);
        }
      }
    }
  }
  return out;
}

struct Sums {
  double squares = 0;
  double sum = 0;
  double count = 0;
  void add(double value) {
    squares += value * value;
    sum += value;
    count += 1;
  }
  double rms() const { return count > 0 ? std::sqrt(squares / count) : nan; }
};

/// Returns n sum (m_ij - m)^2 over the classes of a period.
double squares_between(const PlaneView<const float>& plane, int period_px, double mean) {
  const auto period = static_cast<std::size_t>(period_px);
  std::vector<double> sum(period * period);
  for (int y = 0; y < plane.height; ++y) {
    for (int x = 0; x < plane.width; ++x) {
      const auto column = static_cast<std::size_t>(x % period_px), row = static_cast<std::size_t>(y % period_px);
      sum[row * period + column] += static_cast<double>(plane.at(x, y)) - mean;
    }
  }
  const double pixels = 1.0 * plane.width * plane.height / static_cast<double>(sum.size());
  double out = 0;
  for (const double s : sum) out += s * s / pixels;
  return out;
}

}  // namespace

PeriodicLines periodic_lines(const PlaneView<const float>& plane, int period_px, int without_px) {
  const int width = plane.width / period_px * period_px, height = plane.height / period_px * period_px;
  assert(period_px >= 2 && width >= 2 * period_px && height >= 2 * period_px && period_px % without_px == 0);
  const PlaneView<const float> whole = plane.crop(0, 0, width, height);
  double mean = 0, squares = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) mean += static_cast<double>(whole.at(x, y)) / (1.0 * width * height);
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) squares += std::pow(static_cast<double>(whole.at(x, y)) - mean, 2);
  }
  PeriodicLines out{.degrees_of_freedom = 1.0 * period_px * period_px - 1.0 * without_px * without_px};
  if (!(squares > 0)) return out;
  const double between =
      std::max(0.0, squares_between(whole, period_px, mean) - squares_between(whole, without_px, mean));
  out.absolute = std::sqrt(between / out.degrees_of_freedom);
  out.amplitude = out.absolute / std::sqrt(squares / (1.0 * width * height - 1));
  return out;
}

RingError ring_error(const PlaneView<const float>& error, const PlaneView<const float>& mask) {
  assert(error.width == mask.width && error.height == mask.height);
  const Plane<float> distances = squared_distances(mask);
  Sums ring, far;
  for (int y = 0; y < error.height; ++y) {
    for (int x = 0; x < error.width; ++x) {
      const float r2 = distances.at(x, y);
      const auto value = static_cast<double>(error.at(x, y));
      if (r2 >= ring_inner_px * ring_inner_px && r2 <= ring_outer_px * ring_outer_px) ring.add(value);
      if (r2 > ring_far_px * ring_far_px) far.add(value);
    }
  }
  return {
      .ring = ring.rms(), .far = far.rms(), .mean = ring.count > 0 ? ring.sum / ring.count : nan, .pixels = ring.count};
}

double bead_amplitude(const PlaneView<const float>& error) {
  Sums beads;
  for (int y = 1; y + 1 < error.height; ++y) {
    for (int x = 0; x < error.width; ++x) {
      const auto at = [&](int row) { return static_cast<double>(error.at(x, row)); };
      beads.add((at(y - 1) - 2 * at(y) + at(y + 1)) / 4);
    }
  }
  return beads.rms();
}

}  // namespace lowlux::isp
