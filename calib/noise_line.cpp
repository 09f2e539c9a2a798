#include "calib/noise_line.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "isp/model/noise_budget.h"

namespace lowlux::calib {
namespace {

constexpr double quantisation_dn2 = 1.0 / 12;
constexpr double far_sigmas = 6;  // a bound further off than this clips one pixel in 1e9

/// A normal law before clipping.
isp::Moments law_at(const NoiseLine& line, double mu_dn) {
  const double floor_dn2 = 1e-3 * std::abs(line.offset_dn2.value) + 1e-9;
  return {mu_dn, std::max(line.gain_dn_per_e.value * mu_dn + line.offset_dn2.value, floor_dn2)};
}

bool is_far(const isp::Moments& law, const ClipRange& clip) {
  const double reach = far_sigmas * std::sqrt(law.variance);
  return law.mean - reach > clip.low_dn && law.mean + reach < clip.high_dn;
}

double density(double z) { return std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi); }

/// Mean and variance after clipping. To those of the normal law comes what the third cumulant K^2 (K lambda) of the
/// photons does, to first order (Edgeworth): kappa_3 / 6 times the mean of the third derivative of clamp(x) and of its
/// square, which are delta functions at the bounds.
isp::Moments read_moments(const NoiseLine& line, const isp::Moments& law, const ClipRange& clip) {
  isp::Moments seen = isp::clamped_normal(law, clip.low_dn, clip.high_dn);
  const double s = std::sqrt(law.variance), gain = line.gain_dn_per_e.value;
  const double third = gain * gain * std::max(law.mean, 0.0) / 6;
  double mean = 0, square = 0;
  for (const double sign : {1.0, -1.0}) {
    const double bound = (sign > 0 ? clip.low_dn : clip.high_dn) - law.mean, z = bound / s;
    const double f = density(z) / s, slope = -z * f / s;
    mean -= sign * third * slope;
    square += sign * third * (2 * f - 2 * bound * slope);
  }
  const double from_law = seen.mean - law.mean;  // square is about the mean of the law
  seen.variance = std::max(seen.variance + square - 2 * from_law * mean, 0.0);
  seen.mean += mean;
  return seen;
}

/// The law whose clipped mean is mean_dn, by bisection: the clipped mean rises with mu.
isp::Moments law_seen_as(const NoiseLine& line, double mean_dn, const ClipRange& clip) {
  const isp::Moments here = law_at(line, mean_dn);
  if (is_far(here, clip)) return here;
  const double reach = far_sigmas * std::sqrt(here.variance);
  double low = mean_dn - reach, high = mean_dn + reach;
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2;
    const isp::Moments seen = read_moments(line, law_at(line, middle), clip);
    (seen.mean < mean_dn ? low : high) = middle;
  }
  return law_at(line, (low + high) / 2);
}

double upper_tail(double z) { return std::erfc(z / std::sqrt(2.0)) / 2; }

double share_beyond(const isp::Moments& law, const ClipRange& clip) {
  const double s = std::sqrt(law.variance);
  return upper_tail((law.mean - clip.low_dn) / s) + upper_tail((clip.high_dn - law.mean) / s);
}

/// The parameters' information: J^T W J of a model of two parameters, and J^T W r.
struct Normal {
  double aa = 0, ab = 0, bb = 0;
  double ra = 0, rb = 0;
  double chi_square = 0, weight = 0;

  double determinant() const { return aa * bb - ab * ab; }
  bool solvable() const { return determinant() > 1e-9 * aa * bb && std::isfinite(determinant()); }
};

/// Cauchy's weight with the constant that costs 5 % of efficiency where errors are normal.
double robust_weight(double residual) { return 1 / (1 + residual * residual / (2.385 * 2.385)); }

NoiseLine moved(const NoiseLine& line, double by_gain, double by_offset) {
  NoiseLine out = line;
  out.gain_dn_per_e.value += by_gain;
  out.offset_dn2.value += by_offset;
  return out;
}

