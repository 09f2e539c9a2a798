#include "isp/pipeline/plan/plan_develop.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "isp/pipeline/budget/step_plan.h"
#include "isp/pipeline/plan/dark_charge.h"
#include "isp/pipeline/plan/picked_white.h"
#include "isp/pipeline/plan/plan_noise.h"
#include "isp/pipeline/plan/rendering.h"
#include "isp/raw/corrections.h"
#include "isp/raw/measure/saturation.h"
#include "isp/raw/measure/thumbnail.h"
#include "isp/raw/subtract_dark_frame.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

Result<void> check(const RawFrame& frame, const DevelopOptions& o) {
  if (Result<void> options = check_options(o); !options) return options;
  const bool is_measurement = is_linear(o.space) || o.look.look != Look::camera;
  if (has_unknown_colours(frame, o.space) && is_measurement) {
    return fail(ErrorCode::insufficient,
                "the file has no colour matrix and the decoder does not know the camera; "
                "--space camera develops it without colour conversion");
  }
  const Rect& crop = frame.raw.default_crop;
  if (o.half && (crop.width < 2 || crop.height < 2)) {
    return fail(ErrorCode::invalid_argument, "the image is too small for half size");
  }
  return {};
}

// Returns the system gain [DN/e-]: a variance of scale * x at the fraction x of white is scale * range for each DN.
double gain_dn_per_e(const RawFrame& frame, const BlackPoint& black) {
  return frame.noise ? *std::ranges::max_element(frame.noise->scale) * mean_range_dn(frame.raw, black) : 0;
}

// Returns the noise that the search for defects is based on.
DefectNoise defect_noise(const RawFrame& frame, const BlackPoint& black, const Thumbnail& thumbnail) {
  return {thumbnail.black_noise_std * mean_range_dn(frame.raw, black), gain_dn_per_e(frame, black),
          view_of(frame.noise_ratio.get())};
}

// Holds the defects that the source lists, those with an unknown dark value and, if requested, those found in the
// measured values.
struct FoundDefects {
  std::vector<Pixel> defects;
  std::vector<std::string> warnings;
};

FoundDefects all_defects(const RawFrame& frame, const RawDn& measured, const Thumbnail& thumbnail,
                         const RawLevels& levels, bool search, Executor& executor) {
  FoundDefects out;
  const auto named = named_defects(frame.raw, frame.corrections.defects);
  if (!named) {
    out.warnings.emplace_back("the file names a large part of its pixels as defective: these are not repaired");
  }
  out.defects = named.value_or(std::vector<Pixel>{});
  if (levels.dark_frame) out.defects = merged(out.defects, *named_defects(frame.raw, levels.dark_frame->unknown));
  if (!search) return out;
  out.defects =
      merged(out.defects, find_defects(measured, levels.black, defect_noise(frame, levels.black, thumbnail), executor));
  return out;
}

Result<RawLevels> choose_levels(const RawFrame& frame, const DevelopOptions& options) {
  RawLevels out{.dark_frame = options.dark_frame};
  Result<BlackPoint> black = choose_black_point(frame, options);
  if (!black) return tl::make_unexpected(std::move(black.error()));
  out.black = *std::move(black);
  const bool is_measured = out.black.source == BlackPoint::Source::masked_pixels || out.dark_frame;
  const bool holds_dark = out.black.holds == BlackPoint::Holds::pedestal_and_dark;
  if (holds_dark && !is_measured) out.stated_dark_dn = options.black.dark_dn;
  if (frame.noise) out.electrons_at_white = electrons_at_white(frame.raw, *frame.noise);
  out.saturation = choose_saturation(frame, out.black, options);
  return out;
}

void append(std::vector<std::string>& to, std::vector<std::string>& from) {
  std::ranges::move(from, std::back_inserter(to));
  from.clear();
}

}  // namespace

