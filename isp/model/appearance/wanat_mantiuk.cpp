#include "isp/model/appearance/wanat_mantiuk.h"

#include <algorithm>
#include <cmath>

#include "isp/model/appearance/seen_scene.h"
#include "isp/model/vision/night_eye.h"

namespace lowlux::isp {
namespace {

constexpr double max_exponent = 4;
constexpr double reference_cd_m2 = 200;

Vector3 scaled(double scale, const Vector3& v) { return {scale * v[0], scale * v[1], scale * v[2]}; }

}  // namespace

double wanat_saturation(double luminance_cd_m2) { return luminance_cd_m2 / (luminance_cd_m2 + half_saturation_cd_m2); }

double wanat_exponent(double from_cd_m2, double to_cd_m2) {
  const double from = wanat_saturation(from_cd_m2), to = wanat_saturation(to_cd_m2);
  if (!(to > 0)) return from > 0 ? max_exponent : 1;
  return std::clamp(from / to, 0.0, max_exponent);
}

Vector3 wanat_saturated(const Vector3& rgb, double exponent, const Vector3& luminance_weights) {
  const double luminance = dot(luminance_weights, rgb);
  if (luminance == 0) return {};
  if (luminance < 0) return scaled(-1, wanat_saturated(scaled(-1, rgb), exponent, luminance_weights));
  const double largest = *std::ranges::max_element(rgb);  // in place of Y: the scale cancels, and nothing overflows
  Vector3 power{}, below{};
  for (int i = 0; i < 3; ++i) {
    power[i] = rgb[i] > 0 ? std::pow(rgb[i] / largest, exponent) : 0;
    below[i] = std::min(exponent, 1.0) * std::min(rgb[i], 0.0);
  }
  Vector3 out = below;
  double positive = 0;
  for (int i = 0; i < 3; ++i) positive += luminance_weights[i] * std::max(rgb[i], 0.0);
  const double scale = positive / dot(luminance_weights, power);
  for (int i = 0; i < 3; ++i) out[i] += scale * power[i];
  const double shown = dot(luminance_weights, out);  // at least the luminance, up to rounding
  return shown > luminance ? scaled(luminance / shown, out) : out;
}

namespace {

Result<ColourMap> wanat_mantiuk_map(const ViewingConditions& conditions) {
  const auto scene = seen_scene(conditions);
  if (!scene) return tl::make_unexpected(scene.error());
  const double exponent = wanat_exponent(scene->adaptation_cd_m2, reference_cd_m2);
  return colour_map([scene = *scene, exponent](const Vector3& xyz) {
    return scene.from_rec709 * wanat_saturated(scene.to_rec709 * xyz, exponent, scene.from_rec709[1]);
  });
}

}  // namespace

AppearanceModel wanat_mantiuk_appearance() {
  return {.name = "wanat_mantiuk",
          .source = "Wanat & Mantiuk 2014",
          .needs = "mean luminance of the scene",
          .limits = "models saturation only: no rods and no shift of hue; luminance does not change",
          .valid_from_cd_m2 = 0.05,
          .valid_to_cd_m2 = 1000,
          .at = wanat_mantiuk_map};
}

}  // namespace lowlux::isp
