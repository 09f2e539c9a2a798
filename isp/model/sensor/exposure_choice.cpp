#include "isp/model/sensor/exposure_choice.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "isp/model/sensor/noise_budget.h"
#include "isp/model/sensor/saturation_limits.h"

namespace lowlux::isp {
namespace {

constexpr double rounding = 1e-9;         // relative; of times that are computed twice
constexpr double equal_snr = 0.005;       // gains whose ratio differs less are equally good
constexpr double good_highlight = 0.015;  // charge by which a highlight may pass its limit meanwhile
constexpr double min_e_per_s = 1e-6;      // keeps ratios of signal-to-noise ratios defined in the dark

/// Returns the largest time of the camera's steps that is at most `time_s`, at least the first.
double step_below(double time_s, const ExposureTimes& times) {
  const double held_s = std::clamp(time_s, times.min_s, times.max_s);
  if (times.step_s <= 0) return held_s;
  return times.min_s + times.step_s * std::floor((held_s - times.min_s) / times.step_s + 1e-6);
}

/// Returns the time of the camera's steps that is nearest to `time_s` and at most `longest_s`.
double nearest_step(double time_s, double longest_s, const ExposureTimes& times) {
  const double nearest_s = step_below(time_s + times.step_s / 2, times);
  return nearest_s <= longest_s * (1 + rounding) ? nearest_s : step_below(longest_s, times);
}

/// Returns whether a time is a whole number of half periods of the mains, up to a step of the camera, or shorter than
/// one.
bool is_flicker_free(double time_s, const ExposureLimits& limits) {
  const double slack_s = 1.01 * limits.times.step_s + rounding * time_s;
  const auto is_whole = [&](double hz) { return std::abs(time_s - std::round(time_s * hz) / hz) <= slack_s; };
  const double hz = flicker_hz(limits.mains);
  return hz <= 0 || time_s * hz < 1 || is_whole(hz) || (limits.mains == Mains::either && is_whole(20));
}

struct Longest {
  double exposure_s;
  ExposureLimit limit;
};

/// Returns the longest time in which the highlight stays within its limits at a gain.
Longest longest_exposure(const MeteredLight& light, const GainStep& gain, const ExposureLimits& limits) {
  const double rate = std::max(light.highlight_e_per_s, 0.0) + dark_e_per_s(gain, limits);
  const double limit_e = highlight_limit_e(gain, limits);
  if (rate * limits.longest_s <= limit_e) return {limits.longest_s, ExposureLimit::motion};
  const bool by_well = gain.sensor.full_well_e < (1 - metering_headroom) * code_range_e(gain.sensor);
  return {limit_e / rate, by_well ? ExposureLimit::full_well : ExposureLimit::converter_range};
}

ExposureChoice choice_at(std::size_t index, const MeteredLight& light, std::span<const GainStep> gains,
                         const ExposureLimits& limits) {
  const auto [longest_s, limit] = longest_exposure(light, gains[index], limits);
  ExposureChoice out;
  out.setting = {allowed_time_s(longest_s, limits), index};
  out.limit = limit;
  out.clips = limit != ExposureLimit::motion && out.setting.exposure_s > longest_s * (1 + 1e-6);
  out.snr = midtone_snr(out.setting, light, gains, limits);
  return out;
}

}  // namespace

double flicker_hz(Mains mains) {
  static constexpr double of_mains[] = {0, 100, 120, 110};
  return of_mains[static_cast<int>(mains)];
}

double allowed_time_s(double longest_s, const ExposureLimits& limits) {
  const double most_s = std::min(longest_s, limits.times.max_s);
  const double flicker = flicker_hz(limits.mains);
  const auto whole = [&](double hz) { return std::floor(most_s * hz * (1 + rounding)) / hz; };
  const double free_s = flicker > 0 ? std::max(whole(flicker), limits.mains == Mains::either ? whole(20) : 0) : 0;
  if (free_s <= 0) return step_below(most_s, limits.times);
  return nearest_step(free_s, most_s, limits.times);
}

double highlight_limit_e(const GainStep& gain, const ExposureLimits& limits) {
  const double z = normal_quantile_above(limits.clipped_fraction);
  const SensorModel& sensor = gain.sensor;
  return std::min(charge_below(sensor.full_well_e, 0, z),
                  charge_below((1 - metering_headroom) * code_range_e(sensor), sensor.read_noise_e, z));
}

double dark_e_per_s(const GainStep& gain, const ExposureLimits& limits) {
  return std::ranges::max(dark_mean_e(gain.sensor, {1, limits.temperature_c}));
}

double midtone_snr(const ExposureSetting& setting, const MeteredLight& light, std::span<const GainStep> gains,
                   const ExposureLimits& limits) {
  const GainStep& gain = gains[setting.gain];
  return snr(gain.sensor, {std::max(light.midtone_e_per_s, min_e_per_s) * setting.exposure_s,
                           dark_e_per_s(gain, limits) * setting.exposure_s});
}

ExposureChoice choose_exposure(const MeteredLight& light, std::span<const GainStep> gains,
                               const ExposureLimits& limits) {
  assert(!gains.empty());
  const auto first_beyond = std::ranges::upper_bound(gains, limits.max_factor, {}, &GainStep::factor);
  gains = gains.first(std::max<std::size_t>(static_cast<std::size_t>(first_beyond - gains.begin()), 1));
  double best_snr = 0;
  for (std::size_t i = 0; i < gains.size(); ++i) {
    const ExposureChoice at = choice_at(i, light, gains, limits);
    if (!at.clips) best_snr = std::max(best_snr, at.snr);
  }
  for (std::size_t i = 0; i < gains.size(); ++i) {
    const ExposureChoice at = choice_at(i, light, gains, limits);
    if (!at.clips && at.snr >= (1 - equal_snr) * best_snr) return at;
  }
  return choice_at(0, light, gains, limits);  // all clip, the lowest gain least
}

bool is_good(const ExposureSetting& setting, const MeteredLight& light, std::span<const GainStep> gains,
             const ExposureLimits& limits, const ExposureChoice& best, double tolerance) {
  const double time_s = setting.exposure_s;
  const auto is_equal = [&](double other_s) {
    return std::abs(time_s - other_s) <= 0.51 * limits.times.step_s + rounding * time_s;
  };
  if (setting.gain == best.setting.gain && is_equal(best.setting.exposure_s)) return true;
  if (best.clips || gains[setting.gain].factor > std::max(limits.max_factor, gains.front().factor) ||
      time_s > std::min(limits.longest_s, limits.times.max_s) * (1 + rounding))
    return false;
  if (!is_flicker_free(time_s, limits)) return false;
  const GainStep& gain = gains[setting.gain];
  const double highlight_e = (std::max(light.highlight_e_per_s, 0.0) + dark_e_per_s(gain, limits)) * time_s;
  return highlight_e <= (1 + good_highlight) * highlight_limit_e(gain, limits) &&
         midtone_snr(setting, light, gains, limits) >= (1 - tolerance) * best.snr;
}

}  // namespace lowlux::isp
