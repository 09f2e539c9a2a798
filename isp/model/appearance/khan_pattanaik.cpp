#include "isp/model/appearance/khan_pattanaik.h"

#include <algorithm>
#include <cmath>

#include "isp/model/appearance/seen_scene.h"

namespace lowlux::isp {
namespace {

constexpr double n = 0.73;

}  // namespace

NakaRushton khan_rods(double adaptation_cd_m2) {
  const double g = adaptation_cd_m2, j = 1 / (5e5 * g + 1), j2 = j * j;
  const double sensitivity = 19000 * j2 * g + 0.2615 * std::pow(1 - j2, 4) * std::pow(g, 1.0 / 6.0);
  return {2.5874 * g / sensitivity, 0.04 / (0.04 + g)};
}

NakaRushton khan_cones(double adaptation_cd_m2) {
  const double g = adaptation_cd_m2, k4 = std::pow(1 / (5 * g + 1), 4);
  const double sensitivity = k4 * g + 0.171 * (1 - k4) * (1 - k4) * std::cbrt(g);
  return {12.9223 * g / sensitivity, 2e6 / (2e6 + g)};
}

double khan_response(const NakaRushton& receptor, double intensity) {
  const double power = std::pow(std::max(0.0, intensity), n);
  return receptor.bleaching * power / (power + std::pow(receptor.half_saturation, n));
}

double khan_intensity(const NakaRushton& receptor, double response) {
  const double share = std::clamp(response / receptor.bleaching, 0.0, 1 - 1e-9);
  return receptor.half_saturation * std::pow(share / (1 - share), 1 / n);
}

double khan_s_cone_excitation(double scotopic_cd_m2) {
  const double rods = khan_response(khan_rods(moonlight_adaptation_cd_m2), scotopic_cd_m2);
  return khan_intensity(khan_cones(moonlight_adaptation_cd_m2), rod_fraction_of_s_cones * rods);
}

namespace {

Result<ColourMap> khan_pattanaik_map(const ViewingConditions& conditions) {
  const auto scene = seen_scene(conditions);
  if (!scene) return tl::make_unexpected(scene.error());
  const double white_s = (xyz_to_hpe * scene->white)[2];
  Vector3 s_cones = *inverse(xyz_to_hpe) * Vector3{0, 0, white_s};
  s_cones[1] = 0;  // S cones do not contribute to luminance, except for rounding of the matrix
  return colour_map([scene = *scene, s_cones](const Vector3& xyz) {
    const double m = scene.adaptation_m, luminance = relative_mesopic(scene, xyz);
    const double rods_cd_m2 = relative_scotopic(scene, xyz) * scene.white_scotopic * scene.white_cd_m2;
    const double s = (1 - m) * khan_s_cone_excitation(rods_cd_m2) / scene.white_cd_m2;
    Vector3 out{};
    for (int i = 0; i < 3; ++i) {
      out[i] = luminance * scene.white[i] + m * (xyz[i] - xyz[1] * scene.white[i]) + s * s_cones[i];
    }
    return out;
  });
}

}  // namespace

AppearanceModel khan_pattanaik_appearance() {
  return {.name = "khan_pattanaik",
          .source = "Khan & Pattanaik 2004",
          .needs = "luminance of the scene",
          .limits =
              "made for moonlight; the mixture with daylight and the luminance follow CIE 191, because the paper does "
              "not define them",
          .valid_from_cd_m2 = 1e-3,
          .valid_to_cd_m2 = 0.3,
          .at = khan_pattanaik_map};
}

}  // namespace lowlux::isp
