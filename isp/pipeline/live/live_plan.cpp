#include "isp/pipeline/live/live_plan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "isp/model/sensor/masked_noise.h"
#include "isp/pipeline/plan/dark_charge.h"
#include "isp/pipeline/plan/plan_look.h"
#include "isp/pipeline/plan/plan_noise.h"
#include "isp/pipeline/plan/rendering.h"
#include "isp/raw/black_point.h"
#include "isp/raw/to_linear.h"
#include "isp/render/exposure.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr double still_ev = 0.1;  // exposure stays unchanged for targets nearer than this
constexpr double step = 0.15;   // fraction of the difference by which exposure, white and noise follow with each frame
constexpr double d65_k = 6504;  // colour temperature of output_white
// Fraction of white. A frame that is bright everywhere shows no black; pedestals of cameras are an eighth of white at
// most.
constexpr double highest_black = 0.25;
constexpr double level_slack = 1.2;  // a level of noise reduction is left only this far beyond its limit

/// Returns measured noise that follows the frames slowly: one of them is a rough measurement.
NoiseLine blended(const NoiseLine& before, const NoiseLine& now) {
  NoiseLine out = before;
  out.gain_dn += step * (now.gain_dn - before.gain_dn);
  out.offset_dn2 += step * (now.offset_dn2 - before.offset_dn2);
  return out;
}

/// Returns the profile as calib::profile_at has it: means over the sites of a colour. Monochrome frames have one for
/// all.
NoiseProfile profile_of(const LiveNoise& noise, const RawDn& raw, const BlackPoint& black) {
  NoiseProfile out{.source = NoiseProfile::Source::profile};
  std::array<int, 3> sites{};
  for (int site = 0; site < 4; ++site) {
    const double range_dn = white_at(raw, site) - black.pedestal_dn[site];
    for (int c = 0; c < 3; ++c) {
      if (raw.layout == SensorLayout::bayer && static_cast<int>(colour_at(raw.phase, site & 1, site >> 1)) != c)
        continue;
      out.scale[c] += noise.gain_dn / range_dn;
      out.offset[c] += noise.black_variance_dn2[site] / (range_dn * range_dn);
      ++sites[c];
    }
  }
  for (int c = 0; c < 3; ++c) {
    out.scale[c] /= sites[c];
    out.offset[c] /= sites[c];
  }
  return out;
}

/// Returns now / before; 1 where one of them is not known: absent, or not a possible value. Clamped to values that
/// means over frames treat as entirely different light.
double ratio(const std::optional<double>& now, const std::optional<double>& before) {
  const auto known = [](const std::optional<double>& figure) {
    return figure && *figure > 0 && std::isfinite(*figure);
  };
  return known(now) && known(before) ? std::clamp(*now / *before, 1e-9, 1e9) : 1;
}

/// Returns a noise line at another gain of the sensor: the codes for each electron scale with it.
NoiseLine at_gain(const NoiseLine& line, double factor) {
  return {line.gain_dn * factor, line.offset_dn2 * factor * factor, line.gain_error_dn * factor,
          line.offset_error_dn2 * factor * factor};
}

LiveNoise noise_of(const NoiseLine& line) {
  const double variance = line.offset_dn2;
  return {.gain_dn = line.gain_dn, .black_variance_dn2 = {variance, variance, variance, variance}};
}

/// Returns noise whose dark charge is that of the masked pixels, where they made the black point.
LiveNoise with_masked_charge(LiveNoise noise, const BlackPoint& black) {
  if (!noise.pedestal_dn || black.source != BlackPoint::Source::masked_pixels) return noise;
  for (int site = 0; site < 4; ++site) {
    noise.black_variance_dn2[site] = *masked_variance_dn2({.gain_dn_per_e = noise.gain_dn,
                                                           .read_variance_dn2 = noise.read_variance_dn2,
                                                           .level_dn = black.pedestal_dn[site],
                                                           .pedestal_dn = (*noise.pedestal_dn)[site]});
  }
  return noise;
}

/// Returns the dark charge in a black point of masked pixels [DN]; 0 where the pedestal is not known apart from it.
PerSite<double> dark_dn_of(const BlackPoint& black, const std::optional<LiveNoise>& noise) {
  PerSite<double> out{};
  if (!noise || !noise->pedestal_dn || black.source != BlackPoint::Source::masked_pixels) return out;
  for (int site = 0; site < 4; ++site) out[site] = black.pedestal_dn[site] - (*noise->pedestal_dn)[site];
  return out;
}

/// Returns the camera RGB of daylight; equal channels where no calibration states it.
Vector3 daylight_of(const CameraColour& colour) {
  if (colour.calibrations.empty()) return {1, 1, 1};
  const auto daylight = neutral_of_white(colour, white_d65);
  return daylight ? *daylight : Vector3{1, 1, 1};
}

