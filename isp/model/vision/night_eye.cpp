#include "isp/model/vision/night_eye.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "isp/model/appearance/hunt.h"
#include "isp/model/appearance/kirk_obrien.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {
namespace {

constexpr double daylight_cd_m2 = 100;
constexpr double light_of_receptors = 3;  // a calibration of filament's receptors for cd/m2; 1.1 to 8.3 are admissible

double saturation(double luminance) { return luminance / (luminance + half_saturation_cd_m2); }

double variance_deg2(double luminance) {
  const double std_deg = std::sqrt(std::numbers::ln10 / 2) / (std::numbers::pi * visual_acuity_cpd(luminance));
  return std_deg * std_deg;
}

double brightness_of_white(double luminance) {
  const RodAdaptation rods = rod_adaptation(scotopic_adaptation(luminance, std::nullopt));
  return 3.05 * hunt_response(luminance_level_factor(luminance)) + rod_signal(rods, 1);
}

}  // namespace

double chroma_fraction(double luminance_cd_m2) {
  if (!(luminance_cd_m2 > 0)) return 0;
  return std::min(1.0, saturation(std::min(luminance_cd_m2, 1e9)) / saturation(daylight_cd_m2));
}

double visual_acuity_cpd(double luminance_cd_m2) {
  constexpr double least = 0.7;
  if (!(luminance_cd_m2 > 0)) return least;
  return std::max(least, 17.25 * std::atan(1.4 * std::log10(luminance_cd_m2) + 0.35) + 25.72);
}

double blur_std_deg(double luminance_cd_m2) {
  return std::sqrt(std::max(0.0, variance_deg2(luminance_cd_m2) - variance_deg2(daylight_cd_m2)));
}

double rod_blue(double luminance_cd_m2) {
  if (!(luminance_cd_m2 > 0)) return 0;
  const double light = light_of_receptors * std::clamp(luminance_cd_m2, 1e-9, 1e9);
  const Vector3 seen = filament_night({light, light, light});
  const Vector3 weight = rgb_to_xyz(primaries_rec709).value()[1];
  const double luminance = weight[0] * seen[0] + weight[1] * seen[1] + weight[2] * seen[2];
  return chroma_fraction(luminance_cd_m2) * (seen[2] / luminance - 1);
}

double apparent_dimming_ev(double luminance_cd_m2) {
  if (!(luminance_cd_m2 < daylight_cd_m2)) return 0;
  const double least = std::max(luminance_cd_m2, 1e-6);
  return std::min(0.0, 3 * std::log2(brightness_of_white(least) / brightness_of_white(daylight_cd_m2)));
}

NightEye night_eye(const LuminancePair& adaptation) {
  const MesopicState state = mesopic_state(adaptation);
  const double seen = state.luminance_cd_m2;
  return {state, chroma_fraction(seen), (1 - state.m) * rod_blue(seen), blur_std_deg(seen)};
}

}  // namespace lowlux::isp
