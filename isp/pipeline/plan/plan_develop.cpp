#include "isp/pipeline/plan/plan_develop.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "isp/pipeline/budget/step_plan.h"
#include "isp/pipeline/plan/plan_noise.h"
#include "isp/pipeline/render/cell_figures.h"
#include "isp/raw/corrections.h"
#include "isp/raw/measure/masked_black.h"
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

// Returns the system gain [DN/e-]: a variance of scale * x at the fraction x of white is scale * range for each DN.
double gain_dn_per_e(const RawFrame& frame, const BlackPoint& black) {
  return frame.noise ? *std::ranges::max_element(frame.noise->scale) * mean_range_dn(frame.raw, black) : 0;
}

// Returns the noise that the search for defects is based on.
DefectNoise defect_noise(const RawFrame& frame, const BlackPoint& black, const Thumbnail& thumbnail) {
  return {thumbnail.black_noise_std * mean_range_dn(frame.raw, black), gain_dn_per_e(frame, black)};
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

// Returns the thumbnail without the dark charge that is known and still in the codes: it is not light.
Thumbnail light_of(const Thumbnail& thumbnail, const RawDn& raw, const RawLevels& levels) {
  Thumbnail out{CameraRgb(thumbnail.mean.width(), thumbnail.mean.height()), thumbnail.black_noise_std};
  std::array<double, 3> dark{};
  for (int site = 0; site < 4 && levels.electrons_at_white; ++site) {
    const auto c = static_cast<std::size_t>(colour_at(raw.phase, site & 1, site >> 1));
    dark[c] += levels.black.dark_mean_e[site] / (*levels.electrons_at_white)[site] * (c == 1 ? 0.5 : 1);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const Plane<float>& from = thumbnail.mean.plane[c];
    std::transform(from.data(), from.data() + from.size(), out.mean.plane[c].data(),
                   [&](float mean) { return mean - static_cast<float>(dark[c]); });
  }
  return out;
}

// Returns DevelopPlan::unknown_dark_fraction for a Bayer frame whose gain and exposure time are known. Of a raw that
// came denoised its maker knew more: `lowlux denoise` subtracts dark charge, or warns.
std::optional<double> find_unknown_dark(const RawFrame& frame, const RawLevels& levels, const Thumbnail& thumbnail) {
  // Dark current that few sensors exceed uncooled: that of the GSENSE4040BSI at 25 C by its data sheet.
  constexpr double high_current_e_per_s = 25, at_c = 25, doubling_c = 7, min_charge_e = 2, min_fraction = 0.1;
  const FrameInfo& info = frame.raw.info;
  const bool is_unknown = frame.raw.layout == SensorLayout::bayer && levels.electrons_at_white &&
                          !frame.noise->reduced && levels.black.holds == BlackPoint::Holds::pedestal_only &&
                          levels.black.dark_mean_e == PerSite<double>{};
  if (!is_unknown || !info.exposure_s) return std::nullopt;
  const double factor = std::exp2((info.temperature_c.value_or(at_c) - at_c) / doubling_c);
  if (!(high_current_e_per_s * factor * *info.exposure_s >= min_charge_e)) return std::nullopt;
  const std::array<double, 3> electrons = electrons_by_colour(frame.raw, levels);
  std::vector<double> charge(thumbnail.mean.plane[0].size());
  for (std::size_t i = 0; i < charge.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c)
      charge[i] += fraction_of_sites[c] * electrons[c] * thumbnail.mean.plane[c].data()[i];
  }
  if (charge.empty()) return std::nullopt;
  const auto at_fraction = [&](double fraction) {
    const auto place = charge.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(charge.size()));
    std::nth_element(charge.begin(), place, charge.end());
    return *place;
  };
  const double median = at_fraction(0.5), darkest = at_fraction(0.01);
  if (!(median > 0)) return std::nullopt;
  const double fraction = std::clamp(darkest / median, 0.0, 1.0);
  return fraction >= min_fraction ? std::optional(fraction) : std::nullopt;
}

std::string dark_warning(const FrameInfo& info, double fraction) {
  const std::string place = info.temperature_c ? fmt::format(" and {:g} C", *info.temperature_c) : std::string();
  return fmt::format(
      "the dark charge is unknown: at {:g} s{} it may take up to {:.0f} % of the saturation; use "
      "--dark-frame, or --profile with a dark current",
      *info.exposure_s, place, 100 * fraction);
}

Result<RawLevels> choose_levels(const RawFrame& frame, const DevelopOptions& options) {
  RawLevels out{.dark_frame = options.dark_frame};
  Result<BlackPoint> black =
      out.dark_frame ? black_of(frame.raw, *out.dark_frame) : choose_black_by_gain(frame, options.black);
  if (!black) return tl::make_unexpected(std::move(black.error()));
  out.black = *std::move(black);
  if (frame.noise) out.electrons_at_white = electrons_at_white(frame.raw, *frame.noise);
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
  MaskedBlack measured = measure_masked_black(frame.raw, gain_dn_per_e(frame, *black));
  if (measured.black) black = *std::move(measured.black);
  return black;
}

Result<DevelopPlan> plan_develop(const RawFrame& frame, const DevelopOptions& options, Executor& executor) {
  if (const Result<void> checked = check(frame, options); !checked) return tl::make_unexpected(checked.error());
  const PictureSize size = picture_size(frame.raw, options);
  DevelopPlan plan{.options = options, .display = options.display, .width = size.width, .height = size.height};
  plan.warnings = frame.warnings;
  StageClock clock(plan.times);

  Result<RawLevels> levels = choose_levels(frame, options);
  if (!levels) return tl::make_unexpected(std::move(levels.error()));
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

  plan.unknown_dark_fraction = find_unknown_dark(frame, *levels, thumbnail);
  if (plan.unknown_dark_fraction) plan.warnings.push_back(dark_warning(frame.raw.info, *plan.unknown_dark_fraction));
  const Thumbnail light = light_of(thumbnail, frame.raw, *levels);
  Result<Rendering> rendering = decide_rendering(frame, light, options);
  if (!rendering) return tl::make_unexpected(std::move(rendering.error()));
  append(plan.warnings, rendering->warnings);
  clock.lap("white and exposure");

  FoundDefects found = all_defects(frame, measured.raw, thumbnail, *levels, options.find_defects, executor);
  levels->defects = std::move(found.defects);
  append(plan.warnings, found.warnings);
  clock.lap("defects");

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
  Result<NoiseReduction> noise = plan_noise(frame, thumbnail, *levels, request, executor);
  if (!noise) return tl::make_unexpected(std::move(noise.error()));
  append(plan.warnings, noise->warnings);
  if (rendering->look && rendering->look->noise_limit && !rendering->look->noise && !noise->has_level()) {
    plan.warnings.emplace_back("the noise of the frame is not known, so it is not held to a limit");
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
