#include "isp/model/sensor/exposure_controller.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "isp/model/sensor/saturation_limits.h"

namespace lowlux::isp {
namespace {

constexpr int decisive_frames = 4;                              // without flicker
constexpr double other_light = 1.25, other_light_of_lamps = 3;  // ratio of highlights
constexpr double new_tolerance = 0.01, held_tolerance = 0.03;   // loss of power for which a setting is not left
constexpr double margin = 0.01;            // of the highlight, with which a better setting must be possible, too
constexpr double even_range = 0.04;        // of the highlights of frames, relative, of a light that is steady
constexpr double flicker_range = 0.08;     // by which highlights of frames both rise and fall where light flickers
constexpr double same_peak = 0.8;          // of the peak, that the largest of 12 frames of the same flicker reaches
constexpr double flicker_margin = 1.05;    // of the peak, that may be higher than it was seen
constexpr double flicker_tolerance = 0.2;  // loss of power for which a setting is not left under flicker
constexpr double long_tolerance = 0.5;     // the same for leaving a flicker-free exposure for one that shows flicker
constexpr double beyond_white = 1.2;       // assumed of a peak that clips although another frame did not
constexpr double as_stated = 0.02;         // relative difference up to which a frame has the setting that was made
constexpr double near_white = 0.995;       // fraction of the range from which a highlight counts as clipped

/// A clipped highlight is brighter than its codes say, the more so the more pixels clip.
double excess_of(double clipped_fraction) {
  if (clipped_fraction > 0.5) return 32;
  if (clipped_fraction > 0.1) return 8;
  if (clipped_fraction > 0.02) return 2.5;
  return clipped_fraction > 0.005 ? 1.5 : 1.15;
}

double noise_e(const SensorModel& sensor) {
  return std::hypot(sensor.read_noise_e, std::sqrt(quantisation_dn2) / sensor.system_gain_dn_per_e);
}

/// Returns the charge that a fraction of the pixels exceed whose mean is `mean_e`.
double exceeded_e(double mean_e, double noise_e, double z) {
  return mean_e + z * std::sqrt(std::max(mean_e, 0.0) + noise_e * noise_e);
}

}  // namespace

ExposureController::ExposureController(Setup setup)
    : gains_(std::move(setup.gains)), limits_(setup.limits), setting_(setup.at), latency_frames_(setup.latency_frames) {
  assert(!gains_.empty() && setting_.gain < gains_.size());
  choice_.setting = setting_;
}

void ExposureController::reset(const ExposureSetting& at) {
  setting_ = at;
  light_.reset();
  peak_e_per_s_.reset();
  is_flicker_seen_ = settled_ = false;
  count_ = await_frames_ = 0;
}

void ExposureController::was_set(double exposure_s) {
  const double wanted_s = setting_.exposure_s;
  setting_.exposure_s = exposure_s;
  const double slack_s = 0.51 * limits_.times.step_s + 1e-3 * wanted_s;
  if (exposure_s < wanted_s - slack_s) limits_.times.max_s = std::max(exposure_s, limits_.times.min_s);
  if (exposure_s > wanted_s + slack_s) limits_.times.min_s = std::min(exposure_s, limits_.times.max_s);
}

std::size_t ExposureController::gain_near(double factor) const {
  const auto nearest = std::ranges::min_element(
      gains_, {}, [&](const GainStep& gain) { return std::abs(std::log(gain.factor / factor)); });
  return static_cast<std::size_t>(nearest - gains_.begin());
}

/// Returns whether a frame comes too early to have the setting that was made last.
bool ExposureController::is_awaited(const std::optional<StatedExposure>& stated) {
  if (await_frames_ == 0) return false;
  const auto is_near = [](double value, double wanted) { return std::abs(value - wanted) <= as_stated * wanted; };
  const bool arrived = stated && is_near(stated->exposure_s, setting_.exposure_s) &&
                       is_near(stated->gain_factor, gains_[setting_.gain].factor);
  if (arrived) {
    await_frames_ = 0;
    return false;
  }
  --await_frames_;
  return true;
}

ExposureController::Metered ExposureController::metered(const MeteredCodes& codes,
                                                        const StatedExposure& exposed) const {
  const GainStep& step = gains_[gain_near(exposed.gain_factor)];
  const double dn_per_e = step.sensor.system_gain_dn_per_e * exposed.gain_factor / step.factor;
  const double z = normal_quantile_above(limits_.clipped_fraction);
  const double dark = dark_e_per_s(step, limits_);
  Metered out;
  out.exposure_s = exposed.exposure_s;
  out.highlight_e = codes.highlight_dn / dn_per_e;
  out.clips = codes.highlight_dn >= near_white * codes.range_dn || codes.clipped_fraction > limits_.clipped_fraction;
  const double charge_e = out.clips ? excess_of(codes.clipped_fraction) * codes.range_dn / dn_per_e
                                    : charge_below(std::max(out.highlight_e, 0.0), noise_e(step.sensor), z);
  out.white_e_per_s = codes.range_dn / dn_per_e / exposed.exposure_s;
  out.light.highlight_e_per_s = std::max(charge_e / exposed.exposure_s - dark, 0.0);
  out.light.midtone_e_per_s = codes.midtone_dn / dn_per_e / exposed.exposure_s - dark;
  return out;
}

bool ExposureController::is_short(double exposure_s) const {
  return exposure_s * flicker_hz(limits_.mains) < (limits_.mains == Mains::off ? 0 : 1 - as_stated);
}

/// Returns whether a frame's highlight differs from that of the light by more than noise and flicker do.
bool ExposureController::is_changed_light(const Metered& frame, const GainStep& gain) const {
  if (!light_ || frame.clips) return true;
  const bool may_flicker = is_short(frame.exposure_s);
  if (may_flicker && peak_e_per_s_) return false;  // a darker frame is a trough unless 12 are dark
  const double mean_e = (light_->highlight_e_per_s + dark_e_per_s(gain, limits_)) * frame.exposure_s;
  const double expected_e = exceeded_e(mean_e, noise_e(gain.sensor), normal_quantile_above(limits_.clipped_fraction));
  const double limit = may_flicker || is_flicker_seen_ ? other_light_of_lamps : other_light;
  return frame.highlight_e > limit * expected_e || frame.highlight_e * limit < expected_e;
}

/// Returns the light by the frames since the last setting: means, but the largest highlight of a light that changes,
/// and the largest since its peak was known of one that flickers. Light that only rises or only falls does not flicker.
MeteredLight ExposureController::light_of_frames(bool may_flicker) {
  const std::size_t count = std::min(static_cast<std::size_t>(count_), frames_.size());
  MeteredLight out;
  double least = frames_[static_cast<std::size_t>(count_) % count].highlight_e_per_s, most = least, rise = 0, fall = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const MeteredLight& frame = frames_[(static_cast<std::size_t>(count_) + i) % count];  // from the earliest on
    out.midtone_e_per_s += frame.midtone_e_per_s / static_cast<double>(count);
    out.highlight_e_per_s += frame.highlight_e_per_s / static_cast<double>(count);
    least = std::min(least, frame.highlight_e_per_s);
    most = std::max(most, frame.highlight_e_per_s);
    rise = std::max(rise, frame.highlight_e_per_s - least);
    fall = std::max(fall, most - frame.highlight_e_per_s);
  }
  if (!may_flicker) return out;
  const bool is_full = count == frames_.size(), is_even = most - least <= even_range * out.highlight_e_per_s;
  if (is_full && is_even) is_flicker_seen_ = false;
  if (is_full && (is_even || most < same_peak * peak_e_per_s_.value_or(0))) peak_e_per_s_.reset();
  if (std::min(rise, fall) > flicker_range * out.highlight_e_per_s) {
    is_flicker_seen_ = true;
    peak_e_per_s_ = peak_e_per_s_.value_or(0);
  }
  if (peak_e_per_s_) peak_e_per_s_ = std::max(most, *peak_e_per_s_);
  if (!is_even) out.highlight_e_per_s = most;
  out.highlight_e_per_s = peak_e_per_s_.value_or(out.highlight_e_per_s);
  return out;
}

