#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "isp/metrics/statistics.h"
#include "isp/reproduce/clouds/chromaticity_clouds.h"

namespace lowlux::isp {
namespace {

constexpr std::size_t second_level = 1;

double pooled_size(const XyCovariance& covariance) {
  return size_of(principal_ellipse({{}, covariance}, drawn_deviations));
}

/// Returns the standard deviation over their mean of the chips' sizes, pooled down to a level.
double variation_of_sizes(const std::vector<Colour>& chips, std::size_t last) {
  double mean = 0, square = 0;
  for (const Colour& chip : chips) {
    const double size = pooled_size(pooled_cloud(chip, last).predicted) / static_cast<double>(chips.size());
    mean += size;
    square += size * size * static_cast<double>(chips.size());
  }
  return std::sqrt(std::max(0.0, square / (mean * mean) - 1));
}

}  // namespace

ChromaticityError chromaticity_error(const Cloud& cloud, const Xy& bright) {
  std::vector<double> distances;
  double squares = 0;
  for (const Xy& xy : cloud.samples) {
    distances.push_back(std::hypot(xy.x - bright.x, xy.y - bright.y));
    squares += distances.back() * distances.back();
  }
  const Estimate mean = mean_of(distances);
  const auto n = static_cast<double>(distances.size());
  return {mean.value, mean.standard_error * std::sqrt(n), squares / n};
}

PooledCloud pooled_cloud(const Colour& colour, std::size_t last) {
  assert(last < colour.clouds.size());
  std::vector<Xy> samples;
  PooledCloud out;
  const double share = 1 / static_cast<double>(last + 1);
  for (std::size_t i = 0; i <= last; ++i) {
    const Cloud& cloud = colour.clouds[i];
    samples.insert(samples.end(), cloud.samples.begin(), cloud.samples.end());
    out.predicted.xx += share * cloud.predicted.covariance.xx;
    out.predicted.xy += share * cloud.predicted.covariance.xy;
    out.predicted.yy += share * cloud.predicted.covariance.yy;
  }
  out.sampled = *cloud_of(samples);  // every cloud has two samples at least
  return out;
}

std::optional<XyEllipse> centred_ellipse(const Xy& centre, std::span<const Xy> samples) {
  std::vector<Xy> both(samples.begin(), samples.end());
  for (const Xy& xy : samples) both.push_back({2 * centre.x - xy.x, 2 * centre.y - xy.y});
  auto out = enclosing_ellipse(both);
  if (out) out->centre = centre;  // up to rounding it is there
  return out;
}

std::vector<Finding> error_findings(const Colour& colour) {
  const Xy bright = colour.clouds.front().predicted.mean;
  const ChromaticityError first = chromaticity_error(colour.clouds.front(), bright);
  const ChromaticityError last = chromaticity_error(colour.clouds.back(), bright);
  double worst = 0;
  for (const Cloud& cloud : colour.clouds) {
    const double square = chromaticity_error(cloud, bright).mean_square;
    const XyCovariance& expected = cloud.predicted.covariance;
    const double trace = expected.xx + expected.yy;  // the size squared: its relative error is twice the size's
    const double error = 2 * trace * log_size_of(expected, cloud.samples.size()).standard_error;
    worst = std::max(worst, std::fabs(square - trace) / error);
  }
  return {{"chromaticity-clouds/error",
           "the error of chromaticity E_xy grows as light falls (Eq. 3.11, 3.12, Fig. 3-3b)", "grows",
           fmt::format("{:.2g} in xy at 1 W, {:.2g} at 6e-15 W, with a deviation of {:.2g}", first.mean, last.mean,
                       last.deviation),
           last.mean > first.mean, "mean distance of the samples from the bright chromaticity, scenario I"},
          {"chromaticity-clouds/error-predicted", "the mean square of E_xy is the trace of the predicted covariance",
           "0 standard errors", fmt::format("{:.1f} standard errors at most", worst), worst <= confidence_errors,
           "scenario I, all levels", Finding::Kind::check}};
}

Plot error_plot(const Colour& colour) {
  Plot plot{"chromaticity-clouds-error", "Error of chromaticity", "F [W]", "E_xy",
            AxisScale::logarithmic,      AxisScale::logarithmic};
  Series mean{"mean", {}, {}, Mark::line}, deviation{"standard deviation", {}, {}, Mark::dashed};
  for (const Cloud& cloud : colour.clouds) {
    const ChromaticityError error = chromaticity_error(cloud, colour.clouds.front().predicted.mean);
    for (Series* series : {&mean, &deviation}) series->x.push_back(cloud.power_w);
    mean.y.push_back(error.mean);
    deviation.y.push_back(error.deviation);
  }
  plot.series = {std::move(mean), std::move(deviation)};
  plot.caption = "As Figure 3-3b: Eq. 3.11 and 3.12.";
  return plot;
}

bool pooled_ellipses_grow(const std::vector<Colour>& colours) {
  return std::ranges::all_of(colours, [](const Colour& colour) {
    return pooled_size(pooled_cloud(colour, colour.clouds.size() - 1).sampled.covariance) >
           pooled_size(pooled_cloud(colour, second_level).sampled.covariance);
  });
}

std::vector<Finding> pooled_findings(const std::vector<Colour>& chips) {
  const std::size_t first = second_level, last = chips.front().clouds.size() - 1;
  const bool grow = pooled_ellipses_grow(chips);
  const double before = variation_of_sizes(chips, first), after = variation_of_sizes(chips, last);
  constexpr double noticeably = 0.99;
  return {
      {"chromaticity-clouds/pooled", "ellipses pooled from 1 W down to a least intensity grow as it falls (Fig. 3-6)",
       "grow", grow ? "all chips" : "not all chips", grow,
       "principal axes of all samples down to 1e-3 and to 6e-15 W, scenario II"},
      {"chromaticity-clouds/pooled-variation",
       "the variation in the ellipses' size falls off as light decreases (section 3.4)", "falls off",
       fmt::format("{:.1f} % down to {:.0e} W, {:.1f} % down to {:.0e} W", 100 * before,
                   chips.front().clouds[first].power_w, 100 * after, chips.front().clouds[last].power_w),
       after < noticeably * before,
       "read as the deviation of the ten pooled sizes over their mean; to first order all sizes are proportional to "
       "F^-1/2, so that their ratios are the same at all levels"}};
}

Plot pooled_plot(const std::vector<Colour>& chips) {
  Plot plot{"chromaticity-clouds-pooled", "Size of the pooled ellipses", "least F [W]",
            "size, 10 deviations [xy]",   AxisScale::logarithmic,        AxisScale::logarithmic};
  for (const Colour& chip : chips) {
    Series series{chip.name, {}, {}, Mark::line};
    for (std::size_t i = 0; i < chip.clouds.size(); ++i) {
      series.x.push_back(chip.clouds[i].power_w);
      series.y.push_back(pooled_size(pooled_cloud(chip, i).sampled.covariance));
    }
    plot.series.push_back(std::move(series));
  }
  plot.caption = "As Figure 3-6: all samples from 1 W down to the least intensity together.";
  return plot;
}

}  // namespace lowlux::isp
