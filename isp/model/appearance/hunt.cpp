#include "isp/model/appearance/hunt.h"

#include <algorithm>
#include <cmath>

#include "isp/model/appearance/lightness_match.h"
#include "isp/model/appearance/seen_scene.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {

double luminance_level_factor(double adaptation_cd_m2) {
  const double l = 5 * adaptation_cd_m2, k = 1 / (l + 1), k4 = k * k * k * k;
  return 0.2 * k4 * l + 0.1 * (1 - k4) * (1 - k4) * std::cbrt(l);
}

double scotopic_adaptation(double adaptation_cd_m2, std::optional<double> colour_temperature_k) {
  const double factor = colour_temperature_k ? std::cbrt(std::max(0.0, *colour_temperature_k / 4000 - 0.4)) : 1;
  return scotopic_ratio_of_equal_energy * adaptation_cd_m2 * factor;
}

RodAdaptation rod_adaptation(double scotopic_cd_m2) {
  RodAdaptation rods;
  rods.u = 5 * scotopic_cd_m2 / scotopic_ratio_of_equal_energy;
  rods.j = 1e-5 / (rods.u + 1e-5);
  const double j2 = rods.j * rods.j;
  rods.f_ls = 3800 * j2 * rods.u + 0.2 * std::pow(1 - j2, 4) * std::pow(rods.u, 1.0 / 6.0);
  return rods;
}

double rod_bleaching(const RodAdaptation& rods, double relative_scotopic) {
  return 0.5 / (1 + 0.3 * std::pow(rods.u * relative_scotopic, 0.3)) + 0.5 / (1 + 5 * rods.u);
}

double hunt_response(double x) {
  const double power = std::pow(x, 0.73);
  return 40 * power / (power + 2);
}

double rod_signal(const RodAdaptation& rods, double relative_scotopic) {
  const double s = std::max(0.0, relative_scotopic);
  return 3.05 * rod_bleaching(rods, s) * hunt_response(rods.f_ls * s) + 0.3;
}

double hunt_achromatic(double cone_signal, double rod_signal, double background_induction) {
  return background_induction * (cone_signal - 1 + rod_signal - 0.3 + std::sqrt(1 + 0.3 * 0.3));
}

namespace {

AchromaticSignal signal_at(double adaptation_cd_m2, std::optional<double> colour_temperature_k) {
  const double level = luminance_level_factor(adaptation_cd_m2), bleaching = 1e7 / (1e7 + 5 * adaptation_cd_m2);
  const RodAdaptation rods = rod_adaptation(scotopic_adaptation(adaptation_cd_m2, colour_temperature_k));
  return [=](const Vector3& cones, double s) {
    Vector3 response{};
    for (int i = 0; i < 3; ++i) response[i] = bleaching * hunt_response(level * cones[i]) + 1;
    const double cone_signal = 2 * response[0] + response[1] + response[2] / 20 - 3.05 + 1;
    return hunt_achromatic(cone_signal, rod_signal(rods, s), 1);  // N_bb cancels in the ratio
  };
}

Result<ColourMap> hunt_map(const ViewingConditions& conditions) { return lightness_match(conditions, signal_at); }

}  // namespace

AppearanceModel hunt_appearance() {
  return {.name = "hunt",
          .source = "Hunt 1994",
          .needs = "luminance of adaptation; the colour temperature of the light improves it",
          .limits = "models lightness only: chromaticities do not change, so colours do not fade",
          .valid_from_cd_m2 = 1e-3,
          .valid_to_cd_m2 = 1e5,
          .at = hunt_map};
}

}  // namespace lowlux::isp
