#include "calib/dark/dark_image.h"

#include <algorithm>
#include <cmath>

namespace lowlux::calib {
namespace {

constexpr double mad_to_deviation = 1.4826;  // of a normal distribution
constexpr double wide_cut = 6;

struct Sums {
  double n = 0, sum = 0, squares = 0;
  void add(double v) {
    ++n;
    sum += v;
    squares += v * v;
  }
  double mean() const { return sum / n; }
  double variance() const { return n > 1 ? std::max(0.0, (squares - sum * sum / n) / (n - 1)) : 0; }
};

double median_in_place(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Sums means_of(const std::vector<Sums>& lines) {
  Sums out;
  for (const Sums& line : lines) {
    if (line.n > 0) out.add(line.mean());
  }
  return out;
}

struct Change {
  double value = 0, error = 0;
};

// Fits a line by least squares; the error is from the scatter about the line.
Change change_over(const std::vector<Sums>& lines) {
  Sums positions;
  double products = 0, sum = 0;
  const auto at = [&](std::size_t i) { return static_cast<double>(i) / static_cast<double>(lines.size()); };
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].n == 0) continue;
    positions.add(at(i));
    products += at(i) * lines[i].mean();
    sum += lines[i].mean();
  }
  if (positions.n < 4) return {};
  const double spread = (positions.n - 1) * positions.variance();
  const double slope = (products - positions.mean() * sum) / spread;
  double residuals = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].n == 0) continue;
    const double off = lines[i].mean() - sum / positions.n - slope * (at(i) - positions.mean());
    residuals += off * off;
  }
  return {slope, std::sqrt(residuals / (positions.n - 2) / spread)};
}

}  // namespace

SiteSpread spread_of(const Plane<float>& values, int site, double smallest_deviation) {
  std::vector<float> own;
  own.reserve(values.size() / 4 + static_cast<std::size_t>(values.width() + values.height()));
  for (int y = site >> 1; y < values.height(); y += 2) {
    for (int x = site & 1; x < values.width(); x += 2) own.push_back(values.at(x, y));
  }
  const double median = median_in_place(own);
  std::vector<float> off(own);
  for (float& v : off) v = std::fabs(v - static_cast<float>(median));
  const double cut = wide_cut * std::max(mad_to_deviation * median_in_place(off), smallest_deviation);
  Sums inside;
  for (const float v : own) {
    if (std::fabs(v - median) <= cut) inside.add(v - median);
  }
  return {median, std::sqrt(inside.variance())};
}

ImageFigures figures_of(const WeightedImage& image, const PixelMask& mask, int site) {
  std::vector<Sums> rows(mask.height()), columns(mask.width());
  Sums all;
  ImageFigures out;
  double origin = 0;
  for (int y = site >> 1; y < mask.height(); y += 2) {
    for (int x = site & 1; x < mask.width(); x += 2) {
      if (mask.at(x, y) != 0) continue;
      double value = 0;
      for (std::size_t g = 0; g < image.groups.size(); ++g) {
        const DarkGroup& group = image.groups[g];
        value += image.weights[g] * group.mean_dn.at(x, y);
        out.temporal_variance += image.weights[g] * image.weights[g] * group.variance_dn2.at(x, y) / group.frames;
      }
      if (all.n == 0) origin = value;  // keeps the precision of squares
      all.add(value - origin);
      rows[y].add(value - origin);
      columns[x].add(value - origin);
    }
  }
  if (all.n < 2) return out;
  out.pixels = all.n;
  out.mean = origin + all.mean();
  out.variance = all.variance();
  out.temporal_variance /= all.n;
  const Sums row_means = means_of(rows), column_means = means_of(columns);
  const double white = out.variance / all.n;
  out.standard_error =
      std::sqrt(std::max(white, row_means.variance() / row_means.n + column_means.variance() / column_means.n - white));
  out.column_variance = column_means.variance() - out.variance * column_means.n / all.n;
  out.row_variance = row_means.variance() - out.variance * row_means.n / all.n;
  const Change across = change_over(columns), down = change_over(rows);
  out.change_x = across.value;
  out.error_x = across.error;
  out.change_y = down.value;
  out.error_y = down.error;
  return out;
}

}  // namespace lowlux::calib