/// Returns whether the setting need not be left. One that has held for all frames of the mean is left only for one that
/// a slightly brighter highlight allows as well.
bool ExposureController::may_keep_setting() const {
  const auto is_good_to = [&](const ExposureChoice& best, double tolerance) {
    return is_good(setting_, *light_, gains_, limits_, best, tolerance);
  };
  const bool would_flicker = is_short(choice_.setting.exposure_s) && !is_short(setting_.exposure_s);
  if (is_flicker_seen_ && would_flicker) return is_good_to(choice_, long_tolerance);
  if (peak_e_per_s_) return is_good_to(choice_, flicker_tolerance);
  const bool is_held = count_ > static_cast<int>(frames_.size());
  return is_held ? is_good_to(choice_of(1 + margin), held_tolerance) : is_good_to(choice_, new_tolerance);
}

ExposureChoice ExposureController::choice_of(double brightness) const {
  MeteredLight brighter = *light_;
  brighter.highlight_e_per_s *= brightness;
  return choose_exposure(brighter, gains_, limits_);
}

/// Updates what is known of flicker by a frame. Light that clips may be the peak of a flicker.
void ExposureController::follow_flicker(Metered& frame, bool other) {
  if (frame.clips && limits_.mains != Mains::off) {
    const bool is_missed = peak_e_per_s_ && count_ > 0;  // frames of this setting did not clip
    peak_e_per_s_ = std::max(peak_e_per_s_.value_or(0), (is_missed ? beyond_white : 1) * frame.white_e_per_s);
    if (is_missed) frame.light.highlight_e_per_s = *peak_e_per_s_;
  } else if (other || !is_short(frame.exposure_s)) {
    peak_e_per_s_.reset();
    is_flicker_seen_ = is_flicker_seen_ && !other;
  }
}

