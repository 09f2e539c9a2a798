#include "calib/chart/colour_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "isp/model/colour/colour_difference.h"
#include "isp/model/colour/correlated_colour_temperature.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::calib {
namespace {

/// Unknowns of a ColourFit as a sum: camera_to_xyz = sum of theta_k basis_k, then the light's two values if they are
/// fitted.
struct Unknowns {
  std::vector<Matrix3> basis;
  bool light = false;

  Eigen::Index count() const { return static_cast<Eigen::Index>(basis.size()) + (light ? 2 : 0); }
  ColourFit fit(const Eigen::VectorXd& theta) const {
    ColourFit out{};
    for (std::size_t k = 0; k < basis.size(); ++k) {
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
          out.camera_to_xyz[i][j] += theta[static_cast<Eigen::Index>(k)] * basis[k][i][j];
        }
      }
    }
    if (light) out.light = {theta[theta.size() - 2], theta[theta.size() - 1]};
    return out;
  }
};

Matrix3 outer(const Vector3& column, const Vector3& row) {
  return {{{column[0] * row[0], column[0] * row[1], column[0] * row[2]},
           {column[1] * row[0], column[1] * row[1], column[1] * row[2]},
           {column[2] * row[0], column[2] * row[1], column[2] * row[2]}}};
}

Unknowns unknowns_of(const ColourFitOptions& options) {
  Unknowns out;
  out.light = options.uneven_light;
  out.basis.reserve(9);
  const Matrix3 unit = identity3();
  const Vector3& n = options.neutral;
  if (n == Vector3{}) {
    for (const Vector3& to : unit) {
      for (const Vector3& from : unit) out.basis.push_back(outer(to, from));
    }
    return out;
  }
  // One basis matrix maps the neutral to white, and six map it to zero: their rows are orthogonal to it.
  const Eigen::Vector3d neutral(n[0], n[1], n[2]);
  const Eigen::Vector3d first = neutral.unitOrthogonal(), second = neutral.cross(first).normalized();
  const double square = neutral.squaredNorm();
  out.basis.push_back(outer(vector_of(options.white), {n[0] / square, n[1] / square, n[2] / square}));
  for (const Eigen::Vector3d& across : {first, second}) {
    const Vector3 row{across[0] / neutral.norm(), across[1] / neutral.norm(), across[2] / neutral.norm()};
    for (const Vector3& component : unit) out.basis.push_back(outer(component, row));
  }
  return out;
}

/// Returns the weight of a small difference at luminance Y in CIELAB: the slope of the cube root, without its factor
/// 1/3.
double weight_of(const ColourSample& sample) { return std::pow(sample.reference.y, -2.0 / 3); }

bool finite(const ColourSample& s) {
  const double sum =
      s.camera_rgb[0] + s.camera_rgb[1] + s.camera_rgb[2] + s.reference.x + s.reference.y + s.reference.z + s.x + s.y;
  return std::isfinite(sum);
}

Result<void> check(std::span<const ColourSample> samples) {
  if (samples.size() < min_colour_samples) {
    return fail(ErrorCode::insufficient,
                fmt::format("a colour matrix needs {} patches, found {}", min_colour_samples, samples.size()));
  }
  for (const ColourSample& sample : samples) {
    if (!finite(sample) || !(sample.reference.y > 0)) {
      return fail(ErrorCode::insufficient, "a patch's colour is not finite, or its reference has no luminance");
    }
  }
  return {};
}

Result<void> check(const ColourFit& fit) {
  if (!inverse(fit.camera_to_xyz)) {
    return fail(ErrorCode::insufficient, "the colour matrix that fits the patches best is singular");
  }
  const double fall = std::fabs(fit.light.per_x) + std::fabs(fit.light.per_y);
  if (!(fall < 1)) {
    return fail(ErrorCode::insufficient,
                fmt::format("the fitted light changes by {:.0f} % from the middle of the chart to its corner, at most "
                            "100 % are plausible: light the chart evenly",
                            100 * fall));
  }
  return {};
}

struct Solution {
  Eigen::VectorXd theta;
  double condition_number;
};

