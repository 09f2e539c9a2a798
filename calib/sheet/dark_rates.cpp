#include "calib/sheet/dark_rates.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "calib/dark/dark_fit.h"
#include "calib/frame_setting.h"
#include "isp/model/sensor/noise_budget.h"

namespace lowlux::calib {
namespace {

constexpr double min_activation_ev = 0.1, max_activation_ev = 2;
constexpr double explained = 4;  // chi-square of one degree of freedom

/// The law with its amplitude at the highest temperature: F + amplitude * shape.
struct Fit {
  double floor = 0, amplitude = 0;
  double misfit = std::numeric_limits<double>::infinity();  // chi-square
};

class LawFit {
 public:
  explicit LawFit(std::span<const RateAtTemperature> rates) : rates_(rates) {
    for (const RateAtTemperature& r : rates) {
      inverse_kt_.push_back(1 / (isp::boltzmann_ev_per_k * (r.temperature_c + isp::zero_celsius_k)));
      weights_.push_back(1 / (r.e_per_s.standard_error * r.e_per_s.standard_error));
    }
    reference_ = std::ranges::min(inverse_kt_);
  }

  /// Returns the best law of an activation energy.
  Fit at(double activation_ev) const {
    Design design;
    for (std::size_t i = 0; i < rates_.size(); ++i) design.push_back({1, shape(activation_ev, i)});
    const auto estimators = linear_estimators(design, weights_);
    if (!estimators) return {};
    Fit fit{.misfit = 0};
    for (std::size_t i = 0; i < rates_.size(); ++i) {
      fit.floor += (*estimators)[0][i] * rates_[i].e_per_s.value;
      fit.amplitude += (*estimators)[1][i] * rates_[i].e_per_s.value;
    }
    for (std::size_t i = 0; i < rates_.size(); ++i) {
      const double off = rates_[i].e_per_s.value - fit.floor - fit.amplitude * shape(activation_ev, i);
      fit.misfit += weights_[i] * off * off;
    }
    return fit;
  }

  /// Returns the energy of the least misfit, by golden sections between the neighbours of the best of even steps.
  double best_activation_ev() const {
    constexpr int steps = 380;
    constexpr double step_ev = (max_activation_ev - min_activation_ev) / steps;
    int best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= steps; ++i) {
      const double misfit = at(min_activation_ev + step_ev * i).misfit;
      if (misfit < least) {
        least = misfit;
        best = i;
      }
    }
    double low = min_activation_ev + step_ev * std::max(best - 1, 0);
    double high = min_activation_ev + step_ev * std::min(best + 1, steps);
    const double golden = (std::sqrt(5.0) - 1) / 2;
    while (high - low > 1e-9) {
      const double left = high - golden * (high - low), right = low + golden * (high - low);
      (at(left).misfit < at(right).misfit ? high : low) = at(left).misfit < at(right).misfit ? right : left;
    }
    return (low + high) / 2;
  }

  /// Returns energy and floor with their errors, by the derivatives of the law.
  std::optional<DarkLaw> law(double activation_ev, const Fit& fit) const {
    Design derivatives;
    for (std::size_t i = 0; i < rates_.size(); ++i) {
      const double part = shape(activation_ev, i);
      derivatives.push_back({fit.amplitude * part * (reference_ - inverse_kt_[i]), 1, part});
    }
    const auto estimators = linear_estimators(derivatives, weights_);
    if (!estimators) return std::nullopt;
    const auto error = [&](std::size_t parameter) {
      double variance = 0;
      for (std::size_t i = 0; i < rates_.size(); ++i) {
        variance += (*estimators)[parameter][i] * (*estimators)[parameter][i] / weights_[i];
      }
      return std::sqrt(variance);
    };
    return DarkLaw{{activation_ev, error(0)}, {fit.floor, error(1)}};
  }

 private:
  double shape(double activation_ev, std::size_t i) const {
    return std::exp(activation_ev * (reference_ - inverse_kt_[i]));
  }

