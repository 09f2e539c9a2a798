#include "isp/model/colour/chromaticity_cloud.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "isp/model/spectrum/cie_data.h"

namespace lowlux::isp {
namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double energy_unit_j = 1e-19;  // keeps squares of photon energies far from the limits of double

Vector3 weight_of(double wavelength_nm) {
  const double energy = photon_energy_j(wavelength_nm) / energy_unit_j;
  const auto& observer = cie_1931_observer();
  return {energy * observer[0].at(wavelength_nm), energy * observer[1].at(wavelength_nm),
          energy * observer[2].at(wavelength_nm)};
}

}  // namespace

std::optional<ChromaticityCloud> cloud_of(std::span<const Xy> samples) {
  if (samples.size() < 2) return std::nullopt;
  const auto n = static_cast<double>(samples.size());
  ChromaticityCloud out;
  for (const Xy& xy : samples) {
    if (!std::isfinite(xy.x) || !std::isfinite(xy.y)) return std::nullopt;
    out.mean.x += xy.x / n;
    out.mean.y += xy.y / n;
  }
  for (const Xy& xy : samples) {
    const double dx = xy.x - out.mean.x;
    const double dy = xy.y - out.mean.y;
    out.covariance.xx += dx * dx / (n - 1);
    out.covariance.xy += dx * dy / (n - 1);
    out.covariance.yy += dy * dy / (n - 1);
  }
  return out;
}

double size_of(const XyEllipse& ellipse) { return std::hypot(ellipse.semi_major, ellipse.semi_minor); }

XyEllipse principal_ellipse(const ChromaticityCloud& cloud, double deviations) {
  const XyCovariance& c = cloud.covariance;
  const double middle = 0.5 * (c.xx + c.yy);
  const double half_gap = std::hypot(0.5 * (c.xx - c.yy), c.xy);
  const double larger = middle + half_gap;
  // The determinant is used, not middle - half_gap, which cancels for thin ellipses.
  const double smaller = larger > 0 ? std::max(0.0, (c.xx * c.yy - c.xy * c.xy) / larger) : 0;
  double inclination = 0.5 * std::atan2(2 * c.xy, c.xx - c.yy) / degree;
  if (inclination < 0) inclination += 180;
  if (inclination >= 180) inclination = 0;  // a tiny negative angle plus 180 rounds to 180
  return {cloud.mean, deviations * std::sqrt(larger), deviations * std::sqrt(smaller), inclination};
}

double inclination_difference_deg(double first_deg, double second_deg) {
  return std::remainder(first_deg - second_deg, 180);
}

std::optional<ChromaticityCloud> propagated_cloud(const Xyz& mean, const Matrix3& covariance) {
  const auto xy = xy_of(mean);
  if (!xy) return std::nullopt;
  const double sum = mean.x + mean.y + mean.z;
  const Vector3 by_x{(1 - xy->x) / sum, -xy->x / sum, -xy->x / sum};
  const Vector3 by_y{-xy->y / sum, (1 - xy->y) / sum, -xy->y / sum};
  const auto form = [&](const Vector3& a, const Vector3& b) {
    const Vector3 cb = covariance * b;
    return a[0] * cb[0] + a[1] * cb[1] + a[2] * cb[2];
  };
  return ChromaticityCloud{*xy, {form(by_x, by_x), form(by_x, by_y), form(by_y, by_y)}};
}

std::optional<ChromaticityCloud> predicted_cloud(const PhotonMeans& means) {
  Matrix3 covariance{};
  for (std::size_t n = 0; n < means.photons.size(); ++n) {
    const Vector3 v = weight_of(means.wavelengths_nm[n]);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) covariance[i][j] += means.photons[n] * v[i] * v[j];
    }
  }
  return propagated_cloud(xyz_of_photons(means, means.photons), covariance);
}

Xyz xyz_of_photons(const PhotonMeans& means, std::span<const double> counts) {
  assert(counts.size() == means.wavelengths_nm.size());
  Vector3 sum{};
  for (std::size_t n = 0; n < counts.size(); ++n) {
    const Vector3 v = weight_of(means.wavelengths_nm[n]);
    for (int i = 0; i < 3; ++i) sum[i] += counts[n] * v[i];
  }
  return xyz_of(sum);
}

