#include "calib/picture/noise_line.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "isp/base/sensor.h"
#include "isp/model/sensor/noise_budget.h"

namespace lowlux::calib {
namespace {

constexpr int max_steps = 40;
constexpr double far_sigmas = 6;  // a bound further away than this clips one pixel in 1e9

/// Returns the normal distribution before clipping.
isp::Moments law_at(const NoiseLine& line, double mu_dn) {
  const double floor_dn2 = 1e-3 * std::abs(line.offset_dn2.value) + 1e-9;
  const double light = std::max(mu_dn, 0.0), texture = line.contrast_squared * light * light;
  return {mu_dn, std::max(line.gain_dn_per_e.value * mu_dn + line.offset_dn2.value + texture, floor_dn2)};
}

bool is_far(const isp::Moments& law, const ClipRange& clip) {
  const double reach = far_sigmas * std::sqrt(law.variance);
  return law.mean - reach > clip.low_dn && law.mean + reach < clip.high_dn;
}

double density(double z) { return std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi); }

/// Returns mean and variance after clipping. To those of the normal distribution it adds the effect of the third
/// cumulant K^2 (K lambda) of the photons, to first order (Edgeworth): kappa_3 / 6 times the mean of the third
/// derivative of clamp(x) and of its square, which are delta functions at the bounds.
isp::Moments read_moments(const NoiseLine& line, const isp::Moments& law, const ClipRange& clip) {
  isp::Moments seen = isp::clamped_normal(law, clip.low_dn, clip.high_dn);
  if (!(law.variance > 0)) return seen;
  const double s = std::sqrt(law.variance), gain = line.gain_dn_per_e.value;
  const double third = gain * gain * std::max(law.mean, 0.0) / 6;
  double mean = 0, square = 0;
  for (const double sign : {1.0, -1.0}) {
    const double bound = (sign > 0 ? clip.low_dn : clip.high_dn) - law.mean, z = bound / s;
    const double f = density(z) / s, slope = -z * f / s;
    mean -= sign * third * slope;
    square += sign * third * (2 * f - 2 * bound * slope);
  }
  const double from_law = seen.mean - law.mean;  // square is about the mean of the distribution
  seen.variance = std::max(seen.variance + square - 2 * from_law * mean, 0.0);
  seen.mean += mean;
  return seen;
}

/// Returns the distribution whose clipped mean is mean_dn, by bisection: the clipped mean rises with mu.
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

double fraction_beyond(const isp::Moments& law, const ClipRange& clip) {
  const double s = std::sqrt(law.variance);
  return upper_tail((law.mean - clip.low_dn) / s) + upper_tail((clip.high_dn - law.mean) / s);
}

/// Change of a line's parameters.
struct Step {
  double gain = 0, offset = 0, contrast_squared = 0;
};

/// Normal equations of the parameters: J^T W J of gain (a), offset (b) and contrast squared (c), and J^T W r.
struct Normal {
  double aa = 0, ab = 0, bb = 0, ac = 0, bc = 0, cc = 0;
  double ra = 0, rb = 0, rc = 0;
  double chi_square = 0, weight = 0;

  double determinant() const { return aa * bb - ab * ab; }
  bool solvable() const { return determinant() > 1e-9 * aa * bb && std::isfinite(determinant()); }

  /// Returns the equations of gain and offset with c eliminated (Schur's complement). Without information on c it is
  /// fixed.
  Normal without_contrast() const {
    if (!(cc > 0)) return *this;
    Normal out = *this;
    out.aa -= ac * ac / cc;
    out.ab -= ac * bc / cc;
    out.bb -= bc * bc / cc;
    out.ra -= ac * rc / cc;
    out.rb -= bc * rc / cc;
    return out;
  }

  /// Returns the step to the best gain and offset for a given change of c.
  Step solved_for(double by_c) const {
    const double a = ra - ac * by_c, b = rb - bc * by_c;
    return {(bb * a - ab * b) / determinant(), (aa * b - ab * a) / determinant(), by_c};
  }

