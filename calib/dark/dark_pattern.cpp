#include "calib/dark/dark_pattern.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace lowlux::calib {
namespace {

constexpr double stands_out = 5;  // standard deviations
constexpr double min_deviation_dn = 1e-3;
constexpr double rows_fraction = 0.25;  // of the allowed noise, at most

struct Lines {
  std::vector<double> sum, n;
  explicit Lines(int count) : sum(static_cast<std::size_t>(count)), n(sum) {}
  double deviation(int i, double mean) const { return n[i] > 0 ? sum[i] / n[i] - mean : 0; }
  /// Returns the mean square of the deviations, given the mean number of pixels in a line.
  double variance(double mean) const {
    double squares = 0, lines = 0;
    for (std::size_t i = 0; i < n.size(); ++i) {
      if (n[i] == 0) continue;
      squares += std::pow(deviation(static_cast<int>(i), mean), 2);
      ++lines;
    }
    return lines > 1 ? squares / (lines - 1) : 0;
  }
  double pixels_in_line() const {
    double pixels = 0, lines = 0;
    for (const double count : n) pixels += count, lines += count > 0;
    return lines > 0 ? pixels / lines : 1;
  }
};

/// Decomposition of a site's pixels: mean, columns, rows, and the remainder.
struct Parts {
  double mean = 0;
  Lines columns, rows;
  double low_dn = 0, high_dn = 0;  // limits of outliers
  double variance = 0;             // variance of the remainder, in pixels that are not outliers
  double inside = 0;               // fraction of pixels that are not outliers
  bool is_inside(double dn) const { return dn >= low_dn && dn <= high_dn; }
  double rest(const Plane<float>& dn, int x, int y) const {
    return dn.at(x, y) - mean - columns.deviation(x, mean) - rows.deviation(y, mean);
  }
};

template <class Visit>
void for_each_of_site(const Plane<float>& dn, int site, const PixelMask& unknown, const Visit& visit) {
  for (int y = site >> 1; y < dn.height(); y += 2) {
    for (int x = site & 1; x < dn.width(); x += 2) {
      if (unknown.at(x, y) == 0) visit(x, y);
    }
  }
}

Parts take_apart(const Plane<float>& dn, int site, const PixelMask& unknown) {
  const SiteSpread spread = spread_of(dn, site, min_deviation_dn);
  const double cut = stands_out * std::max(spread.deviation, min_deviation_dn);
  Parts out{.columns = Lines(dn.width()), .rows = Lines(dn.height())};
  out.low_dn = spread.median - cut;
  out.high_dn = spread.median + cut;
  double sum = 0, n = 0, all = 0, squares = 0;
  for_each_of_site(dn, site, unknown, [&](int x, int y) {
    ++all;
    const double v = dn.at(x, y);
    if (!out.is_inside(v)) return;
    ++n, sum += v;
    out.columns.sum[x] += v, ++out.columns.n[x];
    out.rows.sum[y] += v, ++out.rows.n[y];
  });
  if (n == 0) return out;
  out.mean = sum / n;
  for_each_of_site(dn, site, unknown, [&](int x, int y) {
    if (out.is_inside(dn.at(x, y))) squares += std::pow(out.rest(dn, x, y), 2);
  });
  out.variance = squares / n;
  out.inside = n / all;
  return out;
}

double wiener(double pattern, double noise) { return pattern > 0 ? pattern / (pattern + std::max(noise, 0.0)) : 0; }

}  // namespace

KeptPattern limit_noise(Plane<float>& dn, int site, const DarkNoise& noise, double share, const PixelMask& unknown) {
  const double allowed = share * noise.picture_dn2;
  const Parts parts = take_apart(dn, site, unknown);
  if (noise.estimate_dn2 <= allowed) return {parts.mean, noise.estimate_dn2, 1};
  const double white = std::max(0.0, noise.estimate_dn2 - noise.rows_dn2);
  const double column_noise = white / parts.columns.pixels_in_line();
  const double row_noise = white / parts.rows.pixels_in_line() + noise.rows_dn2;
  const double of_columns = wiener(parts.columns.variance(parts.mean) - column_noise, column_noise);
  double of_rows = 0;
  if (noise.rows_known) {
    of_rows = std::min(wiener(parts.rows.variance(parts.mean) - row_noise, row_noise),
                       std::sqrt(rows_fraction * allowed / row_noise));
  }
  const double out = 1 - parts.inside;
  const double lines = of_columns * of_columns * column_noise + of_rows * of_rows * row_noise;
  const double left = std::max(0.0, allowed - lines - out * noise.estimate_dn2);
  const double of_pixels = std::min(wiener(parts.variance - white, white), std::sqrt(left / (parts.inside * white)));
  const double cut = stands_out * std::sqrt(parts.variance);
  for_each_of_site(dn, site, unknown, [&](int x, int y) {
    const double rest = parts.rest(dn, x, y);
    // Pixels that are not in the mean are not moved to it: where few pixels hold an electron these are its charge.
    if (std::fabs(rest) > cut || !parts.is_inside(dn.at(x, y))) return;
    dn.at(x, y) = static_cast<float>(parts.mean + of_columns * parts.columns.deviation(x, parts.mean) +
                                     of_rows * parts.rows.deviation(y, parts.mean) + of_pixels * rest);
  });
  return {parts.mean, lines + parts.inside * of_pixels * of_pixels * white + out * noise.estimate_dn2, of_pixels};
}

}  // namespace lowlux::calib
