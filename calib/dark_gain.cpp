#include "calib/dark_gain.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "calib/dark_fit.h"
#include "calib/linear_estimators.h"

namespace lowlux::calib {
namespace {

constexpr double largest_error = 0.05;

struct Points {
  Design design;  // mean, then one column for each site
  std::vector<double> variance, weights;
};

Points points_of(std::span<const DarkGroup> groups, const PixelMask& mask) {
  Points out;
  const double one = 1;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (int site = 0; site < 4; ++site) {
      const ImageFigures figures = figures_of({groups.subspan(g, 1), {&one, 1}}, mask, site);
      const double variance = figures.temporal_variance * groups[g].frames;
      if (!(variance > 0)) continue;
      std::vector<double> row(5);
      row[0] = figures.mean;
      row[1 + site] = 1;
      out.design.push_back(std::move(row));
      out.variance.push_back(variance);
      out.weights.push_back(figures.pixels * (groups[g].frames - 1) / (2 * variance * variance));
    }
  }
  return out;
}

tl::unexpected<Error> too_little(const std::string& found) {
  return fail(ErrorCode::insufficient,
              "the darks do not give the system gain (" + found +
                  "): give it with --system-gain, or --add-to a profile made by `calibrate noise`; or take darks long "
                  "enough to collect a few times the read noise squared in electrons");
}

}  // namespace

Result<Estimate> gain_of_darks(std::span<const DarkGroup> groups) {
  if (groups.size() < 2) return too_little("one exposure time");
  for (const DarkGroup& group : groups) {
    if (auto known = check_noise_is_known(group); !known) return tl::make_unexpected(known.error());
  }
  const DarkFit fit = begin_fit(groups, {1, 0});
  const Points points = points_of(groups, fit.mask);
  if (points.variance.empty()) return too_little("frames of a setting are equal; was one file given twice?");
  const auto estimators = linear_estimators(points.design, points.weights);
  if (!estimators) return too_little("all means are alike");
  std::vector<double> parameters(5);
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    for (std::size_t i = 0; i < points.variance.size(); ++i) parameters[p] += (*estimators)[p][i] * points.variance[i];
  }
  double error2 = 0, chi_square = 0;
  for (std::size_t i = 0; i < points.variance.size(); ++i) {
    error2 += std::pow((*estimators)[0][i], 2) / points.weights[i];
    double off = points.variance[i];
    for (std::size_t p = 0; p < parameters.size(); ++p) off -= points.design[i][p] * parameters[p];
    chi_square += off * off * points.weights[i];
  }
  const double freedom = std::max(1.0, static_cast<double>(points.variance.size()) - 5);
  const Estimate gain{parameters[0], std::sqrt(error2 * std::max(1.0, chi_square / freedom))};
  if (gain.value > 0 && gain.standard_error <= largest_error * gain.value) return gain;
  return too_little(fmt::format("it comes out as {:.3g} +- {:.2g} DN/e-", gain.value, gain.standard_error));
}

}  // namespace lowlux::calib
