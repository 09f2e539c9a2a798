#include "isp/pipeline/render/tile_renderer.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <utility>

#include "isp/pipeline/render/electron_mosaic.h"
#include "isp/pipeline/render/frame_needs.h"
#include "isp/pipeline/render/modelled_planes.h"
#include "isp/pipeline/render/picture_view.h"
#include "isp/raw/corrections.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

constexpr int repair_reach_px = 6;

/// Returns the margin of a tile: without noise reduction a pixel depends on its neighbours only, as far as demosaicing
/// and repair reach.
TileMargin margin_in(const DevelopPlan& plan) {
  const int reach = reach_px(plan.demosaic.demosaic.method) + repair_reach_px;
  if (!plan.noise_reduction.reduces()) return {.px = reach, .lattice = 2};
  return plan.noise_reduction.has_level() ? margin_of(max_level_of(plan.noise_reduction)) : TileMargin{};
}

/// Returns the region that is demosaiced: at the border of the image the mosaic ends, elsewhere it continues.
Rect seen_of(const RawDn& raw, const DevelopPlan& plan, const Rect& core) {
  const int reach = reach_px(plan.demosaic.demosaic.method);
  if (plan.options.half) return core;
  return overlap({core.x - reach, core.y - reach, core.width + 2 * reach, core.height + 2 * reach}, raw.default_crop);
}

/// Returns where a core lies in the image.
Rect pixels_of(const RawDn& raw, const DevelopPlan& plan, const Rect& core) {
  const int cell = plan.options.half ? 2 : 1;
  return {(core.x - raw.default_crop.x) / cell, (core.y - raw.default_crop.y) / cell, core.width / cell,
          core.height / cell};
}

Rect whole_of(const RawDn& raw, const DevelopPlan& plan, const Rect& core) {
  return with_margin(core, margin_in(plan), raw.active.width, raw.active.height);
}

PlaneView<const float> crop_of(const PlaneView<const float>& mosaic, const Rect& whole, const Rect& part) {
  return mosaic.crop(part.x - whole.x, part.y - whole.y, part.width, part.height);
}

/// Holds the sizes of the largest tile.
struct Sizes {
  int width = 0;  // margins included
  int height = 0;
  int seen_width = 0;
  int seen_height = 0;
};

Sizes sizes_of(const RawDn& raw, const DevelopPlan& plan, const TileLimits& limits) {
  const TileGrid grid(raw.default_crop, limits.side_px);
  Sizes out;
  for (int i = 0; i < grid.count(); ++i) {
    const Rect core = grid.core(i), whole = whole_of(raw, plan, core), seen = seen_of(raw, plan, core);
    out.width = std::max(out.width, whole.width);
    out.height = std::max(out.height, whole.height);
    out.seen_width = std::max(out.seen_width, seen.width);
    out.seen_height = std::max(out.seen_height, seen.height);
  }
  return out;
}

std::size_t bytes_of(SampleType samples) {
  return samples == SampleType::u8 ? 3 : samples == SampleType::u16 ? 6 : 12;  // of one pixel
}

}  // namespace

bool is_tiled(const RawDn& raw, const DevelopPlan& plan, const TileLimits& limits) {
  const std::int64_t pixels = std::int64_t{raw.active.width} * raw.active.height;
  return pixels > limits.max_whole_px && raw.layout == SensorLayout::bayer && !plan.from_codes &&
         raw.default_crop.width > 0 && raw.default_crop.height > 0 && !needs_grid(plan) && !needs_seeing_map(plan) &&
         !needs_table(plan) && !finishes(plan) && !keeps_maps(plan) && !plan.noise_reduction.temporal;
}

std::size_t TileRenderer::bytes(const RawDn& raw, const DevelopPlan& plan, const TileLimits& limits, int threads) {
  const Sizes sizes = sizes_of(raw, plan, limits);
  const std::size_t piece = static_cast<std::size_t>(sizes.width) * static_cast<std::size_t>(sizes.height);
  const std::size_t seen = static_cast<std::size_t>(sizes.seen_width) * static_cast<std::size_t>(sizes.seen_height);
  const NoiseReduction& how = plan.noise_reduction;
  std::size_t noise = 0;
  if (how.reduces()) {
    noise = denoise::Denoiser::bytes(sizes.width, sizes.height, threads, max_level_of(how)) +
            (how.regions ? 2 : 1) * sizeof(float) * piece;
  }
  const std::size_t modelled = plan.rendering.profile ? 3 * sizeof(float) * seen / (plan.options.half ? 4 : 1) : 0;
  return sizeof(float) * piece + noise + modelled +
         seen * (plan.options.half ? sizeof(float) * 3 / 4 : bytes_of(plan.options.samples)) +
         RawToRgb::bytes(sizes.seen_width, threads);
}

