#include <algorithm>
#include <cmath>

#include "isp/model/colorimetry.h"
#include "isp/model/effect_plan.h"

namespace lowlux::isp {
namespace {

constexpr double sigmas = 5;            // of a bound: one block in a million exceeds it
constexpr double channel_pixels = 256;  // of R or B in a block; G has twice as many
constexpr double block_lines = 16;      // rows, or columns, of a block that hold one channel
constexpr double hottest = 14;          // of an exponential law, in units of its mean: exceeded once in a million
constexpr double black_noise_of_white = 0.02;  // isp/render/exposure

double square(double x) { return x * x; }

/// Mean charge of one channel's pixels by where it comes from [e-].
struct Charge {
  double signal, dark, hot;  // hot: of a hot pixel, on top
};

/// What is kept of one channel: mean, and variance by how it is shared between pixels [e-, e-^2].
struct Budget {
  double collected_mean = 0;
  double collected_variance = 0;  // before the full well
  double pixel_variance = 0;      // after it, independent for each pixel
  double line_variance = 0;       // shared by a row or a column
};

Budget budget_of(const SensorModel& s, const Charge& q, EffectSet kept) {
  Budget b;
  const double hot_mean = s.hot_pixel_fraction * q.hot;
  b.collected_mean = q.signal;
  if (kept.has(Effect::photon_noise)) b.collected_variance += q.signal;
  if (kept.has(Effect::prnu)) b.collected_variance += square(s.prnu * q.signal);
  if (kept.has(Effect::dark_current)) {
    b.collected_mean += q.dark;
    b.collected_variance += q.dark;
    if (kept.has(Effect::dsnu)) b.collected_variance += square(s.dsnu * q.dark);
  }
  if (kept.has(Effect::hot_pixels)) {
    b.collected_mean += hot_mean;
    b.collected_variance += hot_mean + 2 * hot_mean * q.hot - square(hot_mean);  // E[h^2] = 2 E[h]^2
  }
  if (kept.has(Effect::read_noise)) b.pixel_variance += square(s.read_noise_e);
  if (kept.has(Effect::row_noise)) b.line_variance += square(s.row_noise_e);
  if (kept.has(Effect::column_noise)) b.line_variance += square(s.column_noise_e);
  return b;
}

/// Moments in DN of one channel of a block, and how far quantisation may move them.
struct ChannelMoments {
  Moments dn;
  QuantisationBounds uncertain{0, 0};
  double unclipped = 1;  // share of the variance that clipping leaves
};

ChannelMoments moments_of(const SensorModel& s, const Budget& b, EffectSet kept) {
  Moments charge{b.collected_mean, b.collected_variance};
  const double before = charge.variance + b.pixel_variance + b.line_variance;
  if (kept.has(Effect::clipping)) charge = clamped_normal(charge, -INFINITY, s.full_well_e);
  const double k = s.system_gain_dn_per_e;
  Moments dn{s.black_level_dn + k * charge.mean, k * k * (charge.variance + b.pixel_variance + b.line_variance)};
  if (kept.has(Effect::clipping)) dn = clamped_normal(dn, 0, s.white_level_dn);
  ChannelMoments out;
  out.unclipped = before > 0 ? std::min(1.0, dn.variance / (k * k * before)) : 1;
  if (kept.has(Effect::quantisation)) {
    out.uncertain = quantisation_bounds(std::sqrt(dn.variance));
    // A level held at an end of the range is a whole code already.
    const double inside = dn.variance > 0 || (dn.mean > 0 && dn.mean < s.white_level_dn) ? 1 : 0;
    out.uncertain.mean_dn *= inside;
    out.uncertain.variance_dn2 *= inside;
    dn.mean -= inside * (s.quantisation == Quantisation::floor ? 0.5 : 0.0);
    dn.variance += inside / 12;
  }
  out.dn = dn;
  return out;
}

/// Variance of one pixel's change when the effects that are not kept are left out, the random numbers being the same.
/// A change of a Poisson mean by delta moves the count by a whole number now and then: at most min(1/4, delta).
struct ChangeVariance {
  double pixel = 0, line = 0;
};

ChangeVariance change_variance(const SensorModel& s, const Charge& q, EffectSet kept) {
  const Budget all = budget_of(s, q, EffectSet::all()), left = budget_of(s, q, kept);
  ChangeVariance v;
  v.line = all.line_variance - left.line_variance;
  v.pixel = all.collected_variance + all.pixel_variance - left.collected_variance - left.pixel_variance;
  if (!kept.has(Effect::prnu)) v.pixel += std::min(0.25, s.prnu * q.signal);
  if (!kept.has(Effect::dsnu)) v.pixel += std::min(0.25, s.dsnu * q.dark);
  if (!kept.has(Effect::quantisation)) v.pixel += 1 / (12 * square(s.system_gain_dn_per_e));
  return v;
}

/// How many hot pixels a channel of a block may hold: exceeded once in a million.
double hot_pixels_of_block(double fraction) {
  const double mean = fraction * channel_pixels;
  if (mean < 1e-6) return 0;
  double term = std::exp(-mean), sum = term;
  int count = 0;
  while (sum < 1 - 1e-6 && count < channel_pixels) {
    ++count;
    term *= mean / count;
    sum += term;
  }
  return std::max(count, 1);
}

/// Bounds on what changes in one channel of a block.
struct ChannelChange {
  double shift_dn = 0;    // of the mean, known
  double scatter_dn = 0;  // of the mean, bound
  double relative_variance = 0;
};

ChannelChange channel_change(const SensorModel& s, const Charge& q, EffectSet kept) {
  const ChannelMoments all = moments_of(s, budget_of(s, q, EffectSet::all()), EffectSet::all());
  const ChannelMoments left = moments_of(s, budget_of(s, q, kept), kept);
  const double k = s.system_gain_dn_per_e;
  const double passed = std::max(all.unclipped, left.unclipped);
  const ChangeVariance change = change_variance(s, q, kept);
  const double pixel = passed * k * k * change.pixel, line = passed * k * k * change.line;
  double hot_mean = 0, hot_variance = 0;  // hot pixels come by the piece
  if (!kept.has(Effect::hot_pixels)) {
    const double hot_dn = k * q.hot * hottest, count = hot_pixels_of_block(s.hot_pixel_fraction);
    hot_mean = count * hot_dn / channel_pixels;
    hot_variance = count * square(hot_dn) / channel_pixels;
  }
  ChannelChange out;
  out.shift_dn = left.dn.mean - all.dn.mean;
  const bool quantisation_differs = pixel + line > 0 || !kept.has(Effect::quantisation);
  const double rounding_mean = quantisation_differs ? all.uncertain.mean_dn + left.uncertain.mean_dn : 0;
  const double rounding_variance = quantisation_differs ? all.uncertain.variance_dn2 + left.uncertain.variance_dn2 : 0;
  out.scatter_dn = sigmas * std::sqrt(pixel / channel_pixels + line / block_lines) + rounding_mean + passed * hot_mean;
  // Sample variances: their own scatter, and the sample covariance of what is left out with what is kept.
  const double larger = std::max(all.dn.variance, left.dn.variance);
  const double moved = std::fabs(left.dn.variance - all.dn.variance) + rounding_variance + passed * hot_variance +
                       sigmas * (pixel * std::sqrt(2 / channel_pixels) + line * std::sqrt(2 / block_lines) +
                                 2 * std::sqrt((pixel + line) * larger / channel_pixels));
  const double seen = all.dn.variance * (1 - sigmas * std::sqrt(2 / channel_pixels));  // the least a block may show
  out.relative_variance = moved / std::max(seen, variance_floor_dn2);
  return out;
}

Charge charge_of(const SensorModel& s, const Exposure& exposure, int channel, double signal_e) {
  const double time_factor = exposure.time_s * dark_current_factor(s, exposure.temperature_c);
  return {signal_e, s.dark_current_e_per_s[channel] * time_factor, s.hot_pixel_current_e_per_s * time_factor};
}

Lab lab_of_dn(const SensorModel& s, const Developing& developing, const Vector3& dn) {
  Vector3 rgb{};
  for (int c = 0; c < 3; ++c) {
    rgb[c] = (dn[c] - s.black_level_dn) / (s.system_gain_dn_per_e * developing.white_e[c]);
  }
  return lab_of(xyz_of(developing.camera_to_xyz * rgb), *xyz_of(white_d65));
}

}  // namespace

Developing developing_of(const SensorModel& sensor, const Exposure& exposure, const Matrix3& camera_to_xyz,
                         const Vector3& neutral, std::span<const Vector3> block_signal_e) {
  double level = 0;
  for (const Vector3& block : block_signal_e) {
    for (int c = 0; c < 3; ++c) level = std::max(level, block[c] / neutral[c]);
  }
  level = std::min(level, saturation_charge_e(sensor));
  for (int c = 0; c < 3; ++c) {
    const Budget black = budget_of(sensor, charge_of(sensor, exposure, c, 0), EffectSet::all());
    const double variance_e2 = black.collected_variance + black.pixel_variance + black.line_variance +
                               1 / (12 * square(sensor.system_gain_dn_per_e));
    level = std::max(level, std::sqrt(variance_e2) / (black_noise_of_white * neutral[c]));
  }
  return {camera_to_xyz * diagonal3(neutral), {level * neutral[0], level * neutral[1], level * neutral[2]}};
}

PredictedChange predict_change(const SensorModel& sensor, const Exposure& exposure, const Developing& developing,
                               const Vector3& signal_e, EffectSet kept) {
  PredictedChange out;
  Vector3 mean{}, shift{}, scatter{};
  for (int c = 0; c < 3; ++c) {
    const Charge charge = charge_of(sensor, exposure, c, signal_e[c]);
    mean[c] = moments_of(sensor, budget_of(sensor, charge, EffectSet::all()), EffectSet::all()).dn.mean;
    const ChannelChange change = channel_change(sensor, charge, kept);
    shift[c] = change.shift_dn;
    scatter[c] = change.scatter_dn;
    out.relative_variance = std::max(out.relative_variance, change.relative_variance);
  }
  const Lab before = lab_of_dn(sensor, developing, mean);
  for (int corner = 0; corner < 8; ++corner) {  // the farthest colours the bounds allow
    Vector3 after = mean;
    for (int c = 0; c < 3; ++c) after[c] += shift[c] + ((corner >> c) & 1 ? scatter[c] : -scatter[c]);
    out.delta_e = std::max(out.delta_e, ciede2000(before, lab_of_dn(sensor, developing, after)));
  }
  return out;
}

}  // namespace lowlux::isp