/// Solves least squares with columns scaled to length 1, so that the condition number depends on the patches and not on
/// units.
Solution solve(Eigen::MatrixXd equations, const Eigen::VectorXd& right) {
  Eigen::VectorXd length = equations.colwise().norm();
  for (Eigen::Index k = 0; k < length.size(); ++k) {
    if (length[k] > 0) equations.col(k) /= length[k];
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(equations, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& singular = svd.singularValues();
  const Eigen::VectorXd scaled = svd.solve(right);
  return {scaled.cwiseQuotient(length.cwiseMax(1e-300)), singular[0] / singular[singular.size() - 1]};
}

Solution least_squares(const Unknowns& unknowns, std::span<const ColourSample> samples) {
  const auto rows = static_cast<Eigen::Index>(3 * samples.size());
  Eigen::MatrixXd equations = Eigen::MatrixXd::Zero(rows, unknowns.count());
  Eigen::VectorXd right(rows);
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const ColourSample& sample = samples[s];
    const double weight = weight_of(sample);
    const Vector3 reference = vector_of(sample.reference);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto row = static_cast<Eigen::Index>(3 * s + i);
      for (std::size_t k = 0; k < unknowns.basis.size(); ++k) {
        equations(row, static_cast<Eigen::Index>(k)) = weight * (unknowns.basis[k] * sample.camera_rgb)[i];
      }
      if (unknowns.light) {
        equations(row, unknowns.count() - 2) = -weight * reference[i] * sample.x;
        equations(row, unknowns.count() - 1) = -weight * reference[i] * sample.y;
      }
      right[row] = weight * reference[i];
    }
  }
  return solve(std::move(equations), right);
}

Eigen::VectorXd residuals(const Unknowns& unknowns, const Eigen::VectorXd& theta, std::span<const ColourSample> samples,
                          const isp::Xyz& white) {
  const std::vector<double> errors = colour_errors(unknowns.fit(theta), samples, white);
  return Eigen::Map<const Eigen::VectorXd>(errors.data(), static_cast<Eigen::Index>(errors.size()));
}

/// Minimises by Levenberg's method with Marquardt's scaling. Each accepted step lowers the sum of squares, so the
/// result is never worse than the start.
Eigen::VectorXd minimise_ciede2000(const Unknowns& unknowns, Eigen::VectorXd theta,
                                   std::span<const ColourSample> samples, const isp::Xyz& white) {
  constexpr int max_steps = 60;
  constexpr double relative_step = 1e-6, settled = 1e-9;
  Eigen::VectorXd residual = residuals(unknowns, theta, samples, white);
  double damping = 1e-3;
  const double scale = theta.head(static_cast<Eigen::Index>(unknowns.basis.size())).cwiseAbs().maxCoeff();
  for (int step = 0; step < max_steps && damping < 1e12; ++step) {
    Eigen::MatrixXd slope(residual.size(), theta.size());
    for (Eigen::Index k = 0; k < theta.size(); ++k) {
      const bool of_light = k >= static_cast<Eigen::Index>(unknowns.basis.size());
      const double h = relative_step * (of_light ? 1 : scale);
      Eigen::VectorXd beside = theta;
      beside[k] += h;
      slope.col(k) = (residuals(unknowns, beside, samples, white) - residual) / h;
    }
    const Eigen::MatrixXd normal = slope.transpose() * slope;
    const Eigen::VectorXd gradient = slope.transpose() * residual;
    Eigen::MatrixXd damped = normal;
    damped.diagonal() += damping * normal.diagonal();
    const Eigen::VectorXd tried = theta - damped.ldlt().solve(gradient);
    const Eigen::VectorXd tried_residual =
        tried.allFinite() ? residuals(unknowns, tried, samples, white) : Eigen::VectorXd::Constant(1, HUGE_VAL);
    const double before = residual.squaredNorm(), after = tried_residual.squaredNorm();
    if (!(after < before)) {
      damping *= 8;
      continue;
    }
    theta = tried;
    residual = tried_residual;
    damping /= 4;
    if (before - after <= settled * before) break;
  }
  return theta;
}

}  // namespace

Result<ColourFit> fit_colour(std::span<const ColourSample> samples, const ColourFitOptions& options) {
  if (auto good = check(samples); !good) return tl::make_unexpected(good.error());
  const Unknowns unknowns = unknowns_of(options);
  Solution solution = least_squares(unknowns, samples);
  if (!(solution.condition_number <= worst_colour_condition)) {
    return fail(ErrorCode::insufficient, fmt::format("the patches do not separate the three channels: the condition "
                                                     "number of the equations is {:.3g}, at most {:g} is allowed",
                                                     solution.condition_number, worst_colour_condition));
  }
  if (options.minimise_ciede2000) {
    solution.theta = minimise_ciede2000(unknowns, std::move(solution.theta), samples, options.white);
  }
  ColourFit out = unknowns.fit(solution.theta);
  out.condition_number = solution.condition_number;
  if (auto good = check(out); !good) return tl::make_unexpected(good.error());
  return out;
}

