#include "isp/pipeline/plan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "isp/pipeline/budget/effect_sizes.h"
#include "isp/pipeline/budget/plan_effects.h"
#include "isp/pipeline/plan/plan_noise.h"
#include "isp/pipeline/plan/plan_rendering.h"
#include "isp/pipeline/stage_clock.h"
#include "isp/raw/corrections.h"
#include "isp/raw/measure/thumbnail.h"
#include "isp/raw/subtract_dark_frame.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

Result<void> check(const RawFrame& frame, const DevelopOptions& o) {
  if (Result<void> options = check_options(o); !options) return options;
  const bool coloured = frame.raw.layout != SensorLayout::monochrome;
  if (coloured && o.space != OutputSpace::camera && frame.colour.calibrations.empty()) {
    return fail(ErrorCode::insufficient,
                "the file has no colour matrix and the decoder does not know the camera; "
                "--space camera develops it without colour conversion");
  }
  const Rect& crop = frame.raw.default_crop;
  if (o.half && (crop.width < 2 || crop.height < 2)) {
    return fail(ErrorCode::invalid_argument, "the picture is too small to halve");
  }
  return {};
}

// Defects the source names, those whose dark is unknown and, if asked for, those that stand out of what is measured.
std::vector<Pixel> all_defects(const RawFrame& frame, const RawDn& measured, const Thumbnail& thumbnail,
                               DevelopPlan& plan, Executor& executor) {
  const auto named = named_defects(frame.raw, frame.corrections.defects);
  if (!named)
    plan.warnings.emplace_back("the file names a large part of its pixels as defective: these are not repaired");
  std::vector<Pixel> defects = named.value_or(std::vector<Pixel>{});
  if (plan.options.dark_frame) {
    defects = merged(defects, *named_defects(frame.raw, plan.options.dark_frame->unknown));
  }
  if (!plan.options.find_defects || (plan.effects && !plan.effects->find_defects)) return defects;
  const std::vector<Pixel> found = find_defects(measured, plan.black, defect_noise(frame, plan, thumbnail), executor);
  return merged(defects, found);
}

// Nothing has to be repaired, multiplied, denoised, or taken off pixel by pixel.
bool goes_from_codes(const RawFrame& frame, const DevelopPlan& plan) {
  return frame.raw.layout == SensorLayout::bayer && plan.defects.empty() && !plan.noise_reduction.reduces() &&
         !plan.black.pattern && !plan.options.dark_frame && plan.black.dark_mean_e == PerSite<double>{} &&
         frame.corrections.radial_gains.empty() &&
         std::none_of(frame.corrections.gain_maps.begin(), frame.corrections.gain_maps.end(), has_effect);
}

// Dark charge that is known and still in the codes is no light.
Thumbnail light_of(const Thumbnail& thumbnail, const RawDn& raw, const DevelopPlan& plan) {
  Thumbnail out{CameraRgb(thumbnail.mean.width(), thumbnail.mean.height()), thumbnail.black_noise_std};
  std::array<double, 3> dark{};
  for (int site = 0; site < 4 && plan.electrons_at_white; ++site) {
    const auto c = static_cast<std::size_t>(colour_at(raw.phase, site & 1, site >> 1));
    dark[c] += plan.black.dark_mean_e[site] / (*plan.electrons_at_white)[site] * (c == 1 ? 0.5 : 1);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const Plane<float>& from = thumbnail.mean.plane[c];
    std::transform(from.data(), from.data() + from.size(), out.mean.plane[c].data(),
                   [&](float mean) { return mean - static_cast<float>(dark[c]); });
  }
  return out;
}

void set_size(DevelopPlan& plan, const Rect& crop) {
  plan.width = plan.options.half ? crop.width / 2 : crop.width;
  plan.height = plan.options.half ? crop.height / 2 : crop.height;
}

}  // namespace

Result<void> check_options(const DevelopOptions& o) {
  const bool needs_float = o.space == OutputSpace::camera || o.space == OutputSpace::xyz;
  if (needs_float && o.samples != SampleType::f32) {
    return fail(
        ErrorCode::invalid_argument,
        "camera RGB and XYZ are signed and reach above 1: they need float samples, TIFF with --bits 32 or OpenEXR");
  }
  if (o.samples == SampleType::f32 && (!is_linear(o.space) || o.tone != ToneCurve::none)) {
    return fail(ErrorCode::invalid_argument,
                "float samples are scene-linear: they go with a linear space and --tone none");
  }
  if (o.display && (o.space != OutputSpace::srgb || o.samples == SampleType::f32)) {
    return fail(ErrorCode::invalid_argument, "pictures for another display are sRGB of 8 or 16 bits");
  }
  return {};
}

Result<DevelopPlan> plan_develop(const RawFrame& frame, const DevelopOptions& options, Executor& executor) {
  if (const Result<void> checked = check(frame, options); !checked) return tl::make_unexpected(checked.error());
  DevelopPlan plan;
  plan.options = options;
  plan.warnings = frame.warnings;
  set_size(plan, frame.raw.default_crop);
  StageClock clock(plan.times);

  const DarkFrame* dark = options.dark_frame.get();
  Result<BlackPoint> black = dark != nullptr ? black_of(frame.raw, *dark) : choose_black(frame.raw, options.black);
  if (!black) return tl::make_unexpected(std::move(black.error()));
  plan.black = std::move(*black);
  if (frame.noise) plan.electrons_at_white = electrons_at_white(frame.raw, *frame.noise);
  clock.lap("black point");

  std::optional<RawFrame> without_dark;
  if (dark != nullptr) {
    plan.warnings.insert(plan.warnings.end(), dark->warnings.begin(), dark->warnings.end());
    without_dark = measurable_without_dark(frame, *dark, plan.black, executor);
    clock.lap("dark frame");
  }
  const RawFrame& measured = without_dark ? *without_dark : frame;
  const Thumbnail thumbnail = make_thumbnail(measured, plan.black, executor);
  clock.lap("thumbnail");
  if (const Result<void> decided = decide_rendering(frame, light_of(thumbnail, frame.raw, plan), plan); !decided) {
    return tl::make_unexpected(decided.error());
  }
  clock.lap("white and exposure");
  if (options.effects) {
    if (auto decided = decide_effects(frame, thumbnail, plan, executor); !decided) {
      return tl::make_unexpected(std::move(decided.error()));
    }
    clock.lap("effects");
  }
  plan.defects = all_defects(frame, measured.raw, thumbnail, plan, executor);
  clock.lap("defects");

  Result<NoiseReduction> noise = plan_noise(frame, thumbnail, plan, executor);
  if (!noise) return tl::make_unexpected(std::move(noise.error()));
  plan.noise_reduction = *std::move(noise);
  if (plan.look && plan.look->noise_limit && !plan.look->noise && !plan.noise_reduction.has_level()) {
    plan.warnings.emplace_back("the noise of the frame is not known, so it is not held to a limit");
  }
  plan.from_codes = goes_from_codes(frame, plan);
  if (plan.from_codes || frame.raw.layout != SensorLayout::bayer) plan.electrons_at_white.reset();
  clock.lap("noise model");
  return plan;
}

}  // namespace lowlux::isp
