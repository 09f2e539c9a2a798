#include "isp/model/appearance/kwak.h"

#include <algorithm>
#include <cmath>

#include "isp/model/appearance/lightness_match.h"
#include "isp/model/appearance/seen_scene.h"

namespace lowlux::isp {

double ciecam02_response(double level_factor, double cone) {
  const double power = std::pow(level_factor * std::fabs(cone) / 100, 0.42);
  return std::copysign(400 * power / (power + 27.13), cone);
}

double kwak_achromatic(double level_factor, const Vector3& hpe, double rod_signal, double alpha) {
  const auto response = [&](int i) { return ciecam02_response(level_factor, hpe[i]); };
  return 2 * response(0) + response(1) + 0.05 * response(2) + alpha * rod_signal;
}

double kwak_lightness(double achromatic, double achromatic_white, double relative_background, double surround) {
  const double ratio = std::max(0.0, achromatic / achromatic_white);
  return 100 * std::pow(ratio, surround * (1.48 + std::sqrt(relative_background)));
}

namespace {

AchromaticSignal kwak_signal_at(double adaptation_cd_m2, std::optional<double> colour_temperature_k) {
  const double level = luminance_level_factor(adaptation_cd_m2);
  const RodAdaptation rods = rod_adaptation(scotopic_adaptation(adaptation_cd_m2, colour_temperature_k));
  return [=](const Vector3& cones, double s) {
    return kwak_achromatic(level, {100 * cones[0], 100 * cones[1], 100 * cones[2]}, rod_signal(rods, s));
  };
}

Result<ColourMap> kwak_map(const ViewingConditions& conditions) { return lightness_match(conditions, kwak_signal_at); }

}  // namespace

AppearanceModel kwak_appearance() {
  return {.name = "kwak",
          .source = "Kwak, MacDonald & Luo 2003",
          .needs = "luminance of adaptation; the colour temperature of the light improves it",
          .limits =
              "models lightness only: chromaticities do not change; the weight of the rods is not published and "
              "assumed to be 1",
          .valid_from_cd_m2 = 0.1,
          .valid_to_cd_m2 = 1e4,
          .at = kwak_map};
}

}  // namespace lowlux::isp
