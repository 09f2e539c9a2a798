#include "denoise/line_groups.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>

#include "denoise/line_rows.h"

namespace lowlux::denoise {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Sums of the finite pixels of one group of one line, and their number.
struct GroupSum {
  double sum = 0;
  double number = 0;
};

GroupSum every_second(const float* pixels, int first, int last) {
  constexpr int at_once = 8;  // sums that do not wait for each other
  std::array<double, at_once> sum{}, number{};
  const auto add = [&](int from, int count) {
    for (int k = 0; k < count; ++k) {
      const float pixel = pixels[from + 2 * k];
      const bool finite = std::isfinite(pixel);
      sum[k] += finite ? static_cast<double>(pixel) : 0;
      number[k] += finite ? 1 : 0;
    }
  };
  int i = first;
  for (; i + 2 * at_once <= last + 1; i += 2 * at_once) add(i, at_once);
  add(i, (last - i + 1) / 2);
  return {std::accumulate(sum.begin(), sum.end(), 0.0), std::accumulate(number.begin(), number.end(), 0.0)};
}

/// First pixel of each segment of a line, and the end of the last.
std::array<int, segments + 1> edges_of(int length) {
  const int pairs = (length + 1) / 2;
  std::array<int, segments + 1> edge{};
  for (int s = 0; s <= segments; ++s) {
    const auto before = (static_cast<long long>(s) * pairs + segments - 1) / segments;
    edge[static_cast<std::size_t>(s)] = std::min(2 * static_cast<int>(before), length);
  }
  return edge;
}

void sum_rows(PlaneView<const float> pixels, Plane<double>& sum, Plane<double>& number) {
  const auto edge = edges_of(pixels.width);
  for (int y = 0; y < pixels.height; ++y) {
    for (int g = 0; g < groups; ++g) {
      const auto s = static_cast<std::size_t>(g / 2);
      const GroupSum of = every_second(pixels.row(y), edge[s] + g % 2, edge[s + 1]);
      sum.at(y, g) = of.sum;
      number.at(y, g) = of.number;
    }
  }
}

void sum_columns(PlaneView<const float> pixels, Plane<double>& sum, Plane<double>& number) {
  const auto edge = edges_of(pixels.height);
  for (int s = 0; s < segments; ++s) {
    for (int y = edge[static_cast<std::size_t>(s)]; y < edge[static_cast<std::size_t>(s) + 1]; ++y) {
      const float* const row = pixels.row(y);
      double *const sums = sum.row(2 * s + y % 2), *const numbers = number.row(2 * s + y % 2);
      for (int x = 0; x < pixels.width; ++x) {
        const bool finite = std::isfinite(row[x]);
        sums[x] += finite ? static_cast<double>(row[x]) : 0;
        numbers[x] += finite ? 1 : 0;
      }
    }
  }
}

double median_difference(const Plane<double>& means, int line, int other) {
  std::array<double, groups> by_group{};
  for (int g = 0; g < groups; ++g) by_group[static_cast<std::size_t>(g)] = means.at(line, g) - means.at(other, g);
  return median_of(by_group);
}

bool all_finite(const Plane<double>& means) {
  return std::all_of(means.data(), means.data() + means.size(), [](double v) { return std::isfinite(v); });
}

}  // namespace

double median_of(std::span<double> values) {
  const auto infinite = std::partition(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  const auto count = infinite - values.begin();
  if (count == 0) return nan;
  const auto middle = values.begin() + count / 2;
  std::nth_element(values.begin(), middle, infinite);
  if (count % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

Plane<double> group_means(PlaneView<const float> pixels, Lines lines) {
  const int count = lines == Lines::rows ? pixels.height : pixels.width;
  Plane<double> sum(count, groups), number(count, groups);
  std::fill_n(sum.data(), sum.size(), 0.0);
  std::fill_n(number.data(), number.size(), 0.0);
  // Row by row for columns too, as memory lies; each group's sum has the same order either way.
  (lines == Lines::rows ? sum_rows : sum_columns)(pixels, sum, number);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    sum.data()[i] = number.data()[i] > 0 ? sum.data()[i] / number.data()[i] : nan;
  }
  return sum;
}

std::vector<double> differences(const Plane<double>& means, int distance) {
  assert(distance > 0 && means.height() == groups);
  const int count = std::max(means.width() - distance, 0);
  std::vector<double> out(static_cast<std::size_t>(count));
  int line = 0;
  if (all_finite(means)) line = rows::median_differences(means.data(), means.width(), distance, count, out.data());
  for (; line < count; ++line) out[line] = median_difference(means, line + distance, line);
  return out;
}

}  // namespace lowlux::denoise
