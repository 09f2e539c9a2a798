#include "isp/model/chromaticity_cloud.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <vector>

#include "isp/model/cie_data.h"

namespace lowlux::isp {
namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double energy_unit_j = 1e-19;  // keeps squares of photon energies far from the ends of double's range

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
  // From the determinant, not middle - half_gap, which cancels for thin ellipses.
  const double smaller = larger > 0 ? std::max(0.0, (c.xx * c.yy - c.xy * c.xy) / larger) : 0;
  double inclination = 0.5 * std::atan2(2 * c.xy, c.xx - c.yy) / degree;
  if (inclination < 0) inclination += 180;
  if (inclination >= 180) inclination = 0;  // what a tiny negative angle plus 180 rounds to
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

}  // namespace lowlux::isp
