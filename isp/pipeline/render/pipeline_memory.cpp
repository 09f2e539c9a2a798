#include "isp/pipeline/render/pipeline_memory.h"

#include <cassert>
#include <vector>

#include "isp/pipeline/render/frame_needs.h"
#include "isp/pipeline/render/level_parts.h"
#include "isp/pipeline/render/noise_reducer.h"
#include "isp/pipeline/render/pixel_cells.h"
#include "isp/pipeline/render/pixel_noise_reducer.h"
#include "isp/pipeline/render/region.h"
#include "isp/raw/kernel/raw_to_rgb.h"

namespace lowlux::isp {
namespace {

std::size_t area(int width, int height) { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }

std::size_t bytes_of(SampleType samples) { return samples == SampleType::u8 ? 1 : samples == SampleType::u16 ? 2 : 4; }

std::size_t whole_frame_bytes(const RawDn& raw, const DevelopPlan& plan, int threads) {
  const int width = raw.active.width, height = raw.active.height;
  const std::size_t plane = sizeof(float) * area(width, height);
  std::size_t out = RawToRgb::bytes(raw.default_crop.width, threads);
  if (plan.options.half) out += 3 * sizeof(float) * area(plan.width, plan.height);
  if (plan.rendering.profile) out += 3 * sizeof(float) * area(plan.width, plan.height);
  if (plan.from_codes) return out;
  if (!is_mosaic(raw)) {
    if (plan.noise_reduction.reduces() && keeps_maps(plan)) out += NoiseReducer::maps_bytes(2 * width, 2 * height);
    return out + static_cast<std::size_t>(planes_of(raw)) * plane +
           PixelNoiseReducer::bytes(raw, plan.noise_reduction, threads);
  }
  out += plane;
  if (!plan.noise_reduction.reduces()) return out;
  const bool maps = keeps_maps(plan);
  if (maps) out += NoiseReducer::maps_bytes(width, height);
  if (!NoiseReducer::has_result_memory(plan.noise_reduction)) out += plane;
  return out + NoiseReducer::bytes(width, height, plan.noise_reduction, maps, threads);
}

std::size_t tiles_bytes(const RawDn& raw, const DevelopPlan& plan, int threads, const TileLimits& limits) {
  const RegionSize size = largest_tile(raw, plan, limits);
  const std::size_t mosaic = sizeof(float) * area(size.mosaic_width, size.mosaic_height);
  const std::size_t seen = area(size.seen_width, size.seen_height);
  const NoiseReduction& how = plan.noise_reduction;
  std::size_t out = mosaic + RawToRgb::bytes(size.seen_width, threads);
  if (how.reduces()) {
    out += (NoiseReducer::has_result_memory(how) ? 0 : 2) * mosaic +
           denoise::Denoiser::bytes(size.mosaic_width, size.mosaic_height, threads, max_level_of(how));
  }
  if (plan.rendering.profile) out += 3 * sizeof(float) * seen / (plan.options.half ? 4 : 1);
  return out + seen * (plan.options.half ? sizeof(float) * 3 / 4 : 3 * bytes_of(plan.options.samples));
}

}  // namespace

std::size_t pipeline_bytes(const RawDn& raw, const DevelopPlan& plan, int threads, const TileLimits& limits) {
  assert(!needs_grid(plan) && !needs_seeing_map(plan) && !needs_table(plan) && !plan.noise_reduction.temporal);
  if (is_tiled(raw, plan, limits)) return tiles_bytes(raw, plan, threads, limits);
  return whole_frame_bytes(raw, plan, threads);
}

std::size_t expected_bytes(const RawDn& raw, const DevelopOptions& options, int threads) {
  const DenoiseChoice& denoise = options.denoise;
  const bool best = options.effects && !options.effects->tolerance_delta_e;  // within a budget
  DevelopPlan most;
  most.options = options;
  if (options.profile_tables) most.rendering.profile.emplace();
  most.width = options.half ? raw.default_crop.width / 2 : raw.default_crop.width;
  most.height = options.half ? raw.default_crop.height / 2 : raw.default_crop.height;
  if (denoise.mode == DenoiseChoice::Mode::automatic) {
    most.noise_reduction.level = best ? denoise::Level::best : denoise::Level::high;
  }
  if (denoise.mode == DenoiseChoice::Mode::level) most.noise_reduction.level = denoise.level;
  const std::size_t samples = raw.sample_bytes() * raw.samples();
  const std::size_t picture = 3 * bytes_of(options.samples) * area(most.width, most.height);
  const std::size_t before_framing = options.max_size ? 3 * sizeof(float) * area(most.width, most.height)
                                     : options.crop   ? picture
                                                      : 0;
  // Camera RGB, and while it is sharpened the luminance, its detail, powers, means and places near saturation.
  const bool finishes = options.highlights == Highlights::reconstruct || options.local_tone > 0;
  const std::size_t finish_planes = options.sharpen_px ? 12 : finishes ? 4 : 0;
  const std::size_t finishing = finish_planes * sizeof(float) * area(most.width, most.height);
  const std::size_t dark = options.dark_frame ? sizeof(float) * area(raw.active.width, raw.active.height) : 0;
  const std::size_t turned = raw.info.orientation == Orientation::normal ? 0 : picture;
  const std::size_t around = samples + dark + picture + before_framing + finishing + turned;
  if (options.look.look == Look::camera) return around + pipeline_bytes(raw, most, threads);
  return around + whole_frame_bytes(raw, most, threads) + 3 * sizeof(float) * area(most.width, most.height);
}

}  // namespace lowlux::isp
