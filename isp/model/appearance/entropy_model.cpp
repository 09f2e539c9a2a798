#include "isp/model/appearance/entropy_model.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <string>

#include "isp/base/number_text.h"
#include "isp/model/cie_data.h"
#include "isp/model/mesopic.h"

namespace lowlux::isp {
namespace {

constexpr double node_width_nm = 5;
constexpr double smallest_adaptive_gamma = 1e-4;  // responses are matched; below, those of no light take long
constexpr double least_gamma = 1e-12;             // of fit_max_entropy
constexpr Vector3 rod_weights{3, 3, 5};           // W of thesis Eq. 5.8
constexpr int luminance_rounds = 3;

/// The CIE 1931 functions at the nodes.
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

SpectralBasis<3> basis_of(ConeSet set, double rod_share) {
  const std::array<Spectrum, 3> cones = cone_fundamentals(set);
  SpectralBasis<3> basis;
  basis.f.resize(entropy_nodes);
  basis.weight_nm.assign(entropy_nodes, node_width_nm);
  for (int i = 0; i < entropy_nodes; ++i) {
    const double nm = entropy_wavelength_nm(i), rods = scotopic_observer().at(nm);
    for (int c = 0; c < 3; ++c) basis.f[i][c] = cones[c].at(nm) + rod_share * rod_weights[c] * rods;
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

/// A^-1 = 3 / trace(S) S of a covariance S, so that A = I where noise is the same in all directions.
Result<Matrix3> inverse_weight(const Matrix3& covariance) {
  const double trace = covariance[0][0] + covariance[1][1] + covariance[2][2];
  const auto refuse = [](const std::string& found) {
    return fail(ErrorCode::invalid_argument, "the noise covariance of cone responses must be " + found +
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
  return s;
}

}  // namespace

double entropy_weight(double m) { return std::max(2 * (1 - m), smallest_adaptive_gamma); }

double entropy_rod_share(double m) { return std::expm1(1 - m) / (std::numbers::e - 1); }

Result<EntropyModel> entropy_model(double m, const NodePower& white, const EntropyOptions& options) {
  assert(m >= 0 && m <= 1);
  EntropyModel model{.measured = basis_of(options.cones, entropy_rod_share(m)),
                     .explained = {},
                     .gamma = options.gamma_fixed.value_or(entropy_weight(m))};
  if (!(model.gamma >= least_gamma) || !std::isfinite(model.gamma)) {
    return fail(ErrorCode::invalid_argument,
                "the weight of entropy must be 1e-12 or more, found " + number_text(model.gamma));
  }
  if (!(sum_of(white) > 0) || !std::isfinite(sum_of(white))) {
    return fail(ErrorCode::invalid_argument, "the white needs power between 390 and 730 nm to compare colours with");
  }
  if (options.noise_covariance) {
    const Result<Matrix3> weight = inverse_weight(*options.noise_covariance);
    if (!weight) return tl::make_unexpected(weight.error());
    model.inverse_a = *weight;
  }
  if (options.variant == EntropyVariant::thesis) {
    model.explained = model.measured;
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
  return model;
}

Vector3 entropy_moments(const EntropyModel& model, const NodePower& power) {
  return diagonal3(model.adaptation) * moments_of(model.measured, power);
}

std::optional<MaxEntropyFit<3>> entropy_fit(const EntropyModel& model, const Vector3& eta) {
  return fit_max_entropy<3>(model.explained, eta, model.inverse_a, model.gamma);
}

std::optional<MaxEntropyFit<3>> entropy_fit_of_luminance(const EntropyModel& model, const Vector3& responses,
                                                         double luminance) {
  NodePower even;
  even.fill(1);
  double luminance_of_fit = 0;  // of power 1
  for (const Vector3& f : matching_functions()) luminance_of_fit += f[1] / entropy_nodes;
  std::optional<MaxEntropyFit<3>> fit;
  for (int round = 0; round < luminance_rounds; ++round) {
    const double power = luminance / luminance_of_fit;
    fit = entropy_fit(model, {responses[0] / power, responses[1] / power, responses[2] / power});
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

Matrix3 cone_matrix(ConeSet cones) {
  const SpectralBasis<3> basis = basis_of(cones, 0);
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

Matrix3 noise_covariance_of_cones(const ChannelNoise& noise, ConeSet cones) {
  const Matrix3 m = cone_matrix(cones) * noise.camera_to_xyz;
  Matrix3 out{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 3; ++k) {
        out[i][j] += m[i][k] * m[j][k] * noise.rgb_per_e[k] * noise.rgb_per_e[k] * noise.variance_e2[k];
      }
    }
  }
  return out;
}

}  // namespace lowlux::isp
