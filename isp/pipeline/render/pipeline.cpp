#include "isp/pipeline/render/pipeline.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <variant>

#include "isp/pipeline/render/electron_mosaic.h"
#include "isp/pipeline/render/frame_needs.h"
#include "isp/pipeline/render/pixel_cells.h"
#include "isp/raw/corrections.h"
#include "isp/render/area_mean.h"

namespace lowlux::isp {
namespace {

DnMosaic code_mosaic(const RawDn& raw, const DevelopPlan& plan) {
  const Rect& crop = raw.default_crop;
  PerSite<double> range{};
  for (int site = 0; site < 4; ++site) range[site] = white_at(raw, site) - plan.levels.black.pedestal_dn[site];
  return {raw.dn.view().crop(raw.active.x + crop.x, raw.active.y + crop.y, crop.width, crop.height),
          phase_of_crop(raw.phase, crop.x, crop.y),
          {of_crop(plan.levels.black.pedestal_dn, crop), site_gains(raw, plan.rendering.white_gain, range, crop)},
          plan.demosaic.demosaic};
}

/// Returns the part of a mosaic that is demosaiced, with the gains of white balance.
/// @param at_white  value of a white pixel of each site
template <class Unit>
SignedMosaic balanced(const LinearMosaicView<Unit, DarkOut>& signal, const PerSite<double>& at_white,
                      const RawFrame& frame, const DevelopPlan& plan, const Region& region) {
  const Rect& seen = region.seen;
  return {signal.value.crop(seen.x - region.mosaic.x, seen.y - region.mosaic.y, seen.width, seen.height),
          phase_of_crop(signal.phase, seen.x, seen.y), site_gains(frame.raw, plan.rendering.white_gain, at_white, seen),
          plan.demosaic.demosaic};
}

// Monochrome frames serve as R, G and B at once; demosaiced ones have three planes of their own.
CameraPlanes balanced(std::span<Plane<float>> pixels, const Rect& crop, const DevelopPlan& plan) {
  CameraPlanes out{{}, plan.rendering.white_gain};
  for (std::size_t c = 0; c < 3; ++c) {
    const PlaneView<const float> plane = pixels[std::min(c, pixels.size() - 1)].view();
    out.rgb[c] = plane.crop(crop.x, crop.y, crop.width, crop.height);
  }
  return out;
}

void apply_flat_field(const RawCorrections& corrections, std::span<Plane<float>> pixels, NoiseMaps* maps,
                      Executor& executor) {
  if (maps != nullptr) apply_gains_to_maps(corrections, *maps, executor);
  if (pixels.size() == 1) return apply_gains(corrections, pixels[0].view(), executor);
  apply_gains(corrections, RgbView<float>{pixels[0].view(), pixels[1].view(), pixels[2].view()}, executor);
}

template <class Unit>
void apply_flat_field(const RawFrame& frame, const Region& region, const LinearMosaicView<Unit, DarkOut>& signal,
                      NoiseMaps* maps, Executor& executor) {
  const Rect& active = frame.raw.active;
  apply_gains(frame.corrections, {region.mosaic.x, region.mosaic.y, active.width, active.height}, signal.value,
              executor);
  if (maps == nullptr) return;
  apply_gains_to_variance(frame.corrections, signal.value, maps->residual_variance_e2.view(), executor);
}

}  // namespace

/// Renders a region: every stage of lowlux, in order.
/// @param encode  makes the image: demosaics and applies white balance, matrix, look, gamut and tone in one pass
template <class Encode>
void Pipeline::render_region(const RawFrame& frame, const DevelopPlan& plan, const Region& region,
                             const Encode& encode) {
  RgbInput camera = camera_rgb(frame, plan, region);  // black, repair, lines, noise, dark, flat field
  if (plan.options.half) camera = image_.halve(camera);
  if (finishes(plan)) camera = image_.finish(camera, frame, plan, noise_maps_);  // highlights, sharpening, local tone
  const ImageStages::Light light = image_.look(camera, frame, plan, noise_maps_);
  encode(light.in, light.transform);
}

/// Returns the mosaic or the camera RGB of a region, with what the sensor and the lens added undone, and the gains of
/// white balance to be applied.
RgbInput Pipeline::camera_rgb(const RawFrame& frame, const DevelopPlan& plan, const Region& region) {
  if (plan.from_codes) return code_mosaic(frame.raw, plan);  // the kernel subtracts black
  if (!is_mosaic(frame.raw)) {
    NoiseMaps* const maps = maps_of(plan);
    const std::span<Plane<float>> pixels = signal_.pixels(frame, plan, maps);
    if (maps != nullptr) scale_to_pixels(frame.raw, *maps);
    apply_flat_field(frame.corrections, pixels, maps, executor_);
    return balanced(pixels, region.seen, plan);
  }
  if (!plan.levels.electrons_at_white) {
    const SignalFractionView signal = signal_.fractions(frame, plan, region);
    apply_flat_field(frame, region, signal, nullptr, executor_);
    return balanced(signal, {1, 1, 1, 1}, frame, plan, region);
  }
  const SignalElectronsView signal = signal_.electrons(frame, plan, region, maps_of(plan));
  apply_flat_field(frame, region, signal, maps_of(plan), executor_);
  return balanced(signal, light_at_white_e(plan.levels), frame, plan, region);
}

NoiseMaps* Pipeline::maps_of(const DevelopPlan& plan) { return keeps_maps(plan) ? &noise_maps_ : nullptr; }

template <class Encode>
void Pipeline::render_whole(const RawFrame& frame, const DevelopPlan& plan, const Encode& encode) {
  const Region whole = whole_frame(frame.raw);
  has_noise_maps_ = keeps_maps(plan);
  if (is_mosaic(frame.raw) && !plan.from_codes) signal_.reserve(size_of(whole), plan.noise_reduction);
  image_.reserve(size_of(whole), plan);
  render_region(frame, plan, whole, encode);
}

void Pipeline::render_tiles(const RawFrame& frame, const DevelopPlan& plan, const PictureView& out) {
  const RegionSize largest = largest_tile(frame.raw, plan, limits_);
  has_noise_maps_ = false;
  signal_.reserve_tiles(largest, plan.noise_reduction);
  image_.reserve(largest, plan);
  if (!plan.options.half) fit(tile_, plan.options.samples, largest.seen_width, largest.seen_height);
  const TileGrid grid(frame.raw.default_crop, limits_.side_px);
  for (int i = 0; i < grid.count(); ++i) {
    const Region region = tile_region(frame.raw, plan, grid.core(i));
    const Rect &core = region.core, &seen = region.seen, pixels = pixels_of(frame.raw, plan, core);
    if (pixels.width == 0 || pixels.height == 0) continue;
    const PictureView to = crop_of(out, pixels);
    const PictureView tile = plan.options.half ? to : crop_of(view_of(*tile_), {0, 0, seen.width, seen.height});
    render_region(frame, plan, region, [&](const RgbInput& in, const RgbTransform& transform) {
      encode(image_.kernel(seen.width), in, transform, plan, tile, executor_);
    });
    if (!plan.options.half) {
      copy_pixels(crop_of(tile, {core.x - seen.x, core.y - seen.y, core.width, core.height}), to);
    }
  }
}

void Pipeline::render_unframed(const RawFrame& frame, const DevelopPlan& plan, Picture& out) {
  const PictureView view = view_of(out);
  if (is_tiled(frame.raw, plan, limits_)) return render_tiles(frame, plan, view);
  render_whole(frame, plan, [&](const RgbInput& in, const RgbTransform& transform) {
    encode(image_.kernel(plan.width), in, transform, plan, view, executor_);
  });
}

// The mean is taken of light, signed and before the tone curve: black noise would otherwise be rectified by each pixel.
void Pipeline::render_shrunk(const RawFrame& frame, const DevelopPlan& plan, Picture& out) {
  DevelopPlan light = plan;
  light.options.samples = SampleType::f32;
  light.rendering.transform.move_into_gamut = false;
  light.display.reset();
  light.framing.reset();
  Picture all = make_picture(light);
  render_unframed(frame, light, all);
  const Rect& kept = plan.framing->pixels;
  const PictureSize& size = plan.framing->size;
  const auto part = std::get<RgbView<float>>(crop_of(view_of(all), kept));
  SceneLinear small(size.width, size.height);
  shrink_by_area({part[0], part[1], part[2]}, small.view(), executor_);
  const RgbView<const float> planes = std::as_const(small).view();
  encode(image_.kernel(size.width), CameraPlanes{planes, {1, 1, 1}}, transform_of_light(plan, nullptr), plan,
         view_of(out), executor_);
}

void Pipeline::render(const RawFrame& frame, const DevelopPlan& plan, Picture& out, RawElectrons charge) {
  if (is_tiled(frame.raw, plan, limits_)) charge = {};  // each tile computes its own
  signal_.set_charge(std::move(charge.value));
  if (!plan.framing) return render_unframed(frame, plan, out);
  if (plan.framing->shrinks()) return render_shrunk(frame, plan, out);
  Picture all = make_picture(plan.options.samples, plan.width, plan.height);
  render_unframed(frame, plan, all);
  copy_pixels(crop_of(view_of(all), plan.framing->pixels), view_of(out));
}

void Pipeline::render(const RawFrame& frame, const DevelopPlan& plan, const RowSink& out) {
  render_whole(frame, plan, [&](const RgbInput& in, const RgbTransform& transform) {
    image_.kernel(plan.width).rows8(in, transform, plan.rendering.tone, out, executor_);
  });
}

void Pipeline::render(const RawFrame& frame, const DevelopPlan& plan, const PixelView& out) {
  render_whole(frame, plan, [&](const RgbInput& in, const RgbTransform& transform) {
    image_.kernel(plan.width).pixels8(in, transform, plan.rendering.tone, out, executor_);
  });
}

void Pipeline::render(const RawFrame& frame, const DevelopPlan& plan, PlaneView<std::uint16_t> out) {
  render_whole(frame, plan, [&](const RgbInput& in, const RgbTransform& transform) {
    image_.kernel(plan.width).rgb16(in, transform, plan.rendering.tone, out, executor_);
  });
}

PlaneView<const float> Pipeline::signal(const RawFrame& frame, const DevelopPlan& plan) {
  const Region whole = whole_frame(frame.raw);
  signal_.reserve(size_of(whole), plan.noise_reduction);
  return signal_.electrons(frame, plan, whole, maps_of(plan)).value;
}

Picture make_picture(const DevelopPlan& plan) {
  const PictureSize size = plan.framing ? plan.framing->size : PictureSize{plan.width, plan.height};
  return make_picture(plan.options.samples, size.width, size.height);
}

}  // namespace lowlux::isp