std::optional<ExposureSetting> ExposureController::take(const MeteredCodes& codes,
                                                        const std::optional<StatedExposure>& stated) {
  if (is_awaited(stated)) return std::nullopt;
  // The range that the frame shows counts: black is measured, and sensors may saturate below their largest code.
  for (GainStep& gain : gains_) gain.sensor.black_level_dn = gain.sensor.white_level_dn - codes.range_dn;
  const StatedExposure exposed = stated.value_or(StatedExposure{setting_.exposure_s, gains_[setting_.gain].factor});
  Metered frame = metered(codes, exposed);
  const bool may_flicker = is_short(exposed.exposure_s);
  const bool other = is_changed_light(frame, gains_[gain_near(exposed.gain_factor)]);
  follow_flicker(frame, other);
  if (other) count_ = 0;
  frames_[static_cast<std::size_t>(count_) % frames_.size()] = frame.light;
  count_ = count_ == 2 * static_cast<int>(frames_.size()) - 1 ? static_cast<int>(frames_.size()) : count_ + 1;
  if (other) settled_ = false;
  if (!other && count_ < (may_flicker ? static_cast<int>(frames_.size()) : decisive_frames)) return std::nullopt;
  light_ = light_of_frames(may_flicker);
  choice_ = choice_of(peak_e_per_s_ && !frame.clips ? flicker_margin : 1);
  if (may_keep_setting()) {
    settled_ = !frame.clips || choice_.clips;
    return std::nullopt;
  }
  setting_ = choice_.setting;
  if (peak_e_per_s_ && !frame.clips) peak_e_per_s_ = 0;  // another exposure sees another peak
  settled_ = false;
  count_ = 0;  // the frames of the new setting replace those that led to it
  await_frames_ = latency_frames_;
  ++changes_;
  return setting_;
}

}  // namespace lowlux::isp
