#include "denoise/noise_check.h"

#include <fmt/format.h>

#include <algorithm>

namespace lowlux::denoise {

std::vector<NoiseRemark> remarks_on(const NoiseCheck& check) {
  std::vector<NoiseRemark> out;
  const auto* const negative = std::max_element(check.share_negative.begin(), check.share_negative.end());
  if (*negative > 0.01) {
    constexpr std::array<const char*, 3> names{"red", "green", "blue"};
    out.push_back({NoiseFinding::black_suspicious,
                   fmt::format("the black level is suspicious: {:.0f} % of the {} means lie below it by more than 4 "
                               "standard deviations; the pedestal or the dark charge is too high, measure them anew",
                               100 * *negative, names[negative - check.share_negative.begin()])});
  }
  double least = 1, most_of_least = 0;
  bool measured = false;
  for (const auto& ratio : check.measured_over_model) {
    if (!ratio) continue;
    most_of_least = measured ? std::min(most_of_least, *ratio) : *ratio;
    least = std::min(least, *ratio);
    measured = true;
  }
  if (least < least_ratio) {
    out.push_back({NoiseFinding::noise_below_model,
                   fmt::format("the noise is suspicious: {:.2f} times the variance its model expects; the raw was "
                               "denoised or compressed before, or the gain or the read noise is wrong: calibrate them",
                               least)});
  }
  if (measured && most_of_least > largest_ratio) {
    out.push_back({NoiseFinding::noise_above_model,
                   fmt::format("the noise is suspicious: {:.2f} times the variance its model expects; the gain or the "
                               "read noise is wrong: calibrate them",
                               most_of_least)});
  }
  if (check.windows > 0 && check.share_without_signal > 0.999) {
    out.push_back({NoiseFinding::all_dark,
                   "no part of the picture rises above its dark charge: expose longer, or take the lens cap off"});
  }
  if (check.share_saturated > 0.99) {
    out.push_back({NoiseFinding::all_saturated,
                   fmt::format("{:.1f} % of the sites are saturated: expose less", 100 * check.share_saturated)});
  }
  return out;
}

}  // namespace lowlux::denoise