Normal normal_equations(std::span<const NoisePoint> points, const NoiseLine& line) {
  Normal out;
  for (const NoisePoint& p : points) {
    const double model = read_variance_dn2(line, p.mean_dn, p.clip);
    if (!(model > 0)) continue;
    const double step_b = 1e-4 * model, step_a = step_b / std::max(std::abs(p.mean_dn), std::sqrt(model));
    const double by_a = (read_variance_dn2(moved(line, step_a, 0), p.mean_dn, p.clip) - model) / step_a;
    const double by_b = (read_variance_dn2(moved(line, 0, step_b), p.mean_dn, p.clip) - model) / step_b;
    const double information = p.degrees_of_freedom / (2 * model * model);
    const double residual = (p.variance_dn2 - model) * std::sqrt(information);
    const double robust = robust_weight(residual), w = information * robust;
    out.aa += w * by_a * by_a;
    out.ab += w * by_a * by_b;
    out.bb += w * by_b * by_b;
    out.ra += w * by_a * (p.variance_dn2 - model);
    out.rb += w * by_b * (p.variance_dn2 - model);
    out.chi_square += robust * residual * residual;
    out.weight += robust;
  }
  return out;
}

/// A line to begin with: clipping left out of account, weights from the measured variances.
NoiseLine first_line(std::span<const NoisePoint> points) {
  double w0 = 0, w1 = 0, w2 = 0, v0 = 0, v1 = 0, least = INFINITY;
  for (const NoisePoint& p : points) {
    const double w = p.degrees_of_freedom / (p.variance_dn2 * p.variance_dn2 + 1e-6);
    w0 += w;
    w1 += w * p.mean_dn;
    w2 += w * p.mean_dn * p.mean_dn;
    v0 += w * p.variance_dn2;
    v1 += w * p.mean_dn * p.variance_dn2;
    least = std::min(least, p.variance_dn2);
  }
  NoiseLine line;
  const double slope = (w0 * v1 - w1 * v0) / (w0 * w2 - w1 * w1);
  line.gain_dn_per_e.value = std::isfinite(slope) ? std::max(slope, 0.0) : 0;
  line.offset_dn2.value = std::max((v0 - line.gain_dn_per_e.value * w1) / w0, 0.1 * least);
  return line;
}

/// Whether every point keeps a variance: steps that lose one are halved.
bool is_lawful(std::span<const NoisePoint> points, const NoiseLine& line) {
  return std::all_of(points.begin(), points.end(), [&](const NoisePoint& p) {
    return line.gain_dn_per_e.value * std::max(p.mean_dn, 0.0) + line.offset_dn2.value > 0.05 * p.variance_dn2;
  });
}

}  // namespace

double read_variance_dn2(const NoiseLine& line, double mean_dn, const ClipRange& clip) {
  const isp::Moments law = law_seen_as(line, mean_dn, clip);
  if (is_far(law, clip)) return law.variance;
  // Codes at a bound are not rounded: quantisation is added after clipping, to the others.
  const double dithered = std::max(law.variance - quantisation_dn2, 0.0);
  const double kept = std::max(1 - share_beyond(law, clip), 0.0);
  return read_moments(line, {law.mean, dithered}, clip).variance + kept * std::min(quantisation_dn2, law.variance);
}

double clipped_share(const NoiseLine& line, double mean_dn, const ClipRange& clip) {
  return share_beyond(law_seen_as(line, mean_dn, clip), clip);
}

std::optional<NoiseLine> fit_noise_line(std::span<const NoisePoint> points) {
  if (points.size() < 3) return std::nullopt;
  NoiseLine line = first_line(points);
  Normal n;
  for (int i = 0; i < 40; ++i) {
    n = normal_equations(points, line);
    if (!n.solvable()) return std::nullopt;
    double by_gain = (n.bb * n.ra - n.ab * n.rb) / n.determinant();
    double by_offset = (n.aa * n.rb - n.ab * n.ra) / n.determinant();
    for (int halving = 0; halving < 30 && !is_lawful(points, moved(line, by_gain, by_offset)); ++halving) {
      by_gain /= 2;
      by_offset /= 2;
    }
    line = moved(line, by_gain, by_offset);
    if (by_gain * by_gain * n.aa + by_offset * by_offset * n.bb < 1e-8) break;
  }
  line.degrees_of_freedom = static_cast<int>(points.size()) - 2;
  line.reduced_chi_square = n.chi_square / n.weight * static_cast<double>(points.size()) / line.degrees_of_freedom;
  const double scatter = std::max(line.reduced_chi_square, 1.0) / n.determinant();
  line.gain_dn_per_e.standard_error = std::sqrt(scatter * n.bb);
  line.offset_dn2.standard_error = std::sqrt(scatter * n.aa);
  line.covariance = -scatter * n.ab;
  return line;
}

}  // namespace lowlux::calib
