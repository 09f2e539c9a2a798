#include <algorithm>
#include <cmath>

#include "calib/dark_fit.h"

namespace lowlux::calib {
namespace {

constexpr double quantisation_dn2 = 1.0 / 12;

/// Weights that make of the groups' means the residual of one of them.
std::vector<double> residual_weights(const DarkFit& s, std::size_t group, int site) {
  std::vector<double> out(s.groups.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    for (std::size_t p = 0; p < s.estimators[site].size(); ++p) {
      out[i] -= s.design[group][p] * s.estimators[site][p][i];
    }
  }
  out[group] += 1;
  return out;
}

}  // namespace

std::vector<DarkPoint> points_of(const DarkFit& fit, std::span<const PerSite<Estimate>> parameters) {
  std::vector<DarkPoint> out;
  out.reserve(4 * fit.groups.size());
  for (std::size_t g = 0; g < fit.groups.size(); ++g) {
    for (int site = 0; site < 4; ++site) {
      const Estimate off = estimate(fit, residual_weights(fit, g, site), site);
      double fitted = 0;
      for (std::size_t p = 0; p < parameters.size(); ++p) fitted += fit.design[g][p] * parameters[p][site].value;
      out.push_back({static_cast<int>(g), site, fitted + off.value, off});
    }
  }
  return out;
}

std::optional<Estimate> read_noise_of(const DarkFit& fit, std::size_t group, const PerSite<double>& dark_charge_dn) {
  const double gain = fit.gain.value, frames = fit.groups[group].frames;
  double square = 0, error2 = 0;
  for (int site = 0; site < 4; ++site) {
    const double noise = fit.noise_dn2[group][site];
    const double row = std::max(0.0, fit.groups[group].row_variance_dn2[site]);
    const double pixels = static_cast<double>(fit.mask.size()) / 4;
    square += (noise - row - quantisation_dn2 - gain * dark_charge_dn[site]) / 4;
    error2 += 2 * noise * noise / (pixels * (frames - 1)) / 16;
  }
  if (!(square > 0)) return std::nullopt;
  const double read_dn = std::sqrt(square), relative_gain = fit.gain.standard_error / gain;
  return Estimate{read_dn / gain, read_dn / gain * std::hypot(std::sqrt(error2) / (2 * square), relative_gain)};
}

Plane<float> map_of(const DarkFit& fit, std::size_t parameter, double unit) {
  Plane<float> out(fit.mask.width(), fit.mask.height());
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      const std::vector<double>& weights = fit.estimators[site_of(x, y)][parameter];
      double value = 0;
      for (std::size_t g = 0; g < weights.size(); ++g) value += weights[g] * fit.groups[g].mean_dn.at(x, y);
      out.at(x, y) = static_cast<float>(value / unit);
    }
  }
  return out;
}

}  // namespace lowlux::calib
