#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "isp/model/appearance/entropy_model.h"
#include "isp/model/appearance/seen_scene.h"
#include "isp/model/cie_data.h"
#include "isp/model/mesopic.h"
#include "isp/model/spectral_lift.h"

namespace lowlux::isp {
namespace {

constexpr Xyz display_white{0.95047, 1, 1.08883};  // of ViewingConditions{}
constexpr double largest_value = 1e300;            // beyond, factors above 1 could leave double

constexpr Xyz scaled(const Xyz& c, double s) { return {s * c.x, s * c.y, s * c.z}; }

/// Power of the smoothest spectrum of a colour with Y > 0, of its nearest liftable chromaticity at the same Y.
std::optional<NodePower> power_of(const Xyz& colour) {
  const std::optional<Xy> seen = xy_of(colour);
  if (!seen) return std::nullopt;
  Xy xy = liftable(*seen);
  if (!(xy == *seen)) {  // a hair inside of the border, so that lift() finds it there
    constexpr double inside = 1 - 1e-9;
    xy = {white_e.x + inside * (xy.x - white_e.x), white_e.y + inside * (xy.y - white_e.y)};
  }
  const std::optional<Xyz> light = xyz_of(xy, colour.y);
  if (!light) return std::nullopt;
  const std::optional<Spectrum> spectrum = lift(*light);
  if (!spectrum) return std::nullopt;
  constexpr int first = 2;  // lifted spectra begin at 380 nm
  static_assert(lift_wavelength_nm(first) == entropy_wavelength_nm(0));
  NodePower power{};
  for (int i = 0; i < entropy_nodes; ++i) power[i] = spectrum->values()[i + first];
  return power;
}

double total(const NodePower& power) {
  double sum = 0;
  for (const double value : power) sum += value;
  return sum;
}

/// Scotopic luminance of a power per 5 nm.
double scotopic_of(const NodePower& power) {
  double sum = 0;
  for (int i = 0; i < entropy_nodes; ++i) sum += power[i] * scotopic_observer().at(entropy_wavelength_nm(i));
  return 5 * scotopic_efficacy_lm_w * sum;
}

struct EntropyMap {
  EntropyModel model;
  PixelPower power = PixelPower::lifted;
  double m = 0;
  double white_luminance = 1;  // L_mes of the white of Y = 1
  Matrix3 to_display = identity3();

  std::optional<MaxEntropyFit<3>> fit(const NodePower& light, double luminance) const {
    const Vector3 eta = entropy_moments(model, light);
    if (power == PixelPower::lifted) return entropy_fit(model, eta);
    const double whole = total(light) * 5;
    return entropy_fit_of_luminance(model, {eta[0] * whole, eta[1] * whole, eta[2] * whole},
                                    luminance / luminous_efficacy_lm_w);
  }

  /// XYZ of the spectrum seen, not yet for the display, of any luminance; nullopt if there is no such spectrum.
  std::optional<Xyz> appearance(const NodePower& light, double luminance) const {
    const auto found = fit(light, luminance);
    if (!found) return std::nullopt;
    return xyz_of(model, *found);
  }

  Xyz operator()(const Xyz& colour) const {
    if (!std::isfinite(colour.x) || !std::isfinite(colour.y) || !std::isfinite(colour.z)) return {};
    const double size = std::max({std::fabs(colour.x), std::fabs(colour.y), std::fabs(colour.z)});
    if (size == 0) return {};
    const double scale = std::min(size, largest_value);
    return scaled(of_size_one({colour.x / size, colour.y / size, colour.z / size}), scale);
  }

 private:
  Xyz of_size_one(const Xyz& colour) const {
    const Xyz grey = scaled(display_white, colour.y);
    if (!(colour.y > 0)) return grey;
    const std::optional<NodePower> light = power_of(colour);
    if (!light) return grey;
    const double luminance = mesopic_luminance_cd_m2(m, {colour.y, scotopic_of(*light)}) / white_luminance;
    const std::optional<Xyz> seen = appearance(*light, colour.y);
    const Vector3 shown = seen ? to_display * vector_of(*seen) : Vector3{};
    if (!(shown[1] > 0)) return scaled(display_white, luminance);
    return scaled(xyz_of(shown), luminance / shown[1]);
  }
};

bool positive(double value) { return value > 0 && std::isfinite(value); }

}  // namespace

Result<ColourMap> entropy_colour_map(const ViewingConditions& conditions, const EntropyOptions& options) {
  const Result<SeenScene> scene = seen_scene(conditions);
  if (!scene) return tl::make_unexpected(scene.error());
  const double m = scene->adaptation_m;
  const auto no_white = [] {
    return fail(ErrorCode::invalid_argument, "the white has a chromaticity no light can have; give its X, Y and Z");
  };
  const std::optional<Xy> white_xy = xy_of(conditions.white);
  if (!positive(conditions.white.y) || !white_xy || !(liftable(*white_xy) == *white_xy)) return no_white();
  const std::optional<NodePower> white = power_of(scaled(conditions.white, 1 / conditions.white.y));
  if (!white) return no_white();
  Result<EntropyModel> model = entropy_model(m, *white, options);
  if (!model) return tl::make_unexpected(model.error());
  EntropyMap map{.model = std::move(*model), .power = options.power, .m = m};
  map.white_luminance = mesopic_luminance_cd_m2(m, {1, scotopic_of(*white)});
  const std::optional<Xyz> seen = map.appearance(*white, 1);
  const std::optional<Xy> from = seen ? xy_of(*seen) : std::nullopt;
  const auto to_display = from ? bradford_adaptation(*from, *xy_of(display_white)) : std::nullopt;
  if (!to_display) return no_white();
  map.to_display = *to_display;
  return ColourMap(std::move(map));
}

AppearanceModel entropy_appearance() {
  return {.name = "entropy",
          .source = "Clark & Skaff 2009, with rods",
          .needs = "luminance and S/P of the adaptation field; the noise of cone responses if it is known",
          .limits = "spectra are the smoothest of their colours; no lightness beyond mesopic luminance, no acuity",
          .valid_from_cd_m2 = 0.025,  // five times the adaptation fields of CIE 191, 0.005 to 5 cd/m2
          .valid_to_cd_m2 = 25,
          .at = [](const ViewingConditions& conditions) {
            return entropy_colour_map(conditions, {.noise_covariance = conditions.noise_covariance});
          }};
}

}  // namespace lowlux::isp
