#include "calib/sheet/dark_law.h"

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
  double reference_ = 0;  // of the highest temperature [1/eV]
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

}  // namespace

std::optional<DarkLaw> fit_dark_law(std::span<const RateAtTemperature> rates) {
  if (temperatures_of(rates) < 3) return std::nullopt;
  const LawFit fit(rates);
  const double activation_ev = fit.best_activation_ev();
  const Fit best = fit.at(activation_ev);
  const bool inside = activation_ev > min_activation_ev + 1e-6 && activation_ev < max_activation_ev - 1e-6;
  if (!inside || !(best.amplitude > 0)) return std::nullopt;
  auto law = fit.law(activation_ev, best);
  if (!law || !(law->activation_ev.standard_error < activation_ev / 2)) return std::nullopt;
  return law;
}

}  // namespace lowlux::calib
