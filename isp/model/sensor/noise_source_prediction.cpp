#include <algorithm>
#include <cmath>

#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/model/sensor/noise_source_plan.h"

namespace lowlux::isp {
namespace {

constexpr double sigmas = bound_sigmas;
constexpr MovedLight no_light_moves;
constexpr double block_lines = 16;  // rows, or columns, of a block that hold one channel
constexpr double hottest =
    14;  // quantile of an exponential distribution, in units of its mean: exceeded once in a million
constexpr double black_noise_of_white = 0.02;  // isp/render/exposure

double square(double x) { return x * x; }

/// Holds the mean charge of one channel's pixels by origin [e-].
struct Charge {
  double signal, dark, hot;  // hot: additional charge of a hot pixel
  double glow, glow_variance;
  int channel;
  const MovedLight* moved;  // what is left out, of all channels
  double shift;             // mean of what is left out
  double clipped;           // mean of its size where pixels saturate, else 0
  Contrast contrast;        // contrast of all channels; 0 where pixels saturate

  double level() const { return signal + dark + glow; }  // of all pixels but the hot ones
};

/// Holds the kept part of one channel without hot pixels: mean, and variance by how pixels share it [e-, e-^2].
struct Budget {
  double collected_mean = 0;
  double collected_variance = 0;  // before the full well
  double pixel_variance = 0;      // after it, independent for each pixel
  double line_variance = 0;       // shared by a row or a column
};

Budget budget_of(const SensorModel& s, const Charge& q, NoiseSourceSet kept) {
  Budget b;
  b.collected_mean = q.signal;
  if (kept.has(Effect::photon_noise)) b.collected_variance += q.signal;
  if (kept.has(Effect::prnu)) b.collected_variance += square(s.prnu * q.signal);
  if (kept.has(Effect::dark_current)) {
    b.collected_mean += q.dark;
    b.collected_variance += q.dark;
    if (kept.has(Effect::dsnu)) b.collected_variance += square(s.dsnu * q.dark);
  }
  if (kept.has(Effect::amplifier_glow)) {
    b.collected_mean += q.glow;
    b.collected_variance += q.glow;
  }
  if (kept.has(Effect::read_noise)) b.pixel_variance += square(s.read_noise_e);
  if (kept.has(Effect::row_noise)) b.line_variance += square(s.row_noise_e);
  if (kept.has(Effect::column_noise)) b.line_variance += square(s.column_noise_e);
  return b;
}

/// Returns the probability that a normal variable lies between two bounds.
double fraction_inside(const Moments& normal, double low, double high) {
  if (normal.variance <= 0) return normal.mean >= low && normal.mean <= high ? 1 : 0;
  const double unit = std::sqrt(2 * normal.variance);
  return 0.5 * (std::erf((high - normal.mean) / unit) - std::erf((low - normal.mean) / unit));
}

/// Holds the moments in DN of one channel of a block, and bounds on their change by quantisation.
struct ChannelMoments {
  Moments dn;
  QuantisationBounds uncertain{0, 0};
  double unclipped = 1;          // fraction of the variance that clipping leaves
  double variance_slope_dn = 0;  // derivative of the variance by the mean: not 0 where clipping occurs
  double inside = 1;             // fraction of the pixels more than a code away from the ends of the range
};

/// Describes the readout before quantisation [DN], with `more` charge collected and `offset` charge added after it
/// [e-].
struct Displaced {
  double more = 0, offset = 0;
};
Moments analogue_dn(const SensorModel& s, const Budget& b, NoiseSourceSet kept, const Displaced& by) {
  Moments charge{b.collected_mean + by.more, b.collected_variance};
  if (kept.has(Effect::clipping)) charge = clamped_normal(charge, -INFINITY, s.full_well_e);
  const double k = s.system_gain_dn_per_e;
  const Moments dn{s.black_level_dn + k * (charge.mean + by.offset),
                   k * k * (charge.variance + b.pixel_variance + b.line_variance)};
  return kept.has(Effect::clipping) ? clamped_normal(dn, 0, s.white_level_dn) : dn;
}

ChannelMoments moments_of(const SensorModel& s, const Budget& b, NoiseSourceSet kept) {
  ChannelMoments out;
  const double k = s.system_gain_dn_per_e;
  const double before_e2 = b.collected_variance + b.pixel_variance + b.line_variance;
  const Moments unclipped = analogue_dn(s, b, kept.without(Effect::clipping), {});
  out.inside = fraction_inside(unclipped, 1, std::min(s.white_level_dn, s.black_level_dn + k * s.full_well_e) - 1);
  out.dn = analogue_dn(s, b, kept, {});
  if (before_e2 > 0) {
    const double step_e = std::sqrt(before_e2) / 4;
    const auto slope = [&](const Displaced& up, const Displaced& down) {
      return std::fabs(analogue_dn(s, b, kept, up).variance - analogue_dn(s, b, kept, down).variance) /
             (2 * k * step_e);
    };
    out.variance_slope_dn = std::max(slope({step_e, 0}, {-step_e, 0}), slope({0, step_e}, {0, -step_e}));
    out.unclipped = std::min(1.0, out.dn.variance / (k * k * before_e2));
  }
  if (kept.has(Effect::quantisation)) {
    out.uncertain = quantisation_bounds(std::sqrt(out.dn.variance));
    // A level clamped to an end of the range is an integer code already.
    const double inside = out.dn.variance > 0 || (out.dn.mean > 0 && out.dn.mean < s.white_level_dn) ? 1 : 0;
    out.uncertain.mean_dn *= inside;
    out.uncertain.variance_dn2 *= inside;
    out.dn.mean -= inside * (s.quantisation == Quantisation::floor ? 0.5 : 0.0);
    out.dn.variance += inside / 12;
  }
  return out;
}

/// Holds the variance of one pixel's change when the effects that are not kept are left out, with the same random
/// numbers. A change of a Poisson mean by delta occasionally moves the count by an integer: at most min(1/4, delta).
struct ChangeVariance {
  double pixel = 0, line = 0;
};

ChangeVariance change_variance(const SensorModel& s, const Charge& q, NoiseSourceSet kept) {
  const Budget all = budget_of(s, q, NoiseSourceSet::all()), left = budget_of(s, q, kept);
  ChangeVariance v;
  v.line = std::max(0.0, all.line_variance - left.line_variance);
  v.pixel = std::max(0.0, all.collected_variance - left.collected_variance) +
            std::max(0.0, all.pixel_variance - left.pixel_variance);
  if (!kept.has(Effect::prnu)) v.pixel += std::min(0.25, s.prnu * q.signal);
  if (!kept.has(Effect::dsnu)) v.pixel += std::min(0.25, s.dsnu * q.dark);
  if (kept.has(Effect::prnu)) v.pixel += square(s.prnu) * (q.moved->variance_e2[q.channel] + square(q.shift));
  if (!kept.has(Effect::quantisation)) v.pixel += 1 / (12 * square(s.system_gain_dn_per_e));
  return v;
}

/// Returns how far the charge of a hot pixel can change: all of it if hot pixels are left out, the excess over
/// saturation if clipping is.
double changed_charge_of_hot_pixel(const SensorModel& s, const Charge& q, NoiseSourceSet kept) {
  if (q.hot == 0) return 0;
  const double hot = q.hot * hottest, room = saturation_charge_e(s) - q.level();
  if (!kept.has(Effect::hot_pixels)) return kept.has(Effect::clipping) ? std::clamp(room, 0.0, hot) : hot;
  const double noise = sigmas * std::sqrt(q.level() + hot + square(s.read_noise_e));
  return kept.has(Effect::clipping) ? 0 : std::max(0.0, hot + noise - room);
}

/// Holds what telegraph noise may change in one channel of a block: the mean, and the variance [DN, DN^2].
struct TelegraphChange {
  double mean_dn = 0, variance_dn2 = 0;
};

/// Returns bounds for telegraph noise that is left out: five standard deviations of mean and variance of independent
/// pixels, and one pixel more at the one-in-a-million amplitude, since the tail is exponential. If clipping is left out
/// instead, as many pixels as a block may hold move by what their amplitude exceeds the range by.
TelegraphChange telegraph_change(const SensorModel& s, const Charge& q, NoiseSourceSet kept) {
  const double variance = telegraph_variance_e2(s), k = s.system_gain_dn_per_e, largest = 0.5 * hottest * s.telegraph_e;
  if (variance == 0) return {};
  if (!kept.has(Effect::telegraph_noise)) {
    const double fourth = 1.5 * s.telegraph_fraction * square(square(s.telegraph_e));
    const double mean = sigmas * std::sqrt(variance / channel_pixels) + largest / channel_pixels;
    const double spread = sigmas * std::sqrt((fourth - square(variance)) / channel_pixels);
    return {k * mean, k * k * (variance + spread + square(largest) / channel_pixels)};
  }
  if (kept.has(Effect::clipping)) return {};
  const double noise = sigmas * std::sqrt(q.level() + square(s.read_noise_e));
  const double level = q.level(), room = std::min(saturation_charge_e(s) - level, s.black_level_dn / k + level);
  const double beyond = k * std::clamp(largest + noise - room, 0.0, largest);
  const double share = count_in_block(s.telegraph_fraction) / channel_pixels;
  return {share * beyond, share * square(beyond)};
}

/// Returns by how much the slope of the glow in a block may change the variance, if glow is left out [DN^2]: the
/// variance of its means, and its covariance with the slopes of the scene, which are no larger than what is seen.
double glow_slope_change(const SensorModel& s, const Charge& q, NoiseSourceSet kept, double seen_dn2) {
  if (kept.has(Effect::amplifier_glow)) return 0;
  const double slope_dn2 = square(s.system_gain_dn_per_e) * q.glow_variance;
  return slope_dn2 + 2 * std::sqrt(slope_dn2 * seen_dn2);
}

/// Holds bounds on the changes in one channel of a block.
struct ChannelChange {
  double shift_dn = 0;    // known shift of the mean
  double scatter_dn = 0;  // bound on the scatter of the mean
  double relative_variance = 0;
  double noise_sigmas = sigmas;  // see MovedChange
};

ChannelChange channel_change(const SensorModel& s, const Charge& q, NoiseSourceSet kept) {
  const ChannelMoments all = moments_of(s, budget_of(s, q, NoiseSourceSet::all()), NoiseSourceSet::all());
  Charge unmoved = q;
  unmoved.signal = std::max(0.0, q.signal - q.shift);
  const ChannelMoments left = moments_of(s, budget_of(s, unmoved, kept), kept);
  const double k = s.system_gain_dn_per_e;
  const double passed = std::max(all.unclipped, left.unclipped);
  const ChangeVariance change = change_variance(s, q, kept);
  const double pixel = passed * k * k * change.pixel, line = passed * k * k * change.line;
  const double hot_dn = k * changed_charge_of_hot_pixel(s, q, kept), hot_count = count_in_block(s.hot_pixel_fraction);
  const double hot_mean = hot_count * hot_dn / channel_pixels,
               hot_variance = hot_count * square(hot_dn) / channel_pixels;
  const TelegraphChange telegraph = telegraph_change(s, q, kept);
  // Where most pixels are clipped, the few others determine the variance.
  const double pixels = std::max(1.0, channel_pixels * std::min(all.inside, left.inside));
  MovedChange moved_light;
  if (q.moved->moves()) {
    moved_light = moved_change(*q.moved, q.contrast, q.channel,
                               {all.dn.variance / square(k), q.signal, pixels, 1 / k, variance_floor_dn2 / square(k)});
  }
  ChannelChange out;
  out.shift_dn = left.dn.mean - all.dn.mean;
  const bool quantisation_differs = pixel + line > 0 || !kept.has(Effect::quantisation);
  const double rounding_mean = quantisation_differs ? all.uncertain.mean_dn + left.uncertain.mean_dn : 0;
  const double rounding_variance = quantisation_differs ? all.uncertain.variance_dn2 + left.uncertain.variance_dn2 : 0;
  // Without clipping, a pixel at the end of the range may read one code beyond it.
  const double beyond = kept.has(Effect::clipping) ? 0 : count_in_block(1 - all.inside) / channel_pixels;
  out.scatter_dn = sigmas * std::sqrt(pixel / channel_pixels + line / block_lines) + rounding_mean + hot_mean +
                   telegraph.mean_dn + beyond + k * (q.clipped + moved_light.scatter_e);
  // Terms of the sample variances: their own scatter, and the sample covariance of what is left out with what is kept.
  const double larger = std::max(all.dn.variance, left.dn.variance);
  const double slope = std::max(all.variance_slope_dn, left.variance_slope_dn);
  const double moved =
      std::fabs(left.dn.variance - all.dn.variance) + rounding_variance + hot_variance + telegraph.variance_dn2 +
      beyond + glow_slope_change(s, q, kept, larger) +
      sigmas * (pixel * std::sqrt(2 / pixels) + line * std::sqrt(2 / std::min(block_lines, pixels)) +
                2 * std::sqrt((pixel + line + telegraph.variance_dn2) * larger / pixels)) +
      slope * (std::fabs(out.shift_dn) + sigmas * std::sqrt(pixel / channel_pixels + line / block_lines));
  const double seen = all.dn.variance * (1 - sigmas * std::sqrt(2 / pixels));  // lower bound of a block's variance
  out.relative_variance = moved / std::max(seen, variance_floor_dn2) + moved_light.relative_variance;
  out.noise_sigmas = moved_light.sigmas;
  return out;
}

/// Returns how far the mean of one channel of a block, with all effects, may be from its expected value [DN].
double scatter_of_mean_dn(const SensorModel& s, const Charge& q) {
  const NoiseSourceSet all = NoiseSourceSet::all();
  const Budget budget = budget_of(s, q, all);
  const double k = s.system_gain_dn_per_e;
  const double pixel_e2 = budget.collected_variance + square(s.prnu) * q.contrast.variance_e2[q.channel] +
                          budget.pixel_variance + 1 / (12 * square(k));
  const double hot_e = changed_charge_of_hot_pixel(s, q, all.without(Effect::hot_pixels));
  return k * sigmas * std::sqrt(pixel_e2 / channel_pixels + budget.line_variance / block_lines) +
         k * count_in_block(s.hot_pixel_fraction) * hot_e / channel_pixels +
         telegraph_change(s, q, all.without(Effect::telegraph_noise)).mean_dn;
}

/// Returns whether the brightest pixel of a block may saturate: contrast and means are then not those of the light.
bool saturates(const SensorModel& s, const Exposure& exposure, const BlockLevel& block) {
  const auto dark = dark_mean_e(s, exposure);
  const double level = block.peak_e + block.glow.peak_e + *std::max_element(dark.begin(), dark.end());
  const double variance_e2 = level + square(s.prnu * block.peak_e) + square(s.read_noise_e);
  return level + sigmas * std::sqrt(variance_e2) >= saturation_charge_e(s);
}

Charge charge_of(const SensorModel& s, const Exposure& exposure, int channel, double signal_e, const BlockLevel& block,
                 const MovedLight& moved) {
  const double time_factor = exposure.time_s * dark_current_factor(s, exposure.temperature_c);
  const bool clipped = moved.moves() && saturates(s, exposure, block);
  return {signal_e,
          dark_mean_e(s, exposure)[channel],
          s.hot_pixel_current_e_per_s * time_factor,
          block.glow.mean_e,
          block.glow.variance_e2,
          channel,
          &moved,
          moved.mean_e[channel],
          clipped ? moved.moved_e[channel] : 0,
          clipped ? Contrast{} : block.contrast};
}

Lab lab_of_dn(const SensorModel& s, const Developing& developing, const Vector3& dn) {
  Vector3 rgb{};
  for (int c = 0; c < 3; ++c) {
    rgb[c] = (dn[c] - s.black_level_dn) / (s.system_gain_dn_per_e * developing.white_e[c]);
  }
  return lab_of(xyz_of(developing.camera_to_xyz * rgb), *xyz_of(white_d65));
}

PredictedChange larger(const PredictedChange& a, const PredictedChange& b) {
  return {std::max(a.delta_e, b.delta_e), std::max(a.relative_variance, b.relative_variance)};
}

/// Returns the largest colour difference between a mean and its possible values by shift and scatter [DN].
double farthest(const SensorModel& s, const Developing& developing, const Vector3& mean, const Vector3& shift,
                const Vector3& scatter) {
  const Lab before = lab_of_dn(s, developing, mean);
  double largest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Vector3 after = mean;
    for (int c = 0; c < 3; ++c) after[c] += shift[c] + ((corner >> c) & 1 ? scatter[c] : -scatter[c]);
    largest = std::max(largest, ciede2000(before, lab_of_dn(s, developing, after)));
  }
  return largest;
}

/// Predicts the change of a block whose pixels have a signal, without and with the effects that move light.
/// @param moved what those add that are left out
PredictedChange change_at(const SensorModel& sensor, const Exposure& exposure, const Developing& developing,
                          const Vector3& signal_e, const BlockLevel& block, const MovedLight& moved,
                          NoiseSourceSet kept) {
  PredictedChange out;
  Vector3 mean{}, shift{}, scatter{}, noise{};
  for (int c = 0; c < 3; ++c) {
    const Charge charge = charge_of(sensor, exposure, c, signal_e[c], block, moved);
    mean[c] = moments_of(sensor, budget_of(sensor, charge, NoiseSourceSet::all()), NoiseSourceSet::all()).dn.mean;
    const ChannelChange change = channel_change(sensor, charge, kept);
    shift[c] = change.shift_dn;
    scatter[c] = change.scatter_dn;
    if (moved.moves()) noise[c] = change.noise_sigmas / sigmas * scatter_of_mean_dn(sensor, charge);
    out.relative_variance = std::max(out.relative_variance, change.relative_variance);
  }
  // The remaining noise changes the colour: where it happens to be grey, differences count most. Where the change is
  // that of light that moves, which is computed from the pixels, colours are those that noise can make.
  const double grey = (mean[0] + mean[1] + mean[2]) / 3 - sensor.black_level_dn;
  Vector3 neutral{};
  for (int c = 0; c < 3; ++c) {
    const double dn = sensor.black_level_dn + grey * developing.white_e[c] / developing.white_e[1];
    neutral[c] = moved.moves() ? std::clamp(dn, mean[c] - noise[c], mean[c] + noise[c]) : dn;
  }
  out.delta_e = std::max(farthest(sensor, developing, mean, shift, scatter),
                         farthest(sensor, developing, neutral, shift, scatter));
  for (int corner = 0; moved.moves() && corner < 8; ++corner) {
    Vector3 colour = mean;
    for (int c = 0; c < 3; ++c) colour[c] += (corner >> c) & 1 ? noise[c] : -noise[c];
    out.delta_e = std::max(out.delta_e, farthest(sensor, developing, colour, shift, scatter));
  }
  return out;
}

}  // namespace