Vector3 scaled_to_one(const Vector3& v) {
  const double largest = *std::ranges::max_element(v);
  return {v[0] / largest, v[1] / largest, v[2] / largest};
}

}  // namespace

LivePlanner::LivePlanner(const LiveSetup& setup) : setup_(setup) {
  plan_.width = setup.active.width;
  plan_.height = setup.active.height;
  plan_.levels.defects = setup.defects;
  plan_.options.tone = setup.tone;
  plan_.options.samples = setup.samples;
  plan_.options.look = setup.look;
  plan_.options.find_defects = false;
}

void LivePlanner::reset() {
  exposure_ev_.reset();
  neutral_.reset();
  line_.reset();
  has_level_ = false;
  noise_iso_.reset();
  last_ = {};
  first_ = true;
}

bool LivePlanner::needs_light(const LiveFacts& facts) const {
  const bool colour = setup_.format.layout == SensorLayout::bayer;
  return !facts.exposure_ev || (colour && !facts.neutral) || setup_.look.look == Look::eye ||
         facts.denoise.mode == LiveDenoise::Mode::automatic ||
         (colour && setup_.max_demosaic >= DemosaicMethod::residual);
}

MeterWants LivePlanner::wants(const LiveFacts& facts, bool statistics) const {
  const bool finds_black = !facts.black_dn && setup_.masked.empty();
  return {.light = needs_light(facts), .noise = statistics || finds_black || !facts.noise, .statistics = statistics};
}

Result<void> LivePlanner::set_black(const LiveFacts& facts, FrameMeter& meter, const RawFrame& frame) {
  BlackPoint& black = plan_.levels.black;
  black.holds = BlackPoint::Holds::pedestal_and_dark;
  if (facts.black_dn) {
    black.pedestal_dn = *facts.black_dn;
    black.source = BlackPoint::Source::given;
    decision_.black = LiveSource::given;
  } else if (const auto masked = meter.masked_dn()) {
    black.pedestal_dn = *masked;
    black.source = BlackPoint::Source::masked_pixels;
    decision_.black = LiveSource::masked_pixels;
  } else {
    black.pedestal_dn = meter.tiles().darkest_dn();
    for (int site = 0; site < 4; ++site) {
      black.pedestal_dn[site] = std::min(black.pedestal_dn[site], highest_black * white_at(frame.raw, site));
    }
    black.source = BlackPoint::Source::given;
    decision_.black = LiveSource::frame;
  }
  for (int site = 0; site < 4; ++site) {
    const double white = white_at(frame.raw, site);
    if (white > black.pedestal_dn[site]) continue;
    return fail(ErrorCode::malformed,
                fmt::format("the white level {:g} DN is not above the black level {:g} DN, dark charge included", white,
                            black.pedestal_dn[site]));
  }
  return {};
}

void LivePlanner::set_noise(const LiveFacts& facts, const FrameMeter& meter, RawFrame& frame) {
  if (meter.wanted().noise) {
    decision_.measured = meter.tiles().line(plan_.levels.black.pedestal_dn, frame.raw.white_dn[1]);
  }
  if (facts.noise) {
    frame.noise = profile_of(with_masked_charge(*facts.noise, plan_.levels.black), frame.raw, plan_.levels.black);
    decision_.noise = LiveSource::given;
  } else {
    if (!facts.follows) line_.reset();
    if (line_) line_ = at_gain(*line_, ratio(facts.iso, noise_iso_));
    noise_iso_ = facts.iso;
    if (decision_.measured) line_ = line_ ? blended(*line_, *decision_.measured) : *decision_.measured;
    frame.noise.reset();
    if (line_) frame.noise = profile_of(noise_of(*line_), frame.raw, plan_.levels.black);
    decision_.noise = line_ ? LiveSource::frame : LiveSource::none;
  }
  plan_.levels.electrons_at_white.reset();
  if (frame.noise) plan_.levels.electrons_at_white = electrons_at_white(frame.raw, *frame.noise);
}