isp::Xyz predicted(const ColourFit& fit, const ColourSample& sample) {
  const double light = fit.light.at(sample.x, sample.y);
  const Vector3 xyz = fit.camera_to_xyz * sample.camera_rgb;
  return {xyz[0] / light, xyz[1] / light, xyz[2] / light};
}

std::vector<double> colour_errors(const ColourFit& fit, std::span<const ColourSample> samples, const isp::Xyz& white) {
  std::vector<double> out(samples.size());
  std::transform(samples.begin(), samples.end(), out.begin(), [&](const ColourSample& sample) {
    return isp::ciede2000(isp::lab_of(predicted(fit, sample), white), isp::lab_of(sample.reference, white));
  });
  return out;
}

Result<std::vector<double>> cross_validated(std::span<const ColourSample> samples, const ColourFitOptions& options) {
  std::vector<double> out;
  out.reserve(samples.size());
  for (std::size_t left_out = 0; left_out < samples.size(); ++left_out) {
    std::vector<ColourSample> others(samples.begin(), samples.end());
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(left_out));
    const auto fit = fit_colour(others, options);
    if (!fit) return tl::make_unexpected(fit.error());
    out.push_back(colour_errors(*fit, samples.subspan(left_out, 1), options.white)[0]);
  }
  return out;
}

Result<ColourFit> scaled_to_chart(const Matrix3& camera_to_xyz, std::span<const ColourSample> samples,
                                  const ColourFitOptions& options) {
  if (auto good = check(samples); !good) return tl::make_unexpected(good.error());
  const auto rows = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd equations(rows, options.uneven_light ? 3 : 1);
  Eigen::VectorXd right(rows);
  for (Eigen::Index s = 0; s < rows; ++s) {
    const ColourSample& sample = samples[static_cast<std::size_t>(s)];
    const double weight = weight_of(sample);
    equations(s, 0) = weight * (camera_to_xyz * sample.camera_rgb)[1];
    if (options.uneven_light) {
      equations(s, 1) = -weight * sample.reference.y * sample.x;
      equations(s, 2) = -weight * sample.reference.y * sample.y;
    }
    right[s] = weight * sample.reference.y;
  }
  const Solution solution = solve(std::move(equations), right);
  ColourFit out{solution.theta[0] * camera_to_xyz, {}, solution.condition_number};
  if (options.uneven_light) out.light = {solution.theta[1], solution.theta[2]};
  if (!(solution.theta[0] > 0)) {
    return fail(ErrorCode::insufficient,
                "the fitted matrix does not give the patches of the chart positive luminances");
  }
  if (auto good = check(out); !good) return tl::make_unexpected(good.error());
  return out;
}

Result<ColourCalibration> calibration_of(const ColourFit& fit, const isp::Xyz& white) {
  const auto to_camera = inverse(fit.camera_to_xyz);
  const auto white_xy = isp::xy_of(white);
  const auto temperature = white_xy ? isp::colour_temperature_of(*white_xy) : std::nullopt;
  const auto to_d50 = white_xy ? isp::bradford_adaptation(*white_xy, isp::white_d50) : std::nullopt;
  const Vector3 neutral = to_camera ? *to_camera * vector_of(white) : Vector3{};
  const double largest = *std::max_element(neutral.begin(), neutral.end());
  if (!temperature || !to_d50 || !(*std::min_element(neutral.begin(), neutral.end()) > 0)) {
    return fail(ErrorCode::insufficient,
                "by the fitted matrix a channel of white is not positive: is --illuminant right?");
  }
  ColourCalibration out;
  out.cct_k = temperature->cct_k;
  out.xyz_to_camera = (1 / largest) * *to_camera;
  out.forward = (1 / white.y) * (*to_d50 * fit.camera_to_xyz * diagonal3(neutral));
  return out;
}

ErrorSummary summary_of(std::vector<double> errors) {
  if (errors.empty()) return {};
  std::sort(errors.begin(), errors.end());
  const std::size_t n = errors.size();
  return {std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(n),
          (errors[(n - 1) / 2] + errors[n / 2]) / 2, errors.back()};
}

Result<std::array<isp::Xyz, 24>> chart_reference(const Spectrum& light) {
  const auto patches = isp::spectra_of(isp::SpectrumSet::colorchecker);
  std::array<isp::Xyz, 24> out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto xyz = isp::xyz_of_reflectance(patches[i].spectrum, light);
    if (!xyz) return fail(ErrorCode::insufficient, "the light has no luminance");
    out[i] = *xyz;
  }
  return out;
}

}  // namespace lowlux::calib
