#include "calib/dark/dark_temperature.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "calib/dark/dark_fit.h"

namespace lowlux::calib {
namespace {

constexpr double certain = 5;  // standard errors: the logarithm of such a value is normal, and biased by 2 % at most

Estimate in_electrons(const Estimate& dn, const Estimate& gain) {
  const double value = dn.value / gain.value;
  return {value, std::hypot(dn.standard_error / gain.value, value * gain.standard_error / gain.value)};
}

struct LogPoint {
  int channel;
  double temperature_c;
  double log_dn;
  double error;
};

std::vector<LogPoint> log_points(std::span<const double> temperature_c,
                                 std::span<const std::array<Estimate, 3>> slopes_dn) {
  std::vector<LogPoint> out;
  for (std::size_t t = 0; t < temperature_c.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const Estimate& slope = slopes_dn[t][k];
      if (!(slope.value > certain * slope.standard_error) || !(slope.standard_error > 0)) continue;
      out.push_back({k, temperature_c[t], std::log(slope.value), slope.standard_error / slope.value});
    }
  }
  return out;
}

/// The weighted sum of the deviations of the channels at one temperature.
struct Deviation {
  double weighted_sum = 0, weights = 0;

  /// Returns the relative deviation of the currents without the part that their errors explain: 0 below three standard
  /// errors, which one of some ten temperatures exceeds by chance in a few of a hundred fits.
  double unexplained() const {
    const double mean = weighted_sum / weights;
    if (mean * mean * weights < 9) return 0;
    return std::expm1(std::sqrt(mean * mean - 1 / weights));
  }
};

/// Puts the quality of the fit into the law. Where the currents follow another law, as Arrhenius' with a floor, they
/// deviate alike in all channels: the deviations of the temperatures, not of their channels, are independent.
/// @param deviations  deviations of the logarithms from the law
/// @return the factor of the standard errors
double judge(std::span<const LogPoint> points, std::span<const double> deviations, DarkTemperatureLaw& law) {
  double chi_square = 0;
  std::map<double, Deviation> of_temperature;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double weight = 1 / (points[i].error * points[i].error);
    chi_square += weight * deviations[i] * deviations[i];
    Deviation& deviation = of_temperature[points[i].temperature_c];
    deviation.weighted_sum += weight * deviations[i];
    deviation.weights += weight;
  }
  law.lowest_c = of_temperature.begin()->first;
  law.highest_c = of_temperature.rbegin()->first;
  law.degrees_of_freedom = static_cast<int>(points.size()) - 4;
  law.reduced_chi_square = chi_square / std::max(1, law.degrees_of_freedom);
  if (law.degrees_of_freedom < 1) return 1;
  if (law.reduced_chi_square <= 1 + certain * std::sqrt(2.0 / law.degrees_of_freedom)) return 1;
  for (const auto& [celsius, deviation] : of_temperature) law.misfit = std::max(law.misfit, deviation.unexplained());
  return std::sqrt(chi_square / std::max(1.0, static_cast<double>(of_temperature.size()) - 2));
}

/// Fits ln D_k(T) = a_k + b (T - T_0); the gain is common to all and changes only a_k.
std::optional<DarkTemperatureLaw> law_of(std::span<const LogPoint> points, double reference_c, const Estimate& gain) {
  Design design;
  std::vector<double> weights;
  for (const LogPoint& p : points) {
    std::vector<double> row(4);
    row[p.channel] = 1;
    row[3] = p.temperature_c - reference_c;
    design.push_back(row);
    weights.push_back(1 / (p.error * p.error));
  }
  const auto estimators = linear_estimators(design, weights);
  if (!estimators) return std::nullopt;
  std::array<Estimate, 4> found{};
  for (int i = 0; i < 4; ++i) {
    for (std::size_t k = 0; k < points.size(); ++k) {
      found[i].value += (*estimators)[i][k] * points[k].log_dn;
      found[i].standard_error += std::pow((*estimators)[i][k] * points[k].error, 2);
    }
    found[i].standard_error = std::sqrt(found[i].standard_error);
  }
  if (!(found[3].value > certain * found[3].standard_error)) return std::nullopt;
  std::vector<double> deviations;
  for (const LogPoint& point : points) {
    deviations.push_back(point.log_dn - found[point.channel].value -
                         found[3].value * (point.temperature_c - reference_c));
  }
  DarkTemperatureLaw law;
  const double factor = judge(points, deviations, law);
  for (Estimate& parameter : found) parameter.standard_error *= factor;
  law.temperature_c = reference_c;
  for (int k = 0; k < 3; ++k) {
    const double current = std::exp(found[k].value);
    law.current_e_per_s[k] = in_electrons({current, current * found[k].standard_error}, gain);
  }
  const double doubling = std::numbers::ln2 / found[3].value;
  law.doubling_c = {doubling, doubling * found[3].standard_error / found[3].value};
  return law;
}

/// Returns the ratios of the slopes. The gain cancels; the channels' errors are independent.
std::optional<std::array<Estimate, 3>> chromaticity_of(const std::array<Estimate, 3>& slopes) {
  double sum = 0, variance = 0;
  for (const Estimate& s : slopes) {
    sum += s.value;
    variance += s.standard_error * s.standard_error;
  }
  if (!(sum > certain * std::sqrt(variance)) || !(sum > 0)) return std::nullopt;
  std::array<Estimate, 3> out{};
  for (int k = 0; k < 3; ++k) {
    const double share = slopes[k].value / sum, own = slopes[k].standard_error * slopes[k].standard_error;
    out[k] = {share, std::sqrt((1 - share) * (1 - share) * own + share * share * (variance - own)) / sum};
  }
  return out;
}

}  // namespace

void put_currents(std::span<const double> temperature_c, std::span<const std::array<Estimate, 3>> slopes_dn,
                  bool stated, const Estimate& gain, DarkSeries& out) {
  for (std::size_t t = 0; t < temperature_c.size(); ++t) {
    DarkCurrent current;
    if (stated) current.temperature_c = temperature_c[t];
    for (int k = 0; k < 3; ++k) current.current_e_per_s[k] = in_electrons(slopes_dn[t][k], gain);
    out.currents.push_back(current);
  }
  const auto sum = [](const std::array<Estimate, 3>& s) { return s[0].value + s[1].value + s[2].value; };
  const auto most = std::max_element(slopes_dn.begin(), slopes_dn.end(),
                                     [&](const auto& a, const auto& b) { return sum(a) < sum(b); });
  out.chromaticity = chromaticity_of(*most);
  if (stated && temperature_c.size() > 1) {
    out.law = law_of(log_points(temperature_c, slopes_dn), temperature_c[most - slopes_dn.begin()], gain);
  }
}

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
              "the darks do not determine the system gain (" + found +
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
  if (points.variance.empty()) return too_little("frames of one setting are equal; was one file given twice?");
  const auto estimators = linear_estimators(points.design, points.weights);
  if (!estimators) return too_little("all means are similar");
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
  return too_little(fmt::format("the estimate is {:.3g} +- {:.2g} DN/e-", gain.value, gain.standard_error));
}

}  // namespace lowlux::calib
