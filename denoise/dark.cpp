#include "denoise/dark.h"

#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "denoise/box_mean.h"

namespace lowlux::denoise {

void subtract_dark(PlaneView<const float> charge_e, const PerSite<double>& dark_e, PlaneView<float> signal_e) {
  assert(charge_e.width == signal_e.width && charge_e.height == signal_e.height);
  for (int y = 0; y < charge_e.height; ++y) {
    for (int x = 0; x < charge_e.width; ++x) {
      signal_e.at(x, y) = static_cast<float>(charge_e.at(x, y) - dark_e[site_of(x, y)]);
    }
  }
}

SignalElectrons subtract_dark(RawElectrons charge, const PerSite<double>& dark_e) {
  subtract_dark(std::as_const(charge.value).view(), dark_e, charge.value.view());
  return {std::move(charge.value), charge.phase};
}

double intensity(const isp::Xyz& colour, ShareWeights weights) {
  return weights == ShareWeights::xy ? colour.x + colour.y + colour.z : colour.x + 15 * colour.y + 3 * colour.z;
}

Plane<float> alpha_map(const SceneLinear& signal_xyz, const isp::Xyz& dark, ShareWeights weights, int radius,
                       PlaneView<const std::uint8_t> saturated) {
  const double dark_intensity = intensity(dark, weights);
  assert(dark_intensity >= 0 && std::isfinite(dark_intensity));
  const auto& [x_plane, y_plane, z_plane] = signal_xyz.plane;
  Plane<double> signal(signal_xyz.width(), signal_xyz.height());
  for (int y = 0; y < signal.height(); ++y) {
    for (int x = 0; x < signal.width(); ++x) {
      const bool usable = saturated.data == nullptr || saturated.at(x, y) == 0;
      signal.at(x, y) = usable ? intensity({x_plane.at(x, y), y_plane.at(x, y), z_plane.at(x, y)}, weights)
                               : std::numeric_limits<double>::quiet_NaN();
    }
  }
  const Plane<double> mean = box_mean(signal, radius);
  Plane<float> alpha(signal.width(), signal.height());
  for (int y = 0; y < alpha.height(); ++y) {
    for (int x = 0; x < alpha.width(); ++x) {
      const double s = mean.at(x, y);
      alpha.at(x, y) = s > 0 ? static_cast<float>(s / (s + dark_intensity)) : 0.0f;
    }
  }
  return alpha;
}

}  // namespace lowlux::denoise