Developing developing_of(const SensorModel& sensor, const Exposure& exposure, const Matrix3& camera_to_xyz,
                         const Vector3& neutral, std::span<const BlockLevel> blocks) {
  double level = 0;
  for (const BlockLevel& block : blocks) {
    for (int c = 0; c < 3; ++c) level = std::max(level, block.signal_e[c] / neutral[c]);
  }
  level = std::min(level, saturation_charge_e(sensor));
  for (int c = 0; c < 3; ++c) {
    const Budget black =
        budget_of(sensor, charge_of(sensor, exposure, c, 0, {}, no_light_moves), NoiseSourceSet::all());
    const double variance_e2 = black.collected_variance + black.pixel_variance + black.line_variance +
                               1 / (12 * square(sensor.system_gain_dn_per_e));
    level = std::max(level, std::sqrt(variance_e2) / (black_noise_of_white * neutral[c]));
  }
  return {camera_to_xyz * diagonal3(neutral), {level * neutral[0], level * neutral[1], level * neutral[2]}};
}

PredictedChange predict_change(const SensorModel& sensor, const Exposure& exposure, const Developing& developing,
                               const BlockLevel& block, NoiseSourceSet kept) {
  const auto change = [&](const Vector3& signal_e, const BlockLevel& level, const MovedLight& moved) {
    return change_at(sensor, exposure, developing, signal_e, level, moved, kept);
  };
  BlockLevel darkest = block;
  darkest.glow.mean_e = block.glow.min_e;
  PredictedChange out =
      larger(change(block.signal_e, block, no_light_moves), change(block.darkest_e, darkest, no_light_moves));
  if (const MovedLight moved = block.left_out(kept); moved.moves()) {
    out = larger(out, change(block.signal_e, block, moved));
    // Where pixels saturate, those around them determine mean and variance.
    if (saturates(sensor, exposure, block)) out = larger(out, change(block.darkest_e, darkest, moved));
  }
  if (kept.has(Effect::clipping)) return out;
  // The mean of a block does not show the loss of its brightest pixel: a block as bright as that is predicted too.
  BlockLevel brightest;
  brightest.glow.mean_e = block.glow.peak_e;
  brightest.glow.variance_e2 = block.glow.variance_e2;
  const Vector3 peak_e{block.peak_e, block.peak_e, block.peak_e};
  return larger(out, change_at(sensor, exposure, developing, peak_e, brightest, no_light_moves,
                               NoiseSourceSet::all().without(Effect::clipping)));
}

}  // namespace lowlux::isp
