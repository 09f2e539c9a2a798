#include "isp/model/appearance/entropy_model.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "isp/base/text.h"
#include "isp/model/appearance/seen_scene.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_lift.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

constexpr double node_width_nm = 5;
constexpr double smallest_adaptive_gamma =
    1e-4;                                // responses are matched; below it, fits of impossible responses are slow
constexpr double min_gamma = 1e-12;      // limit of fit_max_entropy
constexpr Vector3 rod_weights{3, 3, 5};  // W of thesis Eq. 5.8
constexpr int luminance_rounds = 3;

/// Returns the CIE 1931 functions at the nodes.
const std::array<Vector3, entropy_nodes>& matching_functions() {
  static const std::array<Vector3, entropy_nodes> all = [] {
    std::array<Vector3, entropy_nodes> out{};
    for (int i = 0; i < entropy_nodes; ++i) {
      for (int c = 0; c < 3; ++c) out[i][c] = cie_1931_observer()[c].at(entropy_wavelength_nm(i));
    }
    return out;
  }();
  return all;
}

SpectralBasis<3> basis_of(ConeSet set, double rod_fraction) {
  const std::array<Spectrum, 3> cones = cone_fundamentals(set);
  SpectralBasis<3> basis;
  basis.f.resize(entropy_nodes);
  basis.weight_nm.assign(entropy_nodes, node_width_nm);
  for (int i = 0; i < entropy_nodes; ++i) {
    const double nm = entropy_wavelength_nm(i), rods = scotopic_observer().at(nm);
    for (int c = 0; c < 3; ++c) basis.f[i][c] = cones[c].at(nm) + rod_fraction * rod_weights[c] * rods;
  }
  return basis;
}

double sum_of(const NodePower& power) {
  double sum = 0;
  for (const double value : power) sum += value;
  return sum;
}

Vector3 moments_of(const SpectralBasis<3>& basis, const NodePower& power) {
  Vector3 sum{};
  for (int i = 0; i < entropy_nodes; ++i) {
    for (int c = 0; c < 3; ++c) sum[c] += power[i] * basis.f[i][c];
  }
  const double whole = sum_of(power);
  for (double& value : sum) value /= whole;
  return sum;
}

Result<void> check_covariance(const Matrix3& covariance) {
  const double trace = covariance[0][0] + covariance[1][1] + covariance[2][2];
  const auto refuse = [](const std::string& expected) {
    return fail(ErrorCode::invalid_argument, "the noise covariance of X, Y and Z must be " + expected +
                                                 "; give one of three channels that each have noise");
  };
  if (!std::isfinite(trace) || !(trace > 0)) return refuse("finite with a positive trace, found " + number_text(trace));
  const Matrix3 s = 3 / trace * covariance;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < i; ++j) {
      if (!(std::fabs(s[i][j] - s[j][i]) <= 1e-9)) return refuse("symmetric");
    }
  }
  const double second = s[1][1] - s[0][1] * s[0][1] / s[0][0];
  const double mixed = s[1][2] - s[0][1] * s[0][2] / s[0][0];
  const double third = s[2][2] - s[0][2] * s[0][2] / s[0][0] - mixed * mixed / second;
  if (!(s[0][0] > 1e-12 && second > 1e-12 && third > 1e-12)) return refuse("positive definite");
  return {};
}

void carry_noise(const EntropyOptions& options, EntropyModel& model) {
  if (!options.noise_covariance) return;
  const Matrix3 to_eta = diagonal3(model.adaptation) * response_matrix(model.measured);
  model.noise = to_eta * *options.noise_covariance * transposed(to_eta);
}

}  // namespace

double entropy_weight(double m) { return std::max(2 * (1 - m), smallest_adaptive_gamma); }

double entropy_rod_fraction(double m) { return std::expm1(1 - m) / (std::numbers::e - 1); }

Result<EntropyModel> entropy_model(double m, const NodePower& white, const EntropyOptions& options) {
  assert(m >= 0 && m <= 1);
  EntropyModel model{.measured = basis_of(options.cones, entropy_rod_fraction(m)),
                     .explained = {},
                     .gamma = options.gamma_fixed.value_or(entropy_weight(m))};
  if (!(model.gamma >= min_gamma) || !std::isfinite(model.gamma)) {
    return fail(ErrorCode::invalid_argument,
                "the weight of entropy must be 1e-12 or more, found " + number_text(model.gamma));
  }
  if (!(sum_of(white) > 0) || !std::isfinite(sum_of(white))) {
    return fail(ErrorCode::invalid_argument, "the white must have power between 390 and 730 nm");
  }
  if (options.noise_covariance) {
    if (const auto checked = check_covariance(*options.noise_covariance); !checked) {
      return tl::make_unexpected(checked.error());
    }
  }
  if (options.variant == EntropyVariant::thesis) {
    model.explained = model.measured;
    carry_noise(options, model);
    return model;
  }
  model.explained = basis_of(options.cones, 0);
  const Vector3 seen = moments_of(model.measured, white), by_cones = moments_of(model.explained, white);
  for (int c = 0; c < 3; ++c) {
    if (!(seen[c] > 0 && by_cones[c] > 0)) {
      return fail(ErrorCode::invalid_argument, "the white must be seen by all three cones");
    }
    model.adaptation[c] = by_cones[c] / seen[c];
  }
  carry_noise(options, model);
  return model;
}

Vector3 entropy_moments(const EntropyModel& model, const NodePower& power) {
  return diagonal3(model.adaptation) * moments_of(model.measured, power);
}

std::optional<MaxEntropyFit<3>> entropy_fit(const EntropyModel& model, const Vector3& eta, double luminance_variance) {
  Matrix3 inverse_a = identity3();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) inverse_a[i][j] += 2 * luminance_variance / model.gamma * model.noise[i][j];
  }
  return fit_max_entropy<3>(model.explained, eta, inverse_a, model.gamma);
}