void TileRenderer::reserve(const RawFrame& frame, const DevelopPlan& plan) {
  const Sizes sizes = sizes_of(frame.raw, plan, limits_);
  fit(noisy_, sizes.width, sizes.height);
  if (plan.noise_reduction.reduces()) fit(mosaic_, sizes.width, sizes.height);
  if (!kernel_ || kernel_width_ < sizes.seen_width) {
    kernel_ = std::make_unique<RawToRgb>(sizes.seen_width, executor_.width());
    kernel_width_ = sizes.seen_width;
  }
  if (plan.rendering.profile) {
    const int cell = plan.options.half ? 2 : 1;
    for (Plane<float>& plane : modelled_) fit(plane, sizes.seen_width / cell, sizes.seen_height / cell);
  }
  if (plan.options.half) {
    for (Plane<float>& plane : half_planes_) fit(plane, sizes.seen_width / 2, sizes.seen_height / 2);
    return;
  }
  const bool fits = picture_ && picture_samples_ == plan.options.samples && picture_width_ == sizes.seen_width &&
                    picture_height_ == sizes.seen_height;
  if (fits) return;
  picture_.reset();  // frees its memory before the next one is allocated
  picture_ = make_picture(plan.options.samples, sizes.seen_width, sizes.seen_height);
  picture_samples_ = plan.options.samples;
  picture_width_ = sizes.seen_width;
  picture_height_ = sizes.seen_height;
}

/// Returns the mosaic of a core and its margin, as the kernel takes it except for the gains of white balance.
PlaneView<float> TileRenderer::mosaic_of(const RawFrame& frame, const DevelopPlan& plan, const Rect& core,
                                         NoiseReducer& noise) {
  const RawDn& raw = frame.raw;
  const Rect whole = whole_of(raw, plan, core);
  PlaneView<float> out = noisy_.view().crop(0, 0, whole.width, whole.height);
  if (!plan.levels.electrons_at_white) {
    subtract_black(raw, plan.levels, whole, out, executor_);
    repair(out, {whole.x, whole.y}, plan.levels.defects, 2);
  } else {
    raw_electrons(frame, plan.levels, whole, out, executor_);
    if (plan.noise_reduction.reduces()) {
      const PlaneView<float> clean = mosaic_.view().crop(0, 0, whole.width, whole.height);
      const Rect seen = seen_of(raw, plan, core);
      noise.run_piece({seen, whole, raw.active.width, raw.active.height, raw.phase}, plan.noise_reduction, out, clean);
      out = clean;
    } else {
      subtract_dark(out, plan.levels.black.dark_mean_e, executor_);
    }
  }
  apply_gains(frame.corrections, {whole.x, whole.y, raw.active.width, raw.active.height}, out, executor_);
  return out;
}

/// Renders a core and what is around it, through the profile's tables where there are any.
void TileRenderer::encode_core(const RgbInput& in, const DevelopPlan& plan, const PictureSize& size,
                               const PictureView& out) {
  if (!plan.rendering.profile) return encode(*kernel_, in, plan.rendering.transform, plan, out, executor_);
  RgbView<float> planes;
  for (std::size_t c = 0; c < 3; ++c) planes[c] = modelled_[c].view().crop(0, 0, size.width, size.height);
  const CameraPlanes light = through_profile(*kernel_, in, plan, planes, executor_);
  encode(*kernel_, light, transform_of_modelled(plan, nullptr), plan, out, executor_);
}

void TileRenderer::render_core(const RawFrame& frame, const DevelopPlan& plan, const Rect& core,
                               PlaneView<const float> mosaic, const PictureView& out) {
  const RawDn& raw = frame.raw;
  const Rect seen = seen_of(raw, plan, core), pixels = pixels_of(raw, plan, core);
  const SignedMosaic in{crop_of(mosaic, whole_of(raw, plan, core), seen), phase_of_crop(raw.phase, seen.x, seen.y),
                        site_gains(raw, plan.rendering.white_gain, units_at_white(plan.levels), seen),
                        plan.demosaic.demosaic};
  if (plan.options.half) {
    RgbView<float> half;
    for (std::size_t c = 0; c < 3; ++c) half[c] = half_planes_[c].view().crop(0, 0, pixels.width, pixels.height);
    kernel_->bin2x2(in, half, executor_);
    const CameraPlanes planes{{half[0], half[1], half[2]}, {1, 1, 1}};
    return encode_core(planes, plan, {pixels.width, pixels.height}, isp::crop_of(out, pixels));
  }
  const PictureView picture = isp::crop_of(view_of(*picture_), {0, 0, seen.width, seen.height});
  encode_core(in, plan, {seen.width, seen.height}, picture);
  copy_pixels(isp::crop_of(picture, {core.x - seen.x, core.y - seen.y, core.width, core.height}),
              isp::crop_of(out, pixels));
}

void TileRenderer::render(const RawFrame& frame, const DevelopPlan& plan, NoiseReducer& noise, Picture& out) {
  reserve(frame, plan);
  noise.reserve_pieces(noisy_.width(), noisy_.height(), plan.noise_reduction);
  const TileGrid grid(frame.raw.default_crop, limits_.side_px);
  const PictureView picture = view_of(out);
  for (int i = 0; i < grid.count(); ++i) {
    const Rect core = grid.core(i), pixels = pixels_of(frame.raw, plan, core);
    if (pixels.width == 0 || pixels.height == 0) continue;
    render_core(frame, plan, core, mosaic_of(frame, plan, core, noise), picture);
  }
}

}  // namespace lowlux::isp