/// Returns the given white, else an estimate that follows the scene, else daylight, else equal channels.
WhiteBalance LivePlanner::choose_white(const LiveFacts& facts, RawFrame& frame) {
  if (frame.raw.layout == SensorLayout::monochrome) return {};
  if (facts.neutral) {
    decision_.white = LiveSource::given;
    frame.colour.as_shot_neutral = scaled_to_one(*facts.neutral);
  } else {
    memory_.resize(thumbnail_.mean.plane[0].size());
    const WhiteEstimate found =
        estimate_white(std::as_const(thumbnail_).mean.view(), block_noise_std(frame.raw, thumbnail_), frame.colour,
                       AutoWhiteOptions{}, memory_);
    decision_.white = LiveSource::frame;
    if (found.blocks >= AutoWhiteOptions{}.min_blocks) {
      const Vector3& now = found.balance.neutral;
      if (!neutral_) neutral_ = now;
      for (int c = 0; c < 3; ++c) (*neutral_)[c] += step * (now[c] - (*neutral_)[c]);
    }
    if (!neutral_) {
      decision_.white = LiveSource::none;
      frame.colour.as_shot_neutral = daylight_of(frame.colour);
    } else {
      frame.colour.as_shot_neutral = scaled_to_one(*neutral_);
    }
  }
  WhiteBalance out{.neutral = *frame.colour.as_shot_neutral, .source = WhiteSource::as_shot};
  if (frame.colour.calibrations.empty()) return out;
  if (const auto white = white_of_neutral(frame.colour, out.neutral)) {
    out.white = *white;
  } else if (!facts.neutral) {  // an estimate that is not a valid colour of a light is replaced by daylight
    decision_.white = LiveSource::none;
    frame.colour.as_shot_neutral = out.neutral = daylight_of(frame.colour);
    if (const auto daylight = white_of_neutral(frame.colour, out.neutral)) out.white = *daylight;
  }
  return out;
}

Result<Matrix3> LivePlanner::balanced_matrix(const LiveFacts& facts, const RawFrame& frame,
                                             const WhiteBalance& balance) const {
  const Vector3 luminance = *luminance_weights(plan_.options.space);
  const Matrix3 colours = saturation_matrix(facts.saturation, luminance);
  if (facts.colour_matrix) return colours * *facts.colour_matrix;
  const bool coloured = frame.raw.layout != SensorLayout::monochrome;
  if (coloured && frame.colour.calibrations.empty()) return colours;
  if (coloured && !balance.white) {
    return fail(ErrorCode::malformed, "the white balance is not the colour of a light under the camera's matrices");
  }
  Result<Matrix3> balanced = balanced_to_output(frame, plan_.options, balance);
  if (!balanced) return balanced;
  return coloured ? colours * *balanced : *balanced;
}

double LivePlanner::smooth_exposure(double target_ev) {
  if (!exposure_ev_) exposure_ev_ = target_ev;
  const double away = target_ev - *exposure_ev_;
  if (std::fabs(away) > still_ev) *exposure_ev_ += step * away;
  return *exposure_ev_;
}

Result<void> LivePlanner::set_rendering(const LiveFacts& facts, RawFrame& frame) {
  Rendering& out = plan_.rendering;
  const WhiteBalance balance = choose_white(facts, frame);
  out.neutral = balance.neutral;
  out.white = balance.white;
  out.white_balance_rule = name_of(balance.source);
  out.white_gain = white_gain_of(balance.neutral);
  const Result<Matrix3> balanced = balanced_matrix(facts, frame, balance);
  if (!balanced) return tl::make_unexpected(balanced.error());
  blocks_.resize(needs_light(facts) ? thumbnail_.mean.plane[0].size() : 0);
  rendered_luminance(thumbnail_.mean, plan_.options.space, out.white_gain, *balanced, blocks_);
  largest_.resize(blocks_.size());
  const double noise_std = thumbnail_.black_noise_std * *std::ranges::max_element(out.white_gain);
  plan_.options.exposure_ev = facts.exposure_ev;
  if (facts.exposure_ev) {
    out.exposure_ev = *facts.exposure_ev;
    out.exposure_rule = "given";
  } else {
    memory_.assign(blocks_.begin(), blocks_.end());
    rendered_largest(thumbnail_.mean, out.white_gain, *balanced, largest_);
    const AutoExposure automatic = auto_exposure_reordering(
        memory_, largest_, noise_std, exposure_options(frame.raw.info, thumbnail_, plan_.options));
    out.exposure_ev = smooth_exposure(automatic.ev);
    out.exposure_rule = name_of(automatic.rule);
  }
  std::optional<WhitePoint> white = out.white;
  // A matrix to the image's primaries states colours relative to its white, not to the light of the scene.
  if (!white && facts.colour_matrix && frame.raw.layout != SensorLayout::monochrome) {
    white = WhitePoint{.xy = output_white, .cct_k = d65_k};
  }
  Result<std::optional<LookPlan>> look = plan_look(
      frame, {blocks_, noise_std, white, out.exposure_ev, *balanced, 0, thumbnail_.light_range}, plan_.options);
  if (!look) return tl::make_unexpected(std::move(look.error()));
  out.look = *std::move(look);
  if (out.look) out.exposure_ev += out.look->dimming_ev;
  out.limit = tone_limit(plan_.options.tone, out.exposure_ev);
  out.transform = transform_of(out.look ? out.look->adaptation * *balanced : *balanced, out, plan_.options);
  if (out.limit != tone_limit_) {
    out.tone = tone_of(out.limit, plan_.options);
    tone_limit_ = out.limit;
  }
  return {};
}