Result<BlackPoint> choose_black_by_gain(const RawFrame& frame, const BlackRequest& request) {
  Result<BlackPoint> black = choose_black(frame.raw, request);
  if (!black || black->source != BlackPoint::Source::masked_pixels) return black;
  MaskedBlack measured = masked_black_of(frame);
  if (measured.black) black = *std::move(measured.black);
  return black;
}

Result<BlackPoint> choose_black_point(const RawFrame& frame, const DevelopOptions& options) {
  return options.dark_frame ? black_of(frame.raw, *options.dark_frame) : choose_black_by_gain(frame, options.black);
}

std::optional<SaturationLevel> choose_saturation(const RawFrame& frame, const BlackPoint& black,
                                                 const DevelopOptions& options) {
  if (!options.find_saturation || options.series_saturation) return options.series_saturation;
  const bool is_stated = frame.noise && frame.noise->source == NoiseProfile::Source::file;  // others may be guessed
  return measure_saturation_below_white(frame.raw, black, is_stated ? frame.noise : std::nullopt);
}

void refer_noise_to_black(RawFrame& frame, const DevelopOptions& options) {
  const RawDn& raw = frame.raw;
  if (!frame.noise || frame.noise->source != NoiseProfile::Source::file) return;
  const Result<BlackPoint> tagged = choose_black(raw, {.choice = BlackChoice::metadata});
  const Result<BlackPoint> black = choose_black_point(frame, options);
  if (!tagged || !black) return;
  std::array<double, 3> stated_dn{}, range_dn{};
  for (int site = 0; site < 4; ++site) {
    const bool is_mosaic = raw.layout == SensorLayout::bayer;
    const int colour = is_mosaic ? static_cast<int>(colour_at(raw.phase, site & 1, site >> 1)) : std::min(site, 2);
    stated_dn[colour] += white_at(raw, site) - tagged->pedestal_dn[site];
    range_dn[colour] += white_at(raw, site) - black->pedestal_dn[site];
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const double ratio = stated_dn[c] / range_dn[c];
    frame.noise->scale[c] *= ratio;
    frame.noise->offset[c] *= ratio * ratio;
  }
}