  std::span<const RateAtTemperature> rates_;
  std::vector<double> inverse_kt_;  // [1/eV]
  std::vector<double> weights_;
  double reference_ = 0;  // reference of the highest temperature [1/eV]
};

int temperatures_of(std::span<const RateAtTemperature> rates) {
  std::vector<double> all;
  for (const RateAtTemperature& r : rates) all.push_back(r.temperature_c);
  std::ranges::sort(all);
  int count = all.empty() ? 0 : 1;
  for (std::size_t i = 1, last = 0; i < all.size(); ++i) {
    if (same_temperature(all[last], all[i])) continue;
    ++count;
    last = i;
  }
  return count;
}

/// Returns the chi-square of the best law that doubles with a fixed number of degrees, to first order in the errors.
double misfit_of_doubling(std::span<const RateAtTemperature> rates) {
  double weight = 0, mean_t = 0, mean_log = 0, tt = 0, tl = 0, ll = 0;
  for (const RateAtTemperature& r : rates) {
    if (!(r.e_per_s.value > 0)) return std::numeric_limits<double>::infinity();
    const double w = std::pow(r.e_per_s.value / r.e_per_s.standard_error, 2);
    weight += w;
    mean_t += w * r.temperature_c;
    mean_log += w * std::log(r.e_per_s.value);
  }
  mean_t /= weight;
  mean_log /= weight;
  for (const RateAtTemperature& r : rates) {
    const double w = std::pow(r.e_per_s.value / r.e_per_s.standard_error, 2);
    const double t = r.temperature_c - mean_t, l = std::log(r.e_per_s.value) - mean_log;
    tt += w * t * t;
    tl += w * t * l;
    ll += w * l * l;
  }
  return ll - tl * tl / tt;
}

/// Returns the factor of standard errors where the misfit of a law is clearly more than the errors of the rates
/// explain.
double error_factor(double chi_square, double degrees) {
  if (degrees <= 0 || chi_square / degrees <= 1 + 5 * std::sqrt(2 / degrees)) return 1;
  return std::sqrt(chi_square / degrees);
}

/// Mean of a plane and the standard error that its scatter gives it.
Estimate mean_of(const Plane<float>& plane) {
  double sum = 0, squares = 0;
  const auto n = static_cast<double>(plane.size());
  for (std::size_t i = 0; i < plane.size(); ++i) sum += static_cast<double>(plane.data()[i]);
  const double mean = sum / n;
  for (std::size_t i = 0; i < plane.size(); ++i) {
    const double off = static_cast<double>(plane.data()[i]) - mean;
    squares += off * off;
  }
  return {mean, std::sqrt(squares / n / (n - 1))};
}

double mean_row_variance(const DarkGroup& group) {
  double sum = 0;
  for (const double site : group.row_variance_dn2) sum += std::max(0.0, site) / 4;
  return sum;
}

/// Adds the noise of whole rows, two sites of which share each row, and that of whole frames: drift and flicker.
Estimate with_rows_and_frames(const Estimate& mean, const DarkGroup& group) {
  double frame_variance = 0;
  for (const double site : group.frame_variance_dn2) frame_variance += std::max(0.0, site) / 4;
  const double common = mean_row_variance(group) / group.mean_dn.height() + frame_variance;
  return {mean.value, std::hypot(mean.standard_error, std::sqrt(common / group.frames))};
}

/// Returns the slope of a line by weighted least squares.
Estimate slope_of(const std::vector<double>& x, const std::vector<Estimate>& y) {
  double weight = 0, mean_x = 0, mean_y = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double w = 1 / (y[i].standard_error * y[i].standard_error);
    weight += w;
    mean_x += w * x[i];
    mean_y += w * y[i].value;
  }
  mean_x /= weight;
  mean_y /= weight;
  double xx = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double w = 1 / (y[i].standard_error * y[i].standard_error);
    xx += w * (x[i] - mean_x) * (x[i] - mean_x);
    xy += w * (x[i] - mean_x) * (y[i].value - mean_y);
  }
  return {xy / xx, 1 / std::sqrt(xx)};
}

/// Divides by a power of the gain.
Estimate over_gain(const Estimate& slope, const Estimate& gain, int power) {
  const double unit = std::pow(gain.value, power), value = slope.value / unit;
  return {value, std::hypot(slope.standard_error / unit, power * value * gain.standard_error / gain.value)};
}

DarkRate rate_of(std::span<const DarkGroup* const> groups, const Estimate& gain) {
  constexpr double min_error_dn = 1e-9;  // frames without any noise
  std::vector<double> time_s;
  std::vector<Estimate> mean_dn, variance_dn2;
  for (const DarkGroup* group : groups) {
    const double rows = group->mean_dn.height(), frames = group->frames, row_variance = mean_row_variance(*group);
    time_s.push_back(*group->setting.exposure_s);
    mean_dn.push_back(with_rows_and_frames(mean_of(group->mean_dn), *group));
    variance_dn2.push_back(mean_of(group->variance_dn2));
    // Row noise scatters the variances of whole rows together.
    variance_dn2.back().standard_error =
        std::hypot(variance_dn2.back().standard_error, row_variance * std::sqrt(2 / (rows * (frames - 1))));
    for (Estimate* e : {&mean_dn.back(), &variance_dn2.back()}) {
      e->standard_error = std::max(e->standard_error, min_error_dn);
    }
  }
  return {groups.front()->setting.temperature_c, over_gain(slope_of(time_s, mean_dn), gain, 1),
          over_gain(slope_of(time_s, variance_dn2), gain, 2), static_cast<int>(groups.size())};
}