/// Chooses the level. A level chosen for the previous frame is kept until the signal-to-noise ratio is clearly beyond
/// its range.
void LivePlanner::choose_level(const LiveDenoise& wanted, const RawFrame& frame) {
  NoiseReduction& out = plan_.noise_reduction;
  std::optional<denoise::Level> level;
  out.snr.reset();
  const bool can = plan_.levels.electrons_at_white && frame.raw.layout == SensorLayout::bayer;
  if (can) {
    const NoiseModel model = noise_model(frame, plan_.levels, plan_.rendering.white_gain);
    out.source = model.source;
    out.noise = model.noise;
    out.options.white_gain = model.white_gain;
  }
  if (can && wanted.mode != LiveDenoise::Mode::off) {
    if (wanted.mode == LiveDenoise::Mode::level) {
      level = wanted.level;
    } else {
      out.snr = middle_snr(frame, plan_.levels, out.noise, thumbnail_, snr_);
      const bool kept =
          has_level_ && (level_for(*out.snr * level_slack) == level_ || level_for(*out.snr / level_slack) == level_);
      level = kept ? level_ : level_for(*out.snr);
      level_ = level;
      has_level_ = true;
    }
  }
  if (level) level = std::min(*level, setup_.most);
  decision_.level = level;
  decision_.reducible = can;
  level = std::min(level, wanted.most);  // nullopt is below every level
  out.level = level;
  out.options.level = level.value_or(denoise::Level::draft);
}

void LivePlanner::set_temporal(const LiveFacts& facts, const RawFrame& frame) {
  std::optional<TemporalReduction>& temporal = plan_.noise_reduction.temporal;
  const bool can = setup_.temporal && facts.denoise.temporal && plan_.levels.electrons_at_white &&
                   frame.raw.layout == SensorLayout::bayer;
  if (!can) {
    temporal.reset();
    last_ = {};
    first_ = true;  // the next frame starts a new mean
    return;
  }
  temporal.emplace();
  const double e_per_dn =
      (*plan_.levels.electrons_at_white)[0] / (white_at(frame.raw, 0) - plan_.levels.black.pedestal_dn[0]);
  temporal->light = ratio(facts.exposure_s, last_.exposure_s);
  if (decision_.noise == LiveSource::frame) {
    // Electrons whose gain is measured on the frames are a unit that changes with its measurement.
    temporal->light *= ratio(facts.iso, last_.iso) * ratio(e_per_dn, last_.e_per_dn);
  }
  temporal->restart = first_ || !facts.follows;
  first_ = false;
  last_ = {facts.exposure_s, facts.iso, e_per_dn};
}

Result<void> LivePlanner::plan(const LiveFacts& facts, FrameMeter& meter, RawFrame& frame) {
  decision_ = {};
  plan_.warnings.clear();
  frame.raw.info.exposure_s = facts.exposure_s;
  frame.raw.info.iso = facts.iso;
  frame.raw.info.f_number = facts.f_number;
  plan_.options.look.which = all_effects_ ? LookChoice::Which::all : setup_.look.which;
  plan_.options.look.scene_luminance_cd_m2 =
      facts.scene_luminance_cd_m2 ? facts.scene_luminance_cd_m2 : setup_.look.scene_luminance_cd_m2;
  if (Result<void> black = set_black(facts, meter, frame); !black) return black;
  set_noise(facts, meter, frame);
  if (needs_light(facts)) meter.thumbnail().make(frame, plan_.levels.black, thumbnail_);
  plan_.levels.stated_dark_dn = dark_dn_of(plan_.levels.black, facts.noise);
  thumbnail_.light_range = light_range_of(frame, plan_.levels);
  if (Result<void> rendering = set_rendering(facts, frame); !rendering) return rendering;
  choose_level(facts.denoise, frame);
  set_temporal(facts, frame);
  DemosaicRequest interpolation{.max_method = std::min(setup_.max_demosaic, facts.max_demosaic)};
  if (needs_light(facts)) interpolation.signal_e = median_green_e(frame, plan_.levels, thumbnail_, memory_);
  plan_.demosaic = plan_demosaic(frame, plan_.levels, plan_.rendering, plan_.noise_reduction, interpolation);
  plan_.from_codes = renders_from_codes(frame, plan_.levels, plan_.noise_reduction.reduces());
  if (plan_.from_codes || frame.raw.layout != SensorLayout::bayer) plan_.levels.electrons_at_white.reset();
  return {};
}

}  // namespace lowlux::isp