std::optional<MaxEntropyFit<3>> entropy_fit_of_luminance(const EntropyModel& model, const Vector3& responses,
                                                         double luminance, double noise_to_signal) {
  NodePower even;
  even.fill(1);
  double luminance_of_fit = 0;  // luminance at power 1
  for (const Vector3& f : matching_functions()) luminance_of_fit += f[1] / entropy_nodes;
  std::optional<MaxEntropyFit<3>> fit;
  for (int round = 0; round < luminance_rounds; ++round) {
    const double power = luminance / luminance_of_fit;
    const double noise = noise_to_signal * luminance_of_fit;
    fit = entropy_fit(model, {responses[0] / power, responses[1] / power, responses[2] / power}, noise * noise);
    if (!fit) break;
    luminance_of_fit = xyz_of(model, *fit).y;
  }
  return fit;
}

Xyz xyz_of(const EntropyModel& model, const MaxEntropyFit<3>& fit) {
  Vector3 sum{};
  for (int i = 0; i < entropy_nodes; ++i) {
    const std::array<double, 3>& f = model.explained.f[i];
    const double z = f[0] * fit.theta[0] + f[1] * fit.theta[1] + f[2] * fit.theta[2];
    const double p = node_width_nm * std::exp(z - fit.psi);
    for (int c = 0; c < 3; ++c) sum[c] += p * matching_functions()[i][c];
  }
  return xyz_of(sum);
}

Matrix3 response_matrix(const SpectralBasis<3>& basis) {
  Matrix3 cross{}, gram{};
  for (int k = 0; k < entropy_nodes; ++k) {
    const Vector3& x = matching_functions()[k];
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        cross[i][j] += basis.f[k][i] * x[j];
        gram[i][j] += x[i] * x[j];
      }
    }
  }
  return cross * *inverse(gram);  // the functions are linearly independent
}

Matrix3 noise_covariance_of_xyz(const ChannelNoise& noise) {
  const Matrix3& m = noise.camera_to_xyz;
  Matrix3 out{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 3; ++k) {
        out[i][j] += m[i][k] * m[j][k] * noise.rgb_per_e[k] * noise.rgb_per_e[k] * noise.variance_e2[k];
      }
    }
  }
  return 1 / out[1][1] * out;
}

namespace {

constexpr Xyz display_white{0.95047, 1, 1.08883};  // of ViewingConditions{}
constexpr double largest_value = 1e300;            // beyond, factors above 1 could leave double

constexpr Xyz scaled(const Xyz& c, double s) { return {s * c.x, s * c.y, s * c.z}; }

/// Returns the power of the smoothest spectrum of a colour with Y > 0, or of its nearest liftable chromaticity at the
/// same Y.
std::optional<NodePower> power_of(const Xyz& colour) {
  const std::optional<Xy> seen = xy_of(colour);
  if (!seen) return std::nullopt;
  Xy xy = liftable(*seen);
  if (!(xy == *seen)) {  // slightly inside of the border, so that lift() accepts it
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

/// Returns the scotopic luminance of a power per 5 nm.
double scotopic_of(const NodePower& power) {
  double sum = 0;
  for (int i = 0; i < entropy_nodes; ++i) sum += power[i] * scotopic_observer().at(entropy_wavelength_nm(i));
  return 5 * scotopic_efficacy_lm_w * sum;
}

struct EntropyMap {
  EntropyModel model;
  PixelPower power = PixelPower::lifted;
  double m = 0;
  double noise_to_signal = 0;
  double white_luminance = 1;  // L_mes of the white of Y = 1
  Matrix3 to_display = identity3();

  std::optional<MaxEntropyFit<3>> fit(const NodePower& light, double luminance) const {
    const Vector3 eta = entropy_moments(model, light);
    const double whole = total(light) * node_width_nm, visible = luminance / luminous_efficacy_lm_w;
    if (power == PixelPower::lifted) {
      const double noise = noise_to_signal * visible / whole;
      return entropy_fit(model, eta, noise * noise);
    }
    return entropy_fit_of_luminance(model, {eta[0] * whole, eta[1] * whole, eta[2] * whole}, visible, noise_to_signal);
  }

  /// Returns the XYZ of the fitted spectrum, before adaptation to the display, of any luminance; nullopt if there is no
  /// such spectrum.
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
  EntropyOptions with_noise = options;
  double noise_to_signal = 0;
  if (conditions.noise) {
    noise_to_signal = conditions.noise->to_signal;
    with_noise.noise_covariance = conditions.noise->covariance;
    if (!(noise_to_signal >= 0) || !std::isfinite(noise_to_signal)) {
      return fail(ErrorCode::invalid_argument,
                  "the ratio of noise to signal must be 0 or more and finite, found " + number_text(noise_to_signal));
    }
  }
  Result<EntropyModel> model = entropy_model(m, *white, with_noise);
  if (!model) return tl::make_unexpected(model.error());
  EntropyMap map{.model = std::move(*model), .power = options.power, .m = m, .noise_to_signal = noise_to_signal};
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
          .needs = "luminance and S/P of the adaptation field; the noise of each pixel if it is known",
          .limits =
              "uses the smoothest spectrum of each colour; models mesopic luminance, but neither lightness nor acuity",
          .valid_from_cd_m2 = 0.025,  // five times the adaptation fields of CIE 191, 0.005 to 5 cd/m2
          .valid_to_cd_m2 = 25,
          .uses_noise = true,
          .at = [](const ViewingConditions& conditions) { return entropy_colour_map(conditions, {}); }};
}

}  // namespace lowlux::isp
