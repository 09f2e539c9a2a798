#include "isp/model/colour/correlated_colour_temperature.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "isp/model/spectrum/cie_data.h"

namespace lowlux::isp {
namespace {

/// Holds a CIE 1960 uv chromaticity.
struct Uv {
  double u = 0;
  double v = 0;
};

/// Holds a point of the locus at a reciprocal temperature m [MK^-1], and its derivative by m.
struct LocusPoint {
  Uv uv;
  Uv slope;
};

constexpr double min_mired = 1e6 / planckian_max_k;
constexpr double max_mired = 1e6 / planckian_min_k;

/// Evaluates Planck's law in m: S ~ nm^-5 / (exp(a) - 1), a = c2 m / wavelength, and dS/dm = -S (a / m) (1 + 1 /
/// (exp(a) - 1)).
LocusPoint locus_at(double mired) {
  constexpr double c2_nm_per_mired = 14.388;  // c2 = 1.4388e-2 m K
  const auto& observer = cie_1931_observer();
  const auto wavelengths = observer[0].wavelengths_nm();
  Vector3 xyz{}, slope{};
  for (std::size_t i = 0; i < wavelengths.size(); ++i) {
    const double relative = 560.0 / wavelengths[i];  // keeps the numbers near 1
    const double a = c2_nm_per_mired * mired / wavelengths[i];
    const double denominator = std::expm1(a);
    const double power = relative * relative * relative * relative * relative / denominator;
    const double power_slope = -power * (a / mired) * (1 + 1 / denominator);
    for (int c = 0; c < 3; ++c) {
      xyz[c] += power * observer[c].values()[i];
      slope[c] += power_slope * observer[c].values()[i];
    }
  }
  const double sum = xyz[0] + 15 * xyz[1] + 3 * xyz[2];
  const double sum_slope = slope[0] + 15 * slope[1] + 3 * slope[2];
  const Uv uv{4 * xyz[0] / sum, 6 * xyz[1] / sum};
  return {uv, {(4 * slope[0] - uv.u * sum_slope) / sum, (6 * slope[1] - uv.v * sum_slope) / sum}};
}

/// Sets the number of points over the whole locus, evenly spaced in mired, from which the search starts.
constexpr int scan_size = 200;
constexpr double scan_mired(int i) { return min_mired + (max_mired - min_mired) * i / (scan_size - 1); }

const std::array<Uv, scan_size>& scan_points() {
  static const std::array<Uv, scan_size> points = [] {
    std::array<Uv, scan_size> made{};
    for (int i = 0; i < scan_size; ++i) made[i] = locus_at(scan_mired(i)).uv;
    return made;
  }();
  return points;
}

double squared_distance(const Uv& a, const Uv& b) { return (a.u - b.u) * (a.u - b.u) + (a.v - b.v) * (a.v - b.v); }

/// Returns the mired of the point of the locus nearest to p: Gauss-Newton on the tangent condition (uv(m) - p) . uv'(m)
/// = 0, kept inside a bracket that shrinks with every step, by halving where a step would leave it.
double nearest_mired(const Uv& p) {
  const auto& points = scan_points();
  const auto* best = std::min_element(points.begin(), points.end(), [&](const Uv& a, const Uv& b) {
    return squared_distance(a, p) < squared_distance(b, p);
  });
  const int start = static_cast<int>(best - points.begin());
  double low = scan_mired(std::max(start - 1, 0));
  double high = scan_mired(std::min(start + 1, scan_size - 1));
  double mired = scan_mired(start);
  for (int i = 0; i < 60; ++i) {
    const LocusPoint here = locus_at(mired);
    const double gradient = (here.uv.u - p.u) * here.slope.u + (here.uv.v - p.v) * here.slope.v;
    (gradient > 0 ? high : low) = mired;
    double next = mired - gradient / (here.slope.u * here.slope.u + here.slope.v * here.slope.v);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    const bool settled = std::fabs(next - mired) <= 1e-10 * mired;
    mired = next;
    if (settled) break;
  }
  return mired;
}

/// Returns the unit normal of the locus on its green side.
Uv normal_of(const Uv& slope) {
  const double length = std::hypot(slope.u, slope.v);
  return {-slope.v / length, slope.u / length};
}

std::optional<Xy> xy_of_uv(const Uv& uv) {
  const auto xy = xy_of(UvPrime{uv.u, 1.5 * uv.v});
  if (!xy || !xyz_of(*xy)) return std::nullopt;
  return xy;
}

std::optional<Uv> uv_of(const Xy& xy) {
  const auto prime = uv_prime_of(xy);
  if (!prime) return std::nullopt;
  return Uv{prime->u, prime->v * (2.0 / 3.0)};
}

}  // namespace

std::optional<Xy> planckian_xy(double cct_k, double duv) {
  if (!(cct_k >= planckian_min_k && cct_k <= planckian_max_k) || !std::isfinite(duv)) return std::nullopt;
  const LocusPoint point = locus_at(1e6 / cct_k);
  const Uv normal = normal_of(point.slope);
  return xy_of_uv({point.uv.u + duv * normal.u, point.uv.v + duv * normal.v});
}

std::optional<Xy> daylight_xy(double cct_k) {
  if (!(cct_k >= 4000 && cct_k <= 25000)) return std::nullopt;
  const double t = 1e3 / cct_k;
  const double x = cct_k <= 7000 ? ((-4.6070 * t + 2.9678) * t + 0.09911) * t + 0.244063
                                 : ((-2.0064 * t + 1.9018) * t + 0.24748) * t + 0.237040;
  return Xy{x, (-3.000 * x + 2.870) * x - 0.275};
}

std::optional<Xy> white_of_temperature(double cct_k) {
  if (!(cct_k >= white_min_k && cct_k <= white_max_k)) return std::nullopt;
  if (cct_k >= 4000) return daylight_xy(cct_k);
  constexpr double daylight_mired = 250, planckian_mired = 300;
  const double mired = 1e6 / cct_k;
  if (mired >= planckian_mired) return planckian_xy(cct_k);
  const auto daylight = uv_of(*daylight_xy(4000));
  const Uv join = locus_at(daylight_mired).uv;
  const Uv here = locus_at(mired).uv;
  const double t = (planckian_mired - mired) / (planckian_mired - daylight_mired);
  const double weight = t * t * (3 - 2 * t);
  return xy_of_uv({here.u + weight * (daylight->u - join.u), here.v + weight * (daylight->v - join.v)});
}

std::optional<ColourTemperature> colour_temperature_of(const Xy& xy) {
  const auto uv = uv_of(xy);
  if (!uv || !xyz_of(xy)) return std::nullopt;
  const double mired = nearest_mired(*uv);
  const LocusPoint nearest = locus_at(mired);
  const Uv normal = normal_of(nearest.slope);
  const double duv = (uv->u - nearest.uv.u) * normal.u + (uv->v - nearest.uv.v) * normal.v;
  const bool at_end = mired < min_mired * (1 + 1e-6) || mired > max_mired * (1 - 1e-6);
  return ColourTemperature{1e6 / mired, duv, at_end};
}

}  // namespace lowlux::isp