std::optional<Estimate> doubling_of(std::span<const RateAtTemperature> rates) {
  std::vector<double> temperature_c;
  std::vector<Estimate> log2_rate;
  for (const auto& [celsius, current] : rates) {
    if (!(current.value > 0)) return std::nullopt;
    temperature_c.push_back(celsius);
    log2_rate.push_back({std::log2(current.value), current.standard_error / current.value / std::log(2.0)});
  }
  if (rates.size() < 2) return std::nullopt;
  const Estimate slope = slope_of(temperature_c, log2_rate);
  if (!(slope.value > 0)) return std::nullopt;
  const double factor = error_factor(misfit_of_doubling(rates), static_cast<double>(rates.size()) - 2);
  return Estimate{1 / slope.value, factor * slope.standard_error / (slope.value * slope.value)};
}

/// Returns the rates by the means; none if not all of them have a temperature.
std::vector<RateAtTemperature> rates_by_mean(std::span<const DarkRate> rates) {
  std::vector<RateAtTemperature> out;
  for (const DarkRate& rate : rates) {
    if (!rate.temperature_c) return {};
    out.push_back({*rate.temperature_c, rate.by_mean_e_per_s});
  }
  return out;
}

std::optional<DarkLaw> law_of(std::span<const RateAtTemperature> rates, const Estimate& gain) {
  auto law = fit_dark_law(rates);
  if (law) {
    Estimate& floor = law->floor_e_per_s;
    floor.standard_error = std::hypot(floor.standard_error, floor.value * gain.standard_error / gain.value);
  }
  return law;
}

}  // namespace

std::optional<DarkLaw> fit_dark_law(std::span<const RateAtTemperature> rates) {
  if (temperatures_of(rates) < 3) return std::nullopt;
  const LawFit fit(rates);
  const double activation_ev = fit.best_activation_ev();
  const Fit best = fit.at(activation_ev);
  const bool inside = activation_ev > min_activation_ev + 1e-6 && activation_ev < max_activation_ev - 1e-6;
  if (!inside || !(best.amplitude > 0)) return std::nullopt;
  const double doubling = misfit_of_doubling(rates), degrees = static_cast<double>(rates.size()) - 3;
  if (degrees > 0 ? doubling <= best.misfit : doubling < explained) return std::nullopt;
  auto law = fit.law(activation_ev, best);
  if (!law) return std::nullopt;
  for (Estimate* e : {&law->activation_ev, &law->floor_e_per_s})
    e->standard_error *= error_factor(best.misfit, degrees);
  if (!(law->activation_ev.standard_error < activation_ev / 2)) return std::nullopt;
  return law;
}

bool is_saturated(const DarkGroup& group, double full_dn) {
  constexpr double most = 0.01;  // such a tail lowers the mean by 0.003 of the deviation of the pixels
  return saturated_fraction(group, full_dn) > most;
}

Result<DarkRates> dark_rates(std::span<const DarkGroup> groups, const Estimate& gain_dn_per_e, double full_dn) {
  std::vector<const DarkGroup*> left;
  for (const DarkGroup& group : groups) {
    if (const auto known = check_noise_is_known(group); !known) return tl::make_unexpected(known.error());
    if (const auto same = check_same_camera(groups.front().setting, group.setting, "a group of darks"); !same) {
      return tl::make_unexpected(same.error());
    }
    if (group.setting.exposure_s && !is_saturated(group, full_dn)) left.push_back(&group);
  }
  std::ranges::stable_sort(
      left, [](const DarkGroup* a, const DarkGroup* b) { return a->setting.temperature_c < b->setting.temperature_c; });
  DarkRates out;
  // The error of the gain scales the rates of all temperatures alike: it changes neither doubling nor energy.
  std::vector<DarkRate> of_exact_gain;
  for (auto first = left.begin(); first != left.end();) {
    const auto last = std::find_if(first, left.end(), [&](const DarkGroup* g) {
      return !same_temperature((*first)->setting.temperature_c, g->setting.temperature_c);
    });
    const std::span<const DarkGroup* const> these(first, last);
    const auto [least, most] =
        std::ranges::minmax_element(these, {}, [](const DarkGroup* g) { return *g->setting.exposure_s; });
    if (*(*least)->setting.exposure_s < *(*most)->setting.exposure_s) {
      out.rates.push_back(rate_of(these, gain_dn_per_e));
      of_exact_gain.push_back(rate_of(these, {gain_dn_per_e.value, 0}));
    }
    first = last;
  }
  if (out.rates.empty()) {
    return fail(ErrorCode::insufficient,
                "no two exposure times of darks at one temperature: dark current is not known");
  }
  const std::vector<RateAtTemperature> by_mean = rates_by_mean(of_exact_gain);
  out.doubling_c = doubling_of(by_mean);
  out.law = law_of(by_mean, gain_dn_per_e);
  return out;
}

}  // namespace lowlux::calib
