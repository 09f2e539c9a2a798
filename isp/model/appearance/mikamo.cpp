#include "isp/model/appearance/mikamo.h"

#include <algorithm>
#include <cmath>

#include "isp/model/appearance/seen_scene.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/spectrum/spectral_lift.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {

MikamoCoefficients mikamo_coefficients(double illuminance_td) {
  const double i = std::max(illuminance_td, 1e-4);
  const auto sigmoid = [&](double height, double scale, double power, double offset) {
    return height / (1 + scale * std::pow(i, -power)) + offset;
  };
  return {
      .shift_nm = {sigmoid(-18.3, 7.2, 0.7, -0.9), sigmoid(-44.6, 35.4, 1.2, 22), sigmoid(43, 9, 1.5, 28)},
      .red_green = {sigmoid(6.69, 2500, 2.65, 0.80), sigmoid(-6.24, 2500, 2.5, -0.77), sigmoid(0.36, 50.02, 1.5, 0.04)},
      .blue_yellow = {sigmoid(0.24, 50.04, 1.7, 0.03), sigmoid(0.42, 1.76, 0.02, 0.14),
                      sigmoid(0.15, 2.80, 0.46, -0.27)}};
}

Matrix3 mikamo_signals(const MikamoCoefficients& coefficients, const std::array<Spectrum, 3>& basis) {
  static const std::array<Spectrum, 3> cones = cone_fundamentals(ConeSet::stockman_sharpe_2000);
  const Matrix3 weights{{{0.6, 0.4, 0}, coefficients.red_green, coefficients.blue_yellow}};
  Matrix3 seen{};
  for (int cone = 0; cone < 3; ++cone) {
    const double shift = coefficients.shift_nm[cone];
    for (int light = 0; light < 3; ++light) {
      seen[cone][light] = integrate(basis[light], [&](double nm) { return cones[cone].at(nm + shift); });
    }
  }
  return weights * seen;
}

Matrix3 mikamo_adapted(const Matrix3& signals) {
  Matrix3 out = signals;
  const auto of_white = [&](int row) { return signals[row][0] + signals[row][1] + signals[row][2]; };
  for (int row = 1; row < 3; ++row) {
    for (int light = 0; light < 3; ++light) out[row][light] -= of_white(row) / of_white(0) * signals[0][light];
  }
  return out;
}

namespace {

const std::array<Spectrum, 3>& rec709_spectra() {
  static const std::array<Spectrum, 3> spectra = [] {
    const Matrix3 to_xyz = *rgb_to_xyz(primaries_rec709);
    const auto primary = [&](int i) { return *lift({to_xyz[0][i], to_xyz[1][i], to_xyz[2][i]}); };
    return std::array<Spectrum, 3>{primary(0), primary(1), primary(2)};
  }();
  return spectra;
}

Result<ColourMap> mikamo_map(const ViewingConditions& conditions) {
  const auto scene = seen_scene(conditions);
  if (!scene) return tl::make_unexpected(scene.error());
  const double td = std::min(retinal_illuminance_td(scene->adaptation_cd_m2), mikamo_reference_td);
  const auto signals_at = [](double illuminance_td) {
    return mikamo_adapted(mikamo_signals(mikamo_coefficients(illuminance_td), rec709_spectra()));
  };
  const Matrix3 matrix =
      scene->from_rec709 * *inverse(signals_at(mikamo_reference_td)) * signals_at(td) * scene->to_rec709;
  return colour_map([matrix](const Vector3& xyz) { return matrix * xyz; });
}

}  // namespace

AppearanceModel mikamo_appearance() {
  return {.name = "mikamo",
          .source = "Mikamo, Slomp, Raytchev, Tamaki & Kaneda 2014",
          .needs = "retinal illuminance",
          .limits =
              "implemented from a secondary source, with our adaptation to the white; spectra are estimated from three "
              "channels, and saturated colours leave the gamut",
          .valid_from_cd_m2 = 0.05,
          .valid_to_cd_m2 = 50,
          .at = mikamo_map};
}

}  // namespace lowlux::isp
