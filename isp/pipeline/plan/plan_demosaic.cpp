#include "isp/pipeline/plan/plan_demosaic.h"

#include <algorithm>
#include <cmath>

#include "isp/base/cfa.h"
#include "isp/pipeline/render/cell_figures.h"

namespace lowlux::isp {
namespace {

constexpr double min_encoded_noisy_e = 50;  // encoded noise of less light has a visible bias
constexpr double max_median_e = 100;        // from 200 e- on, medians cost detail where colours are weakly correlated
constexpr double offset_e = 4;
constexpr float offset_of_white = 3e-3f;  // where the gain is not known
// Order of magnitude of the variance that noise reduction leaves of a raw value's: it sets the floor of gradients, on
// which the result depends little.
constexpr double residual_fraction = 1.0 / 16;
// The same for the variance that a clean raw states, which counts detail that was lost: 0.1 to 0.5 at 30 to 300 e-.
constexpr double stated_fraction = 1.0 / 4;

bool came_reduced(const RawFrame& frame) { return frame.noise && frame.noise->reduced; }

/// Returns the charge of light in a white green pixel [e-]. A noise profile of what noise reduction left states less
/// variance for each electron.
double green_e_at_white(const RawFrame& frame, const RawLevels& levels) {
  return light_at_white_by_colour(frame.raw, levels)[1] * (came_reduced(frame) ? stated_fraction : 1);
}

DemosaicPlan chosen(const RawFrame& frame, const NoiseReduction& noise, const DemosaicRequest& request) {
  if (request.method) return {{*request.method}, "given"};
  if (!noise.reduces() && !came_reduced(frame) && request.signal_e && *request.signal_e < min_encoded_noisy_e) {
    return {{DemosaicMethod::malvar}, "little light without noise reduction: filters on linear light leave no bias"};
  }
  if (request.max_method < DemosaicMethod::residual)
    return {{request.max_method}, "best method that fits into the time"};
  if (request.max_method > DemosaicMethod::residual && request.signal_e && *request.signal_e < max_median_e) {
    return {{DemosaicMethod::residual_median}, "little light: medians remove false colour"};
  }
  return {{DemosaicMethod::residual}, "preserves most detail"};
}

}  // namespace

std::optional<double> median_green_e(const RawFrame& frame, const RawLevels& levels, const Thumbnail& light,
                                     std::vector<float>& memory) {
  const Plane<float>& green = light.mean.plane[1];
  if (!levels.electrons_at_white || green.size() == 0) return std::nullopt;
  memory.assign(green.data(), green.data() + green.size());
  const auto middle = memory.begin() + static_cast<std::ptrdiff_t>(memory.size() / 2);
  std::nth_element(memory.begin(), middle, memory.end());
  return static_cast<double>(*middle) * green_e_at_white(frame, levels);
}

DemosaicPlan plan_demosaic(const RawFrame& frame, const RawLevels& levels, const Rendering& rendering,
                           const NoiseReduction& noise, const DemosaicRequest& request) {
  DemosaicPlan out = chosen(frame, noise, request);
  Demosaic& how = out.demosaic;
  how.white = static_cast<float>(std::exp2(-rendering.exposure_ev));
  how.offset = offset_of_white * std::min(how.white, 1.0f);
  if (!levels.electrons_at_white || frame.raw.layout != SensorLayout::bayer) return out;
  const double green_e = green_e_at_white(frame, levels), per_e = rendering.white_gain[1] / green_e;
  how.offset = static_cast<float>(offset_e * per_e);
  if (request.signal_e && frame.noise) {
    // The variance of u = cbrt(x + offset) is that of x over 9 (x + offset)^(4/3).
    const double signal_e = std::max(*request.signal_e, 0.0), x = signal_e * per_e;
    const double left = came_reduced(frame) ? residual_fraction / stated_fraction
                        : noise.reduces()   ? residual_fraction
                                            : 1;
    const double dark_e = mean_of_sites(levels.black.dark_mean_e), full_e = green_e + dark_e;
    const double variance_of_white = frame.noise->scale[1] * (signal_e + dark_e) / full_e + frame.noise->offset[1];
    const double fraction = median_ratio(frame.noise_ratio.get()) * left;
    const double variance = variance_of_white * fraction * std::pow(per_e * full_e, 2);
    how.noise_std = static_cast<float>(std::sqrt(std::max(variance, 0.0)) / (3 * std::pow(x + how.offset, 2.0 / 3)));
  }
  return out;
}

}  // namespace lowlux::isp
