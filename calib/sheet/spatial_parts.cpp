#include "calib/sheet/spatial_parts.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace lowlux::calib {
namespace {

/// Pixels of one site of a plane.
struct SiteView {
  const Plane<float>& plane;
  int x0 = 0;
  int y0 = 0;

  int rows() const { return (plane.height() - y0 + 1) / 2; }
  int columns() const { return (plane.width() - x0 + 1) / 2; }
  double at(int column, int row) const { return plane.at(x0 + 2 * column, y0 + 2 * row); }
};

struct Means {
  double all = 0;
  std::vector<double> row;
  std::vector<double> column;
};

Means means_of(const SiteView& site) {
  Means out{0, std::vector<double>(static_cast<std::size_t>(site.rows())),
            std::vector<double>(static_cast<std::size_t>(site.columns()))};
  for (int y = 0; y < site.rows(); ++y) {
    for (int x = 0; x < site.columns(); ++x) {
      const double value = site.at(x, y);
      out.row[static_cast<std::size_t>(y)] += value / site.columns();
      out.column[static_cast<std::size_t>(x)] += value / site.rows();
    }
  }
  for (const double row : out.row) out.all += row / site.rows();
  return out;
}

/// Returns the sample variance of means, with the standard error of normal ones.
Estimate variance_of(const std::vector<double>& means, double mean) {
  double squares = 0;
  for (const double value : means) squares += (value - mean) * (value - mean);
  const double freedom = static_cast<double>(means.size()) - 1;
  return {squares / freedom, squares / freedom * std::sqrt(2 / freedom)};
}

/// Returns the variance of what is left of pixels, with the standard error by its fourth moment.
Estimate residual_variance(const SiteView& site, const Means& means) {
  double second = 0, fourth = 0;
  for (int y = 0; y < site.rows(); ++y) {
    for (int x = 0; x < site.columns(); ++x) {
      const double left = site.at(x, y) - means.row[static_cast<std::size_t>(y)] -
                          means.column[static_cast<std::size_t>(x)] + means.all;
      second += left * left;
      fourth += left * left * left * left;
    }
  }
  const double pixels = static_cast<double>(site.rows()) * site.columns();
  const double mean_square = second / pixels;
  return {second / ((site.rows() - 1.0) * (site.columns() - 1.0)),
          std::sqrt(std::max(0.0, fourth / pixels - mean_square * mean_square) / pixels)};
}

double mean_over(const SiteView& site) {
  double sum = 0;
  for (int y = 0; y < site.rows(); ++y) {
    for (int x = 0; x < site.columns(); ++x) sum += site.at(x, y);
  }
  return sum / (static_cast<double>(site.rows()) * site.columns());
}

SpatialParts parts_of(const DarkGroup& group, int index) {
  const SiteView site{group.mean_dn, index & 1, index >> 1};
  const double frames = group.frames, rows = site.rows(), columns = site.columns();
  const Means means = means_of(site);
  const Estimate row = variance_of(means.row, means.all), column = variance_of(means.column, means.all);
  const Estimate pixel = residual_variance(site, means);
  // The temporal variance of a pixel includes that of its row, which does not enter the residual.
  const double row_temporal = group.row_variance_dn2[static_cast<std::size_t>(index)];
  const double temporal = mean_over({group.variance_dn2, index & 1, index >> 1});
  const double pixel_temporal = temporal - row_temporal;
  const double pixel_temporal_error = temporal * std::sqrt(2 / (rows * columns * (frames - 1)));
  const double row_temporal_error =
      (std::max(0.0, row_temporal) + temporal / columns) * std::sqrt(2 / (rows * (frames - 1)));
  return {means.all,
          {row.value - pixel.value / columns - row_temporal / frames,
           std::hypot(row.standard_error, pixel.standard_error / columns, row_temporal_error / frames)},
          {column.value - pixel.value / rows, std::hypot(column.standard_error, pixel.standard_error / rows)},
          {pixel.value - pixel_temporal / frames,
           std::hypot(pixel.standard_error, pixel_temporal_error / frames, row_temporal_error / frames)}};
}

/// Means over the four sites. Two of them share their rows, and two their columns.
struct Joined {
  Estimate row, column, pixel;

  void add(const SpatialParts& parts, double scale) {
    const auto join = [scale](Estimate& sum, const Estimate& part) {
      sum.value += part.value * scale / 4;
      sum.standard_error = std::hypot(sum.standard_error, part.standard_error * scale / 4);
    };
    join(row, parts.row_dn2);
    join(column, parts.column_dn2);
    join(pixel, parts.pixel_dn2);
  }

  Nonuniformity roots() const {
    const double shared = std::sqrt(2.0);
    const Estimate rows{row.value, shared * row.standard_error}, columns{column.value, shared * column.standard_error};
    const Estimate total{rows.value + columns.value + pixel.value,
                         std::hypot(rows.standard_error, columns.standard_error, pixel.standard_error)};
    return {root_of(total), root_of(rows), root_of(columns), root_of(pixel)};
  }
};

Estimate difference(const Estimate& a, const Estimate& b) {
  return {a.value - b.value, std::hypot(a.standard_error, b.standard_error)};
}

Estimate scaled(const Estimate& figure, const Estimate& gain) {
  const double value = figure.value / gain.value;
  return {value, std::hypot(figure.standard_error / gain.value, value * gain.standard_error / gain.value)};
}

}  // namespace

Estimate root_of(const Estimate& variance) {
  constexpr double of_95_percent = 1.96;  // standard errors
  const double root = std::sqrt(std::max(0.0, variance.value)), near_zero = std::sqrt(variance.standard_error);
  if (root <= near_zero) return {root, near_zero};
  const double low = std::sqrt(std::max(0.0, variance.value - of_95_percent * variance.standard_error));
  return {root, variance.standard_error / (root + low)};
}

Result<PerSite<SpatialParts>> spatial_parts(const DarkGroup& group) {
  if (const auto known = check_noise_is_known(group); !known) return tl::make_unexpected(known.error());
  PerSite<SpatialParts> out;
  for (int site = 0; site < 4; ++site) out[static_cast<std::size_t>(site)] = parts_of(group, site);
  return out;
}

Nonuniformity dark_nonuniformity(const PerSite<SpatialParts>& dark, const Estimate& gain_dn_per_e) {
  Joined joined;
  for (const SpatialParts& site : dark) joined.add(site, 1);
  const Nonuniformity dn = joined.roots();
  return {scaled(dn.total, gain_dn_per_e), scaled(dn.row, gain_dn_per_e), scaled(dn.column, gain_dn_per_e),
          scaled(dn.pixel, gain_dn_per_e)};
}

Nonuniformity photo_response_nonuniformity(const PerSite<SpatialParts>& bright, const PerSite<SpatialParts>& dark) {
  Joined joined;
  for (std::size_t site = 0; site < bright.size(); ++site) {
    const double signal_dn = bright[site].mean_dn - dark[site].mean_dn;
    joined.add({signal_dn, difference(bright[site].row_dn2, dark[site].row_dn2),
                difference(bright[site].column_dn2, dark[site].column_dn2),
                difference(bright[site].pixel_dn2, dark[site].pixel_dn2)},
               1 / (signal_dn * signal_dn));
  }
  return joined.roots();
}

}  // namespace lowlux::calib
