#include "isp/model/appearance/seen_scene.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "isp/base/text.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

constexpr double min_cd_m2 = 1e-12, max_cd_m2 = 1e12;
constexpr double max_brightening = 8;
constexpr double max_component = 1e12;

tl::unexpected<Error> refused(const std::string& what, double found, const std::string& expected) {
  return fail(ErrorCode::invalid_argument, what + " must be " + expected + ", found " + number_text(found));
}

bool is_luminance(double value) { return value >= min_cd_m2 && value <= max_cd_m2; }
bool is_positive(double value) { return value > 0 && std::isfinite(value); }

double scotopic(const Vector3& xyz) { return scotopic_luminance(xyz_of(xyz)); }

bool excites_all_cones(const Vector3& white) {
  for (const Matrix3& cones : {xyz_to_hpe, xyz_to_smith_pokorny}) {
    const Vector3 response = cones * white;
    if (!(*std::ranges::min_element(response) > 0)) return false;
  }
  return scotopic(white) > 0;
}

}  // namespace

Result<SeenScene> seen_scene(const ViewingConditions& conditions) {
  const std::string luminance = "within 1e-12 and 1e12 cd/m2";
  if (!is_luminance(conditions.white_cd_m2))
    return refused("the luminance of white", conditions.white_cd_m2, luminance);
  if (!is_luminance(conditions.adaptation())) {
    return refused("the luminance of adaptation", conditions.adaptation(), luminance);
  }
  if (!is_positive(conditions.scotopic_ratio)) return refused("S/P", conditions.scotopic_ratio, "positive and finite");
  if (conditions.colour_temperature_k && !is_positive(*conditions.colour_temperature_k)) {
    return refused("the colour temperature", *conditions.colour_temperature_k, "positive and finite, in kelvin");
  }
  const Xyz& w = conditions.white;
  const Vector3 white{w.x / w.y, 1, w.z / w.y};
  const std::optional<Xy> xy = w.y > 0 ? xy_of(w) : std::nullopt;
  const auto to_d65 = xy && excites_all_cones(white) ? bradford_adaptation(*xy, white_d65) : std::nullopt;
  if (!to_d65) {
    return fail(ErrorCode::invalid_argument,
                "the white is not the colour of a light: it must excite all cones and the rods; found XYZ " +
                    number_text(w.x) + " " + number_text(w.y) + " " + number_text(w.z));
  }
  SeenScene scene;
  scene.white = white;
  scene.white_cd_m2 = conditions.white_cd_m2;
  scene.adaptation_cd_m2 = conditions.adaptation();
  scene.adaptation_m = mesopic_state({scene.adaptation_cd_m2, scene.adaptation_cd_m2 * conditions.scotopic_ratio}).m;
  scene.rod_fraction = rod_fraction(scene.adaptation_m);
  scene.white_scotopic = scotopic(white);
  scene.from_rec709 = *inverse(*to_d65) * *rgb_to_xyz(primaries_rec709);
  scene.to_rec709 = *inverse(scene.from_rec709);
  return scene;
}

double relative_scotopic(const SeenScene& scene, const Vector3& xyz) { return scotopic(xyz) / scene.white_scotopic; }

double relative_mesopic(const SeenScene& scene, const Vector3& xyz) {
  const double r = scene.rod_fraction;
  return (xyz[1] + r * (scotopic(xyz) - xyz[1])) / (1 + r * (scene.white_scotopic - 1));
}

Vector3 with_luminance(const Vector3& xyz, double luminance, const Vector3& white) {
  const bool has_chromaticity = xyz[1] > 0 && luminance > 0;
  const double scale = has_chromaticity ? std::min(luminance / xyz[1], max_brightening) : luminance;
  const Vector3& colour = has_chromaticity ? xyz : white;
  return {scale * colour[0], scale * colour[1], scale * colour[2]};
}

Vector3 within_reach(const Vector3& xyz) {
  Vector3 out{};
  for (int i = 0; i < 3; ++i) out[i] = std::clamp(xyz[i], -max_component, max_component);
  return out;
}

}  // namespace lowlux::isp