namespace {

constexpr double optimality_tolerance = 1e-7;  // for the optimality condition; the area is within about (3/2) of it
constexpr int max_iterations = 20000;          // linear convergence: a few hundred in practice

// The samples after an affine map that makes their covariance the identity: the least ellipse is affinely covariant,
// and clouds far smaller than their distance from the origin keep their digits.
struct Whitening {
  Xy mean;
  double l11, l21, l22;  // Cholesky factor of the covariance
};

std::optional<Whitening> whitening_of(const ChromaticityCloud& cloud) {
  const XyCovariance& c = cloud.covariance;
  const double l11 = std::sqrt(c.xx);
  const double l21 = c.xy / l11;
  const double rest = c.yy - l21 * l21;
  // The samples are on one line up to rounding: the smaller axis is below 1e-6 of the larger.
  if (!(c.xx > 0) || !(rest > 1e-12 * c.yy)) return std::nullopt;
  return Whitening{cloud.mean, l11, l21, std::sqrt(rest)};
}

Vector3 lifted(const Whitening& w, const Xy& xy) {
  const double u = (xy.x - w.mean.x) / w.l11;
  return {u, (xy.y - w.mean.y - w.l21 * u) / w.l22, 1};
}

Matrix3 moments(const std::vector<Vector3>& points, const std::vector<double>& weight) {
  Matrix3 sum{};
  for (std::size_t n = 0; n < points.size(); ++n) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) sum[i][j] += weight[n] * points[n][i] * points[n][j];
    }
  }
  return sum;
}

double quadratic(const Matrix3& m, const Vector3& v) {
  const Vector3 mv = m * v;
  return v[0] * mv[0] + v[1] * mv[1] + v[2] * mv[2];
}

// Makes one step towards the sample farthest out, or away from the one farthest in that still has weight; returns
// whether it was needed. At the optimum all samples with weight are at kappa = 3, the dimension of the lifted points.
bool improve(const std::vector<Vector3>& points, std::vector<double>& weight) {
  const auto inverted = inverse(moments(points, weight));
  if (!inverted) return false;
  std::size_t out = 0, in = 0;
  double farthest = -1, nearest = 4;
  for (std::size_t n = 0; n < points.size(); ++n) {
    const double kappa = quadratic(*inverted, points[n]);
    if (kappa > farthest) farthest = kappa, out = n;
    if (weight[n] > 0 && kappa < nearest) nearest = kappa, in = n;
  }
  if (farthest / 3 - 1 <= optimality_tolerance && 1 - nearest / 3 <= optimality_tolerance) return false;
  const bool towards = farthest / 3 - 1 >= 1 - nearest / 3;
  const std::size_t chosen = towards ? out : in;
  const double kappa = towards ? farthest : nearest;
  double step = (kappa - 3) / (3 * (kappa - 1));
  const double drop = -weight[chosen] / (1 - weight[chosen]);
  const bool dropped = !towards && (kappa <= 1 || step <= drop);
  if (dropped) step = drop;
  for (double& w : weight) w *= 1 - step;
  weight[chosen] = dropped ? 0 : weight[chosen] + step;
  return true;
}

}  // namespace

std::optional<XyEllipse> enclosing_ellipse(std::span<const Xy> samples) {
  const auto cloud = cloud_of(samples);
  const auto white = cloud ? whitening_of(*cloud) : std::nullopt;
  if (!white) return std::nullopt;
  std::vector<Vector3> points;
  for (const Xy& xy : samples) points.push_back(lifted(*white, xy));
  std::vector<double> weight(points.size(), 1.0 / static_cast<double>(points.size()));
  for (int i = 0; i < max_iterations && improve(points, weight); ++i) continue;

  // In the plane the ellipse is 2 x covariance of the weights, scaled so that it reaches the farthest sample.
  const Matrix3 m = moments(points, weight);
  const double cu = m[0][2], cv = m[1][2];
  const XyCovariance c{m[0][0] - cu * cu, m[0][1] - cu * cv, m[1][1] - cv * cv};
  const double determinant = c.xx * c.yy - c.xy * c.xy;
  double reach = 0;
  for (const Vector3& p : points) {
    const double u = p[0] - cu, v = p[1] - cv;
    reach = std::max(reach, (c.yy * u * u - 2 * c.xy * u * v + c.xx * v * v) / determinant);
  }
  const double xx = white->l11 * white->l11 * c.xx;
  const double xy = white->l11 * (white->l21 * c.xx + white->l22 * c.xy);
  const double yy =
      white->l21 * white->l21 * c.xx + 2 * white->l21 * white->l22 * c.xy + white->l22 * white->l22 * c.yy;
  const Xy centre{white->mean.x + white->l11 * cu, white->mean.y + white->l21 * cu + white->l22 * cv};
  return principal_ellipse({centre, {xx, xy, yy}}, std::sqrt(reach));
}

}  // namespace lowlux::isp
