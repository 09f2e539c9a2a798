#include "calib/dark_temperature.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "calib/linear_estimators.h"

namespace lowlux::calib {
namespace {

constexpr double certain = 5;  // standard errors: the logarithm of such a figure is normal, and biased by 2 % at most

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

/// ln D_k(T) = a_k + b (T - T_0); the gain is common to all and moves only a_k.
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
  DarkTemperatureLaw law;
  law.temperature_c = reference_c;
  for (int k = 0; k < 3; ++k) {
    const double current = std::exp(found[k].value);
    law.current_e_per_s[k] = in_electrons({current, current * found[k].standard_error}, gain);
  }
  const double doubling = std::numbers::ln2 / found[3].value;
  law.doubling_c = {doubling, doubling * found[3].standard_error / found[3].value};
  for (const auto& point : points) {
    const double fitted = found[point.channel].value + found[3].value * (point.temperature_c - reference_c);
    law.reduced_chi_square += std::pow((point.log_dn - fitted) / point.error, 2);
  }
  law.degrees_of_freedom = static_cast<int>(points.size()) - 4;
  law.reduced_chi_square /= std::max(1, law.degrees_of_freedom);
  return law;
}

/// The gain cancels; the channels' errors are independent.
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

}  // namespace lowlux::calib
