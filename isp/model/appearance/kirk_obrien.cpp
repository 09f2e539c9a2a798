#include "isp/model/appearance/kirk_obrien.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "isp/model/appearance/seen_scene.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

constexpr double per_td = 0.33;  // Cao et al. 2008
constexpr double min_base = 1e-6;

// Filament's constants: sensitivities, the rods' weight in each cone's gain, and its receptors of linear Rec.709.
constexpr Vector3 filament_peak{0.63721, 0.39242, 1.6064};
constexpr Vector3 filament_k{0.2, 0.2, 0.3};
constexpr Matrix3 filament_cones{
    {{7.696847, 18.424824, 2.068096}, {2.431137, 18.697937, 3.012463}, {0.289117, 1.401833, 13.792292}}};
constexpr Vector3 filament_rods{0.466386, 15.564362, 10.059963};
constexpr double filament_scale = 380;
constexpr double filament_per_cd_m2 = 3;  // kappa, from a public calibration

Matrix3 filament_opponent_matrix() {
  constexpr double k3 = 0.6, rw = 0.139, p = 0.6189, k = 45.0 / 10;
  const Matrix3 opponent{{{-(k3 + rw), 1 + k3 * rw, 0}, {p * k3, (1 - p) * k3, 1}, {10 * p, 10 * (1 - p), 0}}};
  Vector3 gain{};
  for (int i = 0; i < 3; ++i) gain[i] = k * filament_k[i] / filament_peak[i];
  return opponent * diagonal3(gain);
}

}  // namespace

OpponentGain kirk_opponent_gain(const ReceptorSignals& seen) {
  constexpr double k1 = 0.25, lmax = 0.637, mmax = 0.392, smax = 1.606, fraction_of_l = 0.619;
  constexpr double r1 = 1.111, r2 = 0.939, r3 = 0.4, r4 = 0.15, x = 15, y = 15, z = 5;
  constexpr Vector3 k{k1, k1, 0.4};
  OpponentGain out;
  for (int i = 0; i < 3; ++i) {
    out.gain[i] = 1 / std::sqrt(std::max(min_base, 1 + per_td * (seen.cones[i] + k[i] * seen.rods)));
  }
  const double l = out.gain[0] / lmax, m = out.gain[1] / mmax, s = out.gain[2] / smax;
  const double w = fraction_of_l * l + (1 - fraction_of_l) * m;
  out.opponent = {x * k1 * (r1 * m - r2 * l) * seen.rods, y * (r3 * s - r4 * w) * seen.rods, z * w * seen.rods};
  return out;
}

OpponentGain filament_opponent_gain(const ReceptorSignals& seen) {
  static const Matrix3 matrix = filament_opponent_matrix();
  OpponentGain out;
  for (int i = 0; i < 3; ++i) {
    const double light = per_td / filament_peak[i] * (seen.cones[i] + filament_k[i] * seen.rods);
    out.gain[i] = 1 / std::sqrt(1 + std::max(0.0, light));
  }
  const Vector3 change = matrix * out.gain;
  for (int i = 0; i < 3; ++i) out.opponent[i] = change[i] * seen.rods;
  return out;
}

Vector3 kirk_cone_change(const OpponentGain& change) {
  const auto& [red, blue, luminance] = change.opponent;
  return {0.5 * (luminance - red), 0.5 * (luminance + red), blue + luminance};
}

Vector3 filament_night(const Vector3& rec709) {
  static const Matrix3 back = *inverse(filament_cones);
  const Vector3 rgb{filament_scale * rec709[0], filament_scale * rec709[1], filament_scale * rec709[2]};
  ReceptorSignals seen{filament_cones * rgb, 0};
  for (int i = 0; i < 3; ++i) seen.rods += filament_rods[i] * rgb[i];
  const Vector3 change = back * kirk_cone_change(filament_opponent_gain(seen));
  Vector3 out{};
  for (int i = 0; i < 3; ++i) out[i] = rec709[i] + change[i] / filament_scale;
  return out;
}

namespace {

Result<ColourMap> kirk_obrien_map(const ViewingConditions& conditions) {
  const auto scene = seen_scene(conditions);
  if (!scene) return tl::make_unexpected(scene.error());
  const double diameter = pupil_diameter_mm(scene->adaptation_cd_m2);
  const double white_td = scene->white_cd_m2 * std::numbers::pi * diameter * diameter / 4;
  const Vector3 white = xyz_to_smith_pokorny * scene->white;
  const Matrix3 to_td =
      diagonal3({white_td / white[0], white_td / white[1], white_td / white[2]}) * xyz_to_smith_pokorny;
  return colour_map([scene = *scene, to_td, from_td = *inverse(to_td), white_td](const Vector3& xyz) {
    const ReceptorSignals seen{to_td * xyz, white_td * relative_scotopic(scene, xyz)};
    const Vector3 change = from_td * kirk_cone_change(kirk_opponent_gain(seen));
    const Vector3 shifted{xyz[0] + change[0], xyz[1] + change[1], xyz[2] + change[2]};
    return with_luminance(shifted, relative_mesopic(scene, xyz), scene.white);
  });
}

Result<ColourMap> filament_map(const ViewingConditions& conditions) {
  const auto scene = seen_scene(conditions);
  if (!scene) return tl::make_unexpected(scene.error());
  return colour_map([scene = *scene](const Vector3& xyz) {
    const double scale = filament_per_cd_m2 * scene.white_cd_m2;
    Vector3 rgb = scene.to_rec709 * xyz;
    for (double& value : rgb) value *= scale;
    Vector3 night = filament_night(rgb);
    for (double& value : night) value /= scale;
    return with_luminance(scene.from_rec709 * night, relative_mesopic(scene, xyz), scene.white);
  });
}

}  // namespace

AppearanceModel kirk_obrien_appearance() {
  return {.name = "kirk_obrien",
          .source = "Kirk & O'Brien 2011",
          .needs = "luminance of the scene and of adaptation",
          .limits =
              "shifts hue only, colours do not fade; with the constants as published white becomes a cyan outside the "
              "spectral locus, so use filament instead; towards daylight the shift decreases only with the square root "
              "of luminance",
          .valid_from_cd_m2 = 0.01,
          .valid_to_cd_m2 = 10,
          .at = kirk_obrien_map};
}

AppearanceModel filament_appearance() {
  return {
      .name = "filament",
      .source = "Kirk & O'Brien 2011 as in google/filament",
      .needs = "luminance of the scene",
      .limits = "like kirk_obrien; made for exposed images, so its scale in cd/m2 is uncertain by a factor of eight",
      .valid_from_cd_m2 = 0.01,
      .valid_to_cd_m2 = 10,
      .at = filament_map};
}

}  // namespace lowlux::isp