Result<DevelopPlan> plan_develop(const RawFrame& frame, const DevelopOptions& options, Executor& executor,
                                 RawElectrons* charge) {
  if (const Result<void> checked = check(frame, options); !checked) return tl::make_unexpected(checked.error());
  const PictureSize size = picture_size(frame.raw, options);
  DevelopPlan plan{.options = options, .display = options.display, .width = size.width, .height = size.height};
  plan.warnings = frame.warnings;
  Result<std::optional<Framing>> framing = decide_framing(size, frame.raw.info.orientation, options);
  if (!framing) return tl::make_unexpected(std::move(framing.error()));
  plan.framing = *framing;
  StageClock clock(plan.times);

  Result<RawLevels> levels = choose_levels(frame, options);
  if (!levels) return tl::make_unexpected(std::move(levels.error()));
  if (levels->black.source == BlackPoint::Source::format_default) {
    plan.warnings.emplace_back(
        "the file states no black level, so 0 is used, the default of DNG; if the shadows are pale or coloured, give "
        "it with --black DN");
  }
  clock.lap("black point");

  std::optional<RawFrame> without_dark;
  if (levels->dark_frame) {
    const DarkFrame& dark = *levels->dark_frame;
    plan.warnings.insert(plan.warnings.end(), dark.warnings.begin(), dark.warnings.end());
    without_dark = measurable_without_dark(frame, dark, levels->black, executor);
    clock.lap("dark frame");
  }
  const RawFrame& measured = without_dark ? *without_dark : frame;
  const Thumbnail thumbnail = make_thumbnail(measured, levels->black, executor);
  clock.lap("thumbnail");

  plan.dark = find_dark_charge(frame, *levels, thumbnail, options);
  if (plan.dark.state == DarkCharge::State::estimated) levels->black.dark_mean_e = plan.dark.estimated_e;
  if (plan.dark.state == DarkCharge::State::unknown) plan.warnings.push_back(warning_of(plan.dark, frame.raw.info));
  FoundDefects found = all_defects(frame, measured.raw, thumbnail, *levels, options.find_defects, executor);
  levels->defects = std::move(found.defects);
  append(plan.warnings, found.warnings);
  clock.lap("defects");

  const Thumbnail light = light_of(thumbnail, frame, *levels);
  Result<Vector3> picked{Vector3{1, 1, 1}};
  if (options.white_balance.mode == WhiteBalanceChoice::Mode::picked && options.space != OutputSpace::camera) {
    picked = picked_neutral(measured, *levels, options, executor);
  }
  if (!picked) return tl::make_unexpected(std::move(picked.error()));
  Result<Rendering> rendering = decide_rendering(frame, light, options, *picked);
  if (!rendering) return tl::make_unexpected(std::move(rendering.error()));
  append(plan.warnings, rendering->warnings);
  plan.saturation = saturated_from(frame.raw, *levels);
  rendering->transform.clip = clip_of(*rendering, plan.saturation);
  if (plan.dark.mean_e) {
    plan.dark.alpha = signal_fraction_at_median(frame, *levels, *rendering, light, plan.dark.charge_e);
  }
  clock.lap("white and exposure");

  if (options.effects) {
    Result<StepPlan> effects = choose_steps(frame, thumbnail, light, options, *levels, *rendering, executor);
    if (!effects) return tl::make_unexpected(std::move(effects.error()));
    if (!effects->dark) levels->black.dark_mean_e = {};
    if (!effects->display) plan.display.reset();
    plan.effects = *std::move(effects);
    clock.lap("effects");
  }
  NoiseRequest request{.choice = options.denoise, .space = options.space, .white_gain = rendering->white_gain};
  if (plan.effects) {
    if (plan.effects->level_decided) request.level.emplace(DecidedLevel{plan.effects->level, plan.effects->regions});
    request.lines = plan.effects->lines;
  }
  Result<NoiseReduction> noise = plan_noise(frame, thumbnail, *levels, request, executor, charge);
  if (!noise) return tl::make_unexpected(std::move(noise.error()));
  append(plan.warnings, noise->warnings);
  if (rendering->look && rendering->look->noise_limit && !rendering->look->noise && !noise->has_level()) {
    plan.warnings.emplace_back("the noise of the frame is not known, so --noise-limit has no effect");
  }
  if (options.highlights == Highlights::reconstruct && !levels->saturation) {
    plan.saturation = measure_saturation(frame.raw, levels->black);
  }
  const bool knows_noise = noise->has_level() || frame.noise;
  if (knows_noise) plan.sharpen_px = options.sharpen_px;
  plan.local_tone_by_noise = knows_noise && options.local_tone > 0;
  if (options.sharpen_px && !knows_noise) {
    plan.warnings.emplace_back("the noise of the frame is not known, so the image is not sharpened");
  }
  if (options.local_tone > 0 && !knows_noise) {
    plan.warnings.emplace_back("the noise of the frame is not known, so it does not limit --local-tone");
  }
  std::vector<float> memory;
  DemosaicRequest interpolation{.method = options.demosaic, .signal_e = median_green_e(frame, *levels, light, memory)};
  if (plan.effects) interpolation.max_method = plan.effects->max_demosaic;
  if (frame.raw.layout == SensorLayout::bayer && !options.half) {
    plan.demosaic = plan_demosaic(frame, *levels, *rendering, *noise, interpolation);
  }
  plan.from_codes = renders_from_codes(frame, *levels, noise->reduces());
  if (plan.from_codes || frame.raw.layout != SensorLayout::bayer) levels->electrons_at_white.reset();
  plan.levels = *std::move(levels);
  plan.rendering = *std::move(rendering);
  plan.noise_reduction = *std::move(noise);
  clock.lap("noise model");
  return plan;
}

}  // namespace lowlux::isp
