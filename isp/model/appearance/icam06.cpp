#include "isp/model/appearance/icam06.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "isp/model/appearance/bracketed_root.h"
#include "isp/model/appearance/hunt.h"
#include "isp/model/appearance/seen_scene.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

constexpr double semi_saturation = 27.13;  // of CIECAM02
constexpr double max_response = 400;
constexpr double noise = 0.1;
constexpr double min_white_cd_m2 = 1e-6;
constexpr double daylight_white_cd_m2 = 318.31;

/// Holds what depends on the state alone.
struct Compression {
  double level_per_cd_m2;  // F_L / Y_w
  RodAdaptation rods;
  double scotopic_white_cd_m2;
  double power;
  Icam06Variant variant;
};

Compression compression_of(const Icam06State& state) {
  const double white = std::max(state.white_cd_m2, min_white_cd_m2), adaptation = 0.2 * white;
  const bool paper = state.variant == Icam06Variant::paper;
  return {luminance_level_factor(adaptation) / white, rod_adaptation(scotopic_ratio_of_equal_energy * adaptation),
          paper ? std::max(state.scotopic_white_cd_m2, min_white_cd_m2) : 5 * adaptation, state.power, state.variant};
}

double saturating(double x, double power) {
  const double raised = std::pow(x, power);
  return raised / (semi_saturation + raised);
}

double rods_of(const Compression& c, double s_cd_m2) {
  const double s = s_cd_m2 / c.scotopic_white_cd_m2;
  const bool paper = c.variant == Icam06Variant::paper;
  const double bleaching = 0.5 / (1 + 0.3 * std::pow(c.rods.u * s, paper ? 0.3 : 3.0)) + 0.5 / (1 + 5 * c.rods.u);
  return 3.05 * bleaching * max_response * saturating(c.rods.f_ls * s, c.power) + (paper ? 0.3 : 0.03);
}

double expanded(const Compression& c, double response) {
  const double signal = response - noise;
  const double share = std::min(std::fabs(signal) / max_response, 1 - 1e-6);
  return std::copysign(std::pow(semi_saturation * share / (1 - share), 1 / c.power) / c.level_per_cd_m2, signal);
}

const Matrix3& hpe_to_xyz() {
  static const Matrix3 matrix = *inverse(xyz_to_hpe);
  return matrix;
}

}  // namespace

Icam06Response icam06_compress(const Vector3& xyz_cd_m2, const Icam06State& state) {
  const Compression c = compression_of(state);
  const Vector3 hpe = xyz_to_hpe * xyz_cd_m2;
  Icam06Response out;
  out.rods = rods_of(c, std::fabs(xyz_cd_m2[1]));
  Vector3 sum{};
  for (int i = 0; i < 3; ++i) {
    const double response = max_response * saturating(c.level_per_cd_m2 * std::fabs(hpe[i]), c.power);
    out.cones[i] = std::copysign(response, hpe[i]) + noise;
    sum[i] = out.cones[i] + out.rods;
  }
  out.xyz_tc = hpe_to_xyz() * sum;
  return out;
}

Vector3 icam06_expand(const Vector3& xyz_tc, const Icam06State& state) {
  assert(state.variant == Icam06Variant::paper);
  const Compression c = compression_of(state);
  const Vector3 response = xyz_to_hpe * xyz_tc;
  const auto without_rods = [&](double rods) {
    Vector3 hpe{};
    for (int i = 0; i < 3; ++i) hpe[i] = expanded(c, response[i] - rods);
    return hpe_to_xyz() * hpe;
  };
  const auto excess = [&](double s) { return without_rods(rods_of(c, s))[1] - s; };
  const Evaluated none{0, excess(0)};
  if (!(none.f > 0)) return without_rods(rods_of(c, 0));
  const double tolerance = 1e-15 * c.scotopic_white_cd_m2;
  return without_rods(rods_of(c, bracketed_root(excess, none, {none.f, excess(none.f)}, tolerance)));
}

namespace {

Result<ColourMap> icam06_map(const ViewingConditions& conditions) {
  const auto scene = seen_scene(conditions);
  if (!scene) return tl::make_unexpected(scene.error());
  const double white_cd_m2 = std::min(scene->white_cd_m2, daylight_white_cd_m2);
  const Icam06State seen{.white_cd_m2 = white_cd_m2, .scotopic_white_cd_m2 = white_cd_m2};
  const Icam06State by_day{.white_cd_m2 = daylight_white_cd_m2, .scotopic_white_cd_m2 = daylight_white_cd_m2};
  const Vector3 white = xyz_to_hpe * scene->white;
  const Matrix3 adapt = hpe_to_xyz() * diagonal3({1 / white[0], 1 / white[1], 1 / white[2]}) * xyz_to_hpe;
  const Matrix3 scene_cd_m2 = white_cd_m2 * adapt;
  const Matrix3 from_day_cd_m2 = *inverse(daylight_white_cd_m2 * adapt);
  return colour_map(
      [seen, by_day, scene_cd_m2, from_day_cd_m2, is_day = white_cd_m2 == daylight_white_cd_m2](const Vector3& xyz) {
        if (is_day) return xyz;
        return from_day_cd_m2 * icam06_expand(icam06_compress(scene_cd_m2 * xyz, seen).xyz_tc, by_day);
      });
}

}  // namespace

AppearanceModel icam06_appearance() {
  return {.name = "icam06",
          .source = "Kuang, Johnson & Fairchild 2007",
          .needs = "luminance of the white; the local contrast of the model needs the whole image and is not applied",
          .limits = "compresses tones, which darkens the image; rods add grey, so colours fade but do not turn blue",
          .valid_from_cd_m2 = 1e-3,
          .valid_to_cd_m2 = 1e5,
          .at = icam06_map};
}

}  // namespace lowlux::isp
