#include "isp/render/exposure.h"

#include <cmath>
#include <limits>
#include <vector>

#include "isp/render/block_statistics.h"

namespace lowlux::isp {
namespace {

/// Returns the EV that maps `from` to `to`; infinite if `from` is not positive.
double ev_to_reach(double to, double from) {
  return from > 0 ? std::log2(to / from) : std::numeric_limits<double>::infinity();
}

}  // namespace

std::string_view name_of(ExposureRule rule) {
  switch (rule) {
    case ExposureRule::mid_grey:
      return "mid-grey";
    case ExposureRule::night:
      return "night";
    case ExposureRule::highlights:
      return "highlights";
    case ExposureRule::black_noise:
      return "black-noise";
    case ExposureRule::no_gain:
      return "no-gain";
    case ExposureRule::max_gain:
      return "most-gain";
    case ExposureRule::no_signal:
      break;
  }
  return "no-signal";
}

double level_of_median(double luminance_cd_m2, double mid_grey) {
  const double key = 1.03 - 2 / (2 + std::log10(std::fmax(luminance_cd_m2, 0) + 1));
  return std::fmin(key, mid_grey);
}

AutoExposure auto_exposure(std::span<const float> luminance, std::span<const float> largest, double noise_floor,
                           const AutoExposureOptions& options) {
  std::vector<float> copy(luminance.begin(), luminance.end()), largest_copy(largest.begin(), largest.end());
  return auto_exposure_reordering(copy, largest_copy, noise_floor, options);
}

AutoExposure auto_exposure_reordering(std::span<float> luminance, std::span<float> largest, double noise_floor,
                                      const AutoExposureOptions& options) {
  const double bright = quantile_reordering(luminance, 0.99).value_or(0);
  const double median = quantile_reordering(luminance, 0.5).value_or(0);
  if (bright <= 0 || bright <= options.signal_to_scatter * black_scatter_reordering(luminance)) {
    return {0, ExposureRule::no_signal};
  }
  const double middle =
      options.white_cd_m2 ? level_of_median(median * *options.white_cd_m2, options.mid_grey) : options.mid_grey;
  AutoExposure chosen{ev_to_reach(middle, median),
                      middle < options.mid_grey ? ExposureRule::night : ExposureRule::mid_grey};
  const double most = quantile_reordering(largest, 0.99).value_or(0);
  const AutoExposure others[] = {
      {ev_to_reach(options.highlight, most) + options.shoulder_ev, ExposureRule::highlights},
      {ev_to_reach(options.black_noise, noise_floor), ExposureRule::black_noise},
      {options.max_ev, ExposureRule::max_gain},
  };
  for (const AutoExposure& other : others) {
    if (other.ev < chosen.ev) chosen = other;
  }
  if (chosen.ev <= 0) return {0, ExposureRule::no_gain};
  return chosen;
}

}  // namespace lowlux::isp
