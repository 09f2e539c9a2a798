#include "isp/model/colour/chroma_bound.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

namespace lowlux::isp {
namespace {

constexpr double counting_noise_e = 0.05;       // below it integer electrons are distinguished
constexpr double asymptotic_variance_e2 = 1e3;  // from it on the distribution is nearly normal

/// Returns the step of the trapezium rule, whose error is exp(-2 pi D / step) where the integrand is analytic up to the
/// distance D from the real axis: zeros of p lie pi sigma^2 away from it, between two integers.
double step_e(double noise_std_e) {
  return std::min(noise_std_e / 2, std::numbers::pi * noise_std_e * noise_std_e / 3);
}

double log_factorial(double n) {
  int sign = 0;  // sign of the gamma function: lgamma_r is the thread-safe form
  return ::lgamma_r(n + 1, &sign);
}

/// Holds the Poisson probabilities that matter, as logarithms.
struct Counts {
  int first = 0;
  std::vector<double> log_probability;
  int last() const { return first + static_cast<int>(log_probability.size()) - 1; }
};

Counts counts_of(double mean) {
  const double reach = 8 * std::sqrt(mean);
  Counts out;
  out.first = static_cast<int>(std::max(0.0, std::floor(mean - reach - 4)));
  const int last = static_cast<int>(std::ceil(mean + reach + 12));
  out.log_probability.reserve(static_cast<std::size_t>(last) + 1 - static_cast<std::size_t>(out.first));
  for (int j = out.first; j <= last; ++j) {
    out.log_probability.push_back(j * std::log(mean) - mean - log_factorial(j));
  }
  return out;
}

double information_by_quadrature(double mean, double noise) {
  const Counts counts = counts_of(mean);
  const double step = step_e(noise), reach = 8.5 * noise;
  const double begin = counts.first - reach;
  const auto steps = static_cast<int>(std::ceil((counts.last() + reach - begin) / step));
  double sum = 0;
  for (int i = 0; i <= steps; ++i) {
    const double y = begin + i * step;
    const int from = std::max(counts.first, static_cast<int>(std::floor(y - reach - 1)));
    const int to = std::min(counts.last(), static_cast<int>(std::ceil(y + reach + 1)));
    double density = 0, slope = 0;  // p and dp/dlambda, both times sigma sqrt(2 pi)
    for (int j = from; j <= to; ++j) {
      const double z = (y - j) / noise;
      const double part = std::exp(counts.log_probability[static_cast<std::size_t>(j - counts.first)] - 0.5 * z * z);
      density += part;
      slope += part * (j / mean - 1);
    }
    if (density > 0) sum += slope * slope / density;
  }
  return sum * step / (noise * std::sqrt(2 * std::numbers::pi));
}

/// Returns the mean variance of an integer observed with normal noise, all integers being equally probable [e-^2].
double lattice_variance_e2(double noise) {
  if (noise >= 1) return noise * noise;  // accurate to exp(-2 pi^2 sigma^2)
  if (noise < counting_noise_e) return 0;
  const auto steps = static_cast<int>(std::ceil(1 / step_e(noise)));
  const int reach = static_cast<int>(std::ceil(9 * noise)) + 1;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {  // over one period
    const double y = static_cast<double>(i) / steps;
    double density = 0, first = 0, second = 0;
    for (int j = -reach; j <= reach; ++j) {
      const double z = (y - j) / noise;
      const double part = std::exp(-0.5 * z * z);
      density += part;
      first += part * j;
      second += part * j * j;
    }
    sum += second - first * first / density;
  }
  return sum / (steps * noise * std::sqrt(2 * std::numbers::pi));
}

double information_far_out(double mean, double noise) {
  const double m = lattice_variance_e2(noise);
  const double v = mean + m;
  return 1 / v + (m / v) * (m / v) / (2 * v * v + mean * m / v);
}

/// Returns the variances of the three planes' means [e-^2].
template <class Information>
Vector3 plane_variances(const FlatPatch& patch, const Information& information) {
  Vector3 out{};
  for (int k = 0; k < 3; ++k) {
    assert(patch.signal_e[k] >= 0 && patch.dark_e[k] >= 0 && patch.pixels[k] > 0);
    out[k] = 1 / (patch.pixels[k] * information(patch.signal_e[k] + patch.dark_e[k], patch.noise_std_e));
    if (!patch.dark_pixels) continue;
    assert((*patch.dark_pixels)[k] > 0);
    out[k] += 1 / ((*patch.dark_pixels)[k] * information(patch.dark_e[k], patch.noise_std_e));
  }
  return out;
}

/// Returns r diag(v) s^T.
double product(const Vector3& r, const Vector3& v, const Vector3& s) {
  return r[0] * v[0] * s[0] + r[1] * v[1] * s[1] + r[2] * v[2] * s[2];
}

/// Returns row times matrix.
Vector3 times(const Vector3& row, const Matrix3& m) {
  Vector3 out{};
  for (int j = 0; j < 3; ++j) out[j] = row[0] * m[0][j] + row[1] * m[1][j] + row[2] * m[2][j];
  return out;
}

std::optional<ChromaPrecision> propagated(const Matrix3& a, const FlatPatch& patch, const Vector3& variance_e2) {
  const Vector3 xyz = a * patch.signal_e;
  const double s = xyz[0] + xyz[1] + xyz[2], w = xyz[0] + 15 * xyz[1] + 3 * xyz[2];
  const auto xy = xy_of(xyz_of(xyz));
  if (!xy || !(w > 0)) return std::nullopt;
  const UvPrime uv{4 * xyz[0] / w, 9 * xyz[1] / w};
  const Vector3 x_row = times({(1 - xy->x) / s, -xy->x / s, -xy->x / s}, a);
  const Vector3 y_row = times({-xy->y / s, (1 - xy->y) / s, -xy->y / s}, a);
  const Vector3 u_row = times({(4 - uv.u) / w, -15 * uv.u / w, -3 * uv.u / w}, a);
  const Vector3 v_row = times({-uv.v / w, (9 - 15 * uv.v) / w, -3 * uv.v / w}, a);
  const Vector3 w_row = times({1, 15, 3}, a);
  const auto covariance = [&](const Vector3& p, const Vector3& q) { return product(p, variance_e2, q); };
  ChromaPrecision out;
  out.uv = uv;
  out.uv_covariance = {covariance(u_row, u_row), covariance(u_row, v_row), covariance(v_row, v_row)};
  out.xy = *xy;
  out.xy_covariance = {covariance(x_row, x_row), covariance(x_row, y_row), covariance(y_row, y_row)};
  out.weight_snr = w / std::sqrt(covariance(w_row, w_row));
  return out;
}

}  // namespace

double fisher_information_e2(double poisson_mean_e, double noise_std_e) {
  assert(poisson_mean_e >= 0 && noise_std_e >= 0);
  if (poisson_mean_e == 0) {
    return noise_std_e > 0 ? std::expm1(1 / (noise_std_e * noise_std_e)) : std::numeric_limits<double>::infinity();
  }
  if (noise_std_e < counting_noise_e) return 1 / poisson_mean_e;
  if (poisson_mean_e + noise_std_e * noise_std_e >= asymptotic_variance_e2) {
    return information_far_out(poisson_mean_e, noise_std_e);
  }
  return information_by_quadrature(poisson_mean_e, noise_std_e);
}

double rss_std(const UvCovariance& covariance) { return std::sqrt(covariance.uu + covariance.vv); }
double rss_std(const XyCovariance& covariance) { return std::sqrt(covariance.xx + covariance.yy); }

std::optional<ChromaPrecision> chroma_crb(const Matrix3& camera_to_xyz, const FlatPatch& patch) {
  return propagated(camera_to_xyz, patch, plane_variances(patch, fisher_information_e2));
}

std::optional<ChromaPrecision> chroma_of_means(const Matrix3& camera_to_xyz, const FlatPatch& patch) {
  const auto of_mean = [](double mean, double noise) { return 1 / (mean + noise * noise); };
  return propagated(camera_to_xyz, patch, plane_variances(patch, of_mean));
}

}  // namespace lowlux::isp