  /// Returns the step to the optimum, with c at least 0.
  Step solved(double c) const {
    if (!(cc > 0)) return solved_for(0);
    const Step free = without_contrast().solved_for(0);
    const double by_c = (rc - ac * free.gain - bc * free.offset) / cc;
    return solved_for(std::max(by_c, -c));
  }
};

/// Returns Cauchy's weight with the constant that costs 5 % of efficiency for normal errors.
double robust_weight(double residual) { return 1 / (1 + residual * residual / (2.385 * 2.385)); }

NoiseLine moved(const NoiseLine& line, const Step& by) {
  NoiseLine out = line;
  out.gain_dn_per_e.value += by.gain;
  out.offset_dn2.value += by.offset;
  out.contrast_squared += by.contrast_squared;
  return out;
}

Step halved(const Step& by) { return {by.gain / 2, by.offset / 2, by.contrast_squared / 2}; }

/// @param expected  prior standard deviation of the contrast squared; 0: it is not fitted
Normal normal_equations(std::span<const NoisePoint> points, const NoiseLine& line, double expected) {
  Normal out;
  for (const NoisePoint& p : points) {
    const double model = read_variance_dn2(line, p.mean_dn, p.clip);
    if (!(model > 0)) continue;
    const double step_b = 1e-4 * model, reach = std::max(std::abs(p.mean_dn), std::sqrt(model));
    const double step_a = step_b / reach, step_c = step_a / reach;
    const auto slope = [&](const Step& step, double length) {
      return (read_variance_dn2(moved(line, step), p.mean_dn, p.clip) - model) / length;
    };
    const double by_a = slope({step_a, 0, 0}, step_a), by_b = slope({0, step_b, 0}, step_b);
    const double by_c = expected > 0 ? slope({0, 0, step_c}, step_c) : 0;
    const double information = p.degrees_of_freedom / (2 * model * model), off = p.variance_dn2 - model;
    const double residual = off * std::sqrt(information);
    const double robust = robust_weight(residual), w = information * robust;
    out.aa += w * by_a * by_a;
    out.ab += w * by_a * by_b;
    out.bb += w * by_b * by_b;
    out.ac += w * by_a * by_c;
    out.bc += w * by_b * by_c;
    out.cc += w * by_c * by_c;
    out.ra += w * by_a * off;
    out.rb += w * by_b * off;
    out.rc += w * by_c * off;
    out.chi_square += robust * residual * residual;
    out.weight += robust;
  }
  if (expected > 0) {
    out.cc += 1 / (expected * expected);
    out.rc -= line.contrast_squared / (expected * expected);
  }
  return out;
}

/// Adds the prior's information to the equations, to first order about the line.
void add_prior(const NoisePrior& prior, const NoiseLine& line, Normal& out) {
  const auto add = [](double expected, double log_std, double value, double& information, double& pull) {
    const double std = log_std * value;
    information += 1 / (std * std);
    pull += std::log(expected / value) * value / (std * std);
  };
  add(prior.gain_dn_per_e, prior.gain_log_std, line.gain_dn_per_e.value, out.aa, out.ra);
  add(prior.offset_dn2, prior.offset_log_std, line.offset_dn2.value, out.bb, out.rb);
}

/// Returns an initial line: clipping ignored, weights from the measured variances.
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

/// Sets the standard errors, and how well the points agree with the line. Scatter beyond that of the points widens the
/// errors.
void add_errors(const Normal& n, std::size_t points, int degrees_of_freedom, NoiseLine& line) {
  line.degrees_of_freedom = degrees_of_freedom;
  line.reduced_chi_square =
      degrees_of_freedom > 0 ? n.chi_square / n.weight * static_cast<double>(points) / degrees_of_freedom : 0;
  const double scatter = std::max(line.reduced_chi_square, 1.0) / n.determinant();
  line.gain_dn_per_e.standard_error = std::sqrt(scatter * n.bb);
  line.offset_dn2.standard_error = std::sqrt(scatter * n.aa);
  line.covariance = -scatter * n.ab;
}

/// Returns whether every point keeps a positive variance: steps for which one does not are halved.
bool is_lawful(std::span<const NoisePoint> points, const NoiseLine& line) {
  return std::all_of(points.begin(), points.end(), [&](const NoisePoint& p) {
    const double mean = std::max(p.mean_dn, 0.0);
    const double variance =
        line.gain_dn_per_e.value * mean + line.offset_dn2.value + line.contrast_squared * mean * mean;
    return variance > 0.05 * p.variance_dn2;
  });
}

}  // namespace

double read_variance_dn2(const NoiseLine& line, double mean_dn, const ClipRange& clip) {
  const isp::Moments law = law_seen_as(line, mean_dn, clip);
  if (is_far(law, clip)) return law.variance;
  // Codes at a bound are not rounded: quantisation is added after clipping, to the others.
  const double dithered = std::max(law.variance - quantisation_dn2, 0.0);
  const double kept = std::max(1 - fraction_beyond(law, clip), 0.0);
  return read_moments(line, {law.mean, dithered}, clip).variance + kept * std::min(quantisation_dn2, law.variance);
}

double clipped_fraction(const NoiseLine& line, double mean_dn, const ClipRange& clip) {
  return fraction_beyond(law_seen_as(line, mean_dn, clip), clip);
}

std::optional<NoiseLine> fit_noise_line(std::span<const NoisePoint> points, double expected_contrast) {
  if (points.size() < 3) return std::nullopt;
  const double expected = expected_contrast * expected_contrast;
  NoiseLine line = first_line(points);
  Normal n;
  for (int i = 0; i < max_steps; ++i) {
    const Normal all = normal_equations(points, line, expected);
    n = all.without_contrast();
    if (!n.solvable()) return std::nullopt;
    Step by = all.solved(line.contrast_squared);
    for (int halving = 0; halving < 30 && !is_lawful(points, moved(line, by)); ++halving) by = halved(by);
    line = moved(line, by);
    if (by.gain * by.gain * n.aa + by.offset * by.offset * n.bb < 1e-8) break;
  }
  add_errors(n, points.size(), static_cast<int>(points.size()) - 2, line);
  return line;
}

NoiseLine fit_noise_line(std::span<const NoisePoint> points, double expected_contrast, const NoisePrior& prior) {
  const double expected = expected_contrast * expected_contrast;
  NoiseLine line;
  line.gain_dn_per_e.value = prior.gain_dn_per_e;
  line.offset_dn2.value = prior.offset_dn2;
  const auto is_possible = [](const NoiseLine& from, const NoiseLine& to) {
    return to.gain_dn_per_e.value > 0.2 * from.gain_dn_per_e.value && to.offset_dn2.value > 0.2 * from.offset_dn2.value;
  };
  Normal n;
  for (int i = 0; i < max_steps; ++i) {
    Normal all = normal_equations(points, line, expected);
    add_prior(prior, line, all);
    n = all.without_contrast();
    Step by = all.solved(line.contrast_squared);
    for (int halving = 0; halving < 30 && !is_possible(line, moved(line, by)); ++halving) by = halved(by);
    line = moved(line, by);
    if (by.gain * by.gain * n.aa + by.offset * by.offset * n.bb < 1e-8) break;
  }
  add_errors(n, points.size(), static_cast<int>(points.size()), line);  // the prior stands for two points
  return line;
}

}  // namespace lowlux::calib
