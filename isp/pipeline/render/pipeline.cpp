#include "isp/pipeline/render/pipeline.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "isp/pipeline/render/electron_mosaic.h"
#include "isp/pipeline/render/frame_needs.h"
#include "isp/pipeline/render/look_noise.h"
#include "isp/pipeline/render/modelled_planes.h"
#include "isp/pipeline/render/picture_view.h"
#include "isp/pipeline/render/pixel_cells.h"
#include "isp/raw/bin_plane.h"
#include "isp/raw/corrections.h"
#include "isp/raw/to_linear.h"
#include "isp/render/area_mean.h"
#include "isp/render/capture_sharpening.h"
#include "isp/render/highlights.h"
#include "isp/render/night/seeing_map.h"

namespace lowlux::isp {
namespace {

PlaneView<const float> crop_of(const Plane<float>& active, const Rect& crop) {
  return active.view().crop(crop.x, crop.y, crop.width, crop.height);
}

DnMosaic code_mosaic(const RawDn& raw, const DevelopPlan& plan) {
  const Rect& crop = raw.default_crop;
  PerSite<double> range{};
  for (int site = 0; site < 4; ++site) range[site] = white_at(raw, site) - plan.levels.black.pedestal_dn[site];
  return {raw.dn.view().crop(raw.active.x + crop.x, raw.active.y + crop.y, crop.width, crop.height),
          phase_of_crop(raw.phase, crop.x, crop.y),
          {of_crop(plan.levels.black.pedestal_dn, crop), site_gains(raw, plan.rendering.white_gain, range, crop)},
          plan.demosaic.demosaic};
}

/// Returns the white-balanced camera RGB of a saturated pixel.
std::array<float, 3> saturation_of(const DevelopPlan& plan) {
  std::array<float, 3> out = plan.rendering.white_gain;
  for (float& channel : out) channel *= static_cast<float>(plan.saturation);
  return out;
}

}  // namespace

// Subtracts dark charge, and reduces noise if so decided.
SignalElectrons Pipeline::signal_electrons(const RawFrame& frame, const DevelopPlan& plan) {
  if (!plan.noise_reduction.reduces()) {
    return subtract_dark(raw_electrons(frame, plan.levels, std::move(mosaic_), executor_), plan.levels.black,
                         executor_);
  }
  RawElectrons raw = raw_electrons(frame, plan.levels, std::move(noisy_), executor_);
  SignalElectrons out =
      noise_reducer_.run(raw, plan.noise_reduction, std::move(mosaic_), keeps_maps(plan) ? &noise_maps_ : nullptr);
  noisy_ = std::move(raw.value);
  return out;
}

// Makes the mosaic of Bayer frames that have to be repaired, multiplied or denoised first: in electrons where the gain
// is known.
void Pipeline::float_mosaic(const RawFrame& frame, const DevelopPlan& plan) {
  const RawDn& raw = frame.raw;
  if (plan.levels.electrons_at_white) {
    mosaic_ = signal_electrons(frame, plan).value;
  } else {
    fit(mosaic_, raw.active.width, raw.active.height);
    subtract_black(raw, plan.levels, mosaic_.view(), executor_);
    repair(mosaic_.view(), plan.levels.defects, 2);
  }
  apply_gains(frame.corrections, mosaic_.view(), executor_);
  if (plan.noise_reduction.reduces() && keeps_maps(plan)) {
    apply_gains_to_variance(frame.corrections, std::as_const(mosaic_).view(), noise_maps_.residual_variance_e2.view(),
                            executor_);
  }
}

RgbInput Pipeline::prepare_bayer(const RawFrame& frame, const DevelopPlan& plan) {
  const RawDn& raw = frame.raw;
  const Rect& crop = raw.default_crop;
  const auto half_or_whole = [&](const auto& mosaic) -> RgbInput {
    if (!plan.options.half) return mosaic;
    const RgbView<float> half{half_planes_[0].view(), half_planes_[1].view(), half_planes_[2].view()};
    kernel_->bin2x2(mosaic, half, executor_);
    return CameraPlanes{{half[0], half[1], half[2]}, {1, 1, 1}};
  };
  if (plan.from_codes) return half_or_whole(code_mosaic(raw, plan));
  float_mosaic(frame, plan);
  return half_or_whole(SignedMosaic{crop_of(mosaic_, crop), phase_of_crop(raw.phase, crop.x, crop.y),
                                    site_gains(raw, plan.rendering.white_gain, units_at_white(plan.levels), crop),
                                    plan.demosaic.demosaic});
}

// Monochrome frames serve as R, G and B at once; demosaiced ones have three planes of their own.
RgbInput Pipeline::prepare_planes(const RawFrame& frame, const DevelopPlan& plan) {
  const RawDn& raw = frame.raw;
  const int planes = planes_of(raw);
  std::array<PlaneView<float>, 3> views;
  for (int c = 0; c < planes; ++c) {
    fit(planes_[c], raw.active.width, raw.active.height);
    views[c] = planes_[c].view();
  }
  read_pixels(frame, plan.levels, {0, 0, raw.active.width, raw.active.height},
              std::span(views).first(static_cast<std::size_t>(planes)), executor_);
  if (plan.noise_reduction.reduces()) {
    pixel_reducer_.run(std::span(planes_).first(static_cast<std::size_t>(planes)), plan.noise_reduction,
                       noise_reducer_);
  }
  if (planes == 1) {
    apply_gains(frame.corrections, planes_[0].view(), executor_);
  } else {
    apply_gains(frame.corrections, RgbView<float>{planes_[0].view(), planes_[1].view(), planes_[2].view()}, executor_);
  }
  CameraPlanes out{{}, plan.rendering.white_gain};
  for (int c = 0; c < 3; ++c) {
    const int source = std::min(c, planes - 1);
    out.rgb[c] = crop_of(planes_[source], raw.default_crop);
    if (!plan.options.half) continue;
    if (c == source) bin_plane(out.rgb[c], half_planes_[c].view(), executor_);
    out.rgb[c] = half_planes_[source].view();
  }
  return out;
}

void Pipeline::reserve_kernel(int width) {
  if (kernel_ && kernel_width_ >= width) return;
  kernel_ = std::make_unique<RawToRgb>(width, executor_.width());
  kernel_width_ = width;
}

void Pipeline::reserve(const RawFrame& frame, const DevelopPlan& plan) {
  reserve_kernel(frame.raw.default_crop.width);
  if (plan.options.half) {
    for (Plane<float>& plane : half_planes_) fit(plane, plan.width, plan.height);
  }
}

// Computes means of the frame that is rendered, and their noise where it is needed.
void Pipeline::measure_cells(const RgbInput& in, const RawFrame& frame, const DevelopPlan& plan) {
  const int width = cells_along(plan.width), height = cells_along(plan.height);
  for (Plane<float>& plane : quarter_) fit(plane, width, height);
  kernel_->quarter(in, {quarter_[0].view(), quarter_[1].view(), quarter_[2].view()}, executor_);
  if (!needs_noise(plan)) return;
  fit(luminance_noise_, width, height);
  noise_of_luminance(plan, frame, noise_maps_, quarter_view(), luminance_noise_.view(), executor_);
}

RgbView<const float> Pipeline::quarter_view() const {
  return {quarter_[0].view(), quarter_[1].view(), quarter_[2].view()};
}

void Pipeline::map_seeing_of(const DevelopPlan& plan) {
  SeeingMap& map = seeing_.emplace();
  map.probability = Plane<float>(quarter_[0].width(), quarter_[0].height());
  const RgbTransform& transform = plan.rendering.transform;
  map.seen_fraction = map_seeing(quarter_view(), transform.matrix, transform.clip, plan.rendering.look->look,
                                 map.probability.view(), executor_);
}

LookGrid Pipeline::look_grid(const DevelopPlan& plan) {
  if (!look_ || look_width_ < plan.width || look_height_ < plan.height) {
    look_width_ = std::max(plan.width, look_width_);
    look_height_ = std::max(plan.height, look_height_);
    look_.reset();  // frees its memory before the next one is allocated
    look_ = std::make_unique<NightLookGrid>(look_width_, look_height_);
  }
  std::optional<NoiseLimit> limit;
  if (bounds_noise(plan)) {
    limit = {*plan.rendering.look->noise_limit, plan.rendering.limit, luminance_noise_.view()};
  }
  return look_->make(quarter_view(), plan.rendering.transform.matrix, plan.rendering.transform.clip,
                     plan.rendering.look->look, limit, executor_);
}

// Sharpens luminance as the image has it. Saturated pixels are those at the clip, or, where highlights are rebuilt, at
// the saturation of each channel.
void Pipeline::sharpen(const RawFrame& frame, const DevelopPlan& plan, const RgbView<float>& planes) {
  measure_cells(CameraPlanes{{planes[0], planes[1], planes[2]}, {1, 1, 1}}, frame, plan);
  CaptureSharpening how{.blur_px = static_cast<float>(*plan.sharpen_px), .luminance = luminance_of_camera(plan)};
  const float sum = how.luminance[0] + how.luminance[1] + how.luminance[2];
  for (float& weight : how.luminance) weight /= sum;
  if (plan.options.highlights == Highlights::reconstruct) how.saturation = saturation_of(plan);
  // Interpolation between pixels of a mosaic makes the noise of neighbours alike: detail has up to three times the
  // noise that it would have of independent channels.
  const float unit = (plan.demosaic.reason.empty() ? 1 : 3) / (sum * sum);
  Plane<float> variance(luminance_noise_.width(), luminance_noise_.height());
  std::transform(luminance_noise_.data(), luminance_noise_.data() + luminance_noise_.size(), variance.data(),
                 [unit](float value) { return unit * value; });
  sharpen_capture(how, std::as_const(variance).view(), planes, executor_);
}

CameraPlanes Pipeline::finished_planes(const RgbInput& in, const RawFrame& frame, const DevelopPlan& plan) {
  for (Plane<float>& plane : finished_) fit(plane, plan.width, plan.height);
  const RgbView<float> planes{finished_[0].view(), finished_[1].view(), finished_[2].view()};
  kernel_->linear(in, {.clip = plan.rendering.transform.clip, .move_into_gamut = false}, planes, executor_);
  if (plan.options.highlights == Highlights::reconstruct) {
    reconstruct_highlights(planes, saturation_of(plan), executor_);
  }
  if (plan.sharpen_px) sharpen(frame, plan, planes);
  return {{planes[0], planes[1], planes[2]}, {1, 1, 1}};
}

template <class Encode>
void Pipeline::render_to(const RawFrame& frame, const DevelopPlan& plan, const Encode& encode) {
  has_noise_maps_ = keeps_maps(plan);
  reserve(frame, plan);
  RgbInput in = frame.raw.layout == SensorLayout::bayer ? prepare_bayer(frame, plan) : prepare_planes(frame, plan);
  if (finishes(plan)) in = finished_planes(in, frame, plan);
  RgbTransform transform = plan.rendering.transform;
  if (needs_grid(plan) || needs_noise(plan) || needs_seeing_map(plan)) measure_cells(in, frame, plan);
  LookGrid look;
  if (needs_grid(plan)) {
    look = look_grid(plan);
    transform.look = &look;
  }
  seeing_.reset();
  if (needs_seeing_map(plan)) map_seeing_of(plan);
  if (needs_table(plan)) {
    encode(as_modelled(in, plan), transform_of_modelled(plan, transform.look));
  } else if (plan.rendering.profile) {
    for (Plane<float>& plane : modelled_) fit(plane, plan.width, plan.height);
    const RgbView<float> planes{modelled_[0].view(), modelled_[1].view(), modelled_[2].view()};
    encode(through_profile(*kernel_, in, plan, planes, executor_), transform_of_modelled(plan, transform.look));
  } else {
    encode(in, transform);
  }
}

void Pipeline::render(const RawFrame& frame, const DevelopPlan& plan, Picture& out) {
  if (!plan.framing) return render_all(frame, plan, out);
  if (plan.framing->shrinks()) return render_shrunk(frame, plan, out);
  Picture all = make_picture(plan.options.samples, plan.width, plan.height);
  render_all(frame, plan, all);
  copy_pixels(crop_of(view_of(all), plan.framing->pixels), view_of(out));
}

// The mean is taken of light, signed and before the tone curve: black noise would otherwise be rectified by each pixel.
void Pipeline::render_shrunk(const RawFrame& frame, const DevelopPlan& plan, Picture& out) {
  DevelopPlan light = plan;
  light.options.samples = SampleType::f32;
  light.rendering.transform.move_into_gamut = false;
  light.display.reset();
  light.framing.reset();
  Picture all = make_picture(light);
  render_all(frame, light, all);
  const Rect& kept = plan.framing->pixels;
  const PictureSize& size = plan.framing->size;
  const auto part = std::get<RgbView<float>>(crop_of(view_of(all), kept));
  SceneLinear small(size.width, size.height);
  shrink_by_area({part[0], part[1], part[2]}, small.view(), executor_);
  reserve_kernel(size.width);
  const RgbView<const float> planes = std::as_const(small).view();
  encode(*kernel_, CameraPlanes{planes, {1, 1, 1}}, transform_of_modelled(plan, nullptr), plan, view_of(out),
         executor_);
}

void Pipeline::render_all(const RawFrame& frame, const DevelopPlan& plan, Picture& out) {
  if (is_tiled(frame.raw, plan, limits_)) {
    has_noise_maps_ = false;
    seeing_.reset();
    return tiles_.render(frame, plan, noise_reducer_, out);
  }
  render_to(frame, plan, [&](const RgbInput& in, const RgbTransform& transform) {
    encode(*kernel_, in, transform, plan, view_of(out), executor_);
  });
}

void Pipeline::render(const RawFrame& frame, const DevelopPlan& plan, const RowSink& out) {
  render_to(frame, plan, [&](const RgbInput& in, const RgbTransform& transform) {
    kernel_->rows8(in, transform, plan.rendering.tone, out, executor_);
  });
}

void Pipeline::render(const RawFrame& frame, const DevelopPlan& plan, PlaneView<std::uint16_t> out) {
  render_to(frame, plan, [&](const RgbInput& in, const RgbTransform& transform) {
    kernel_->rgb16(in, transform, plan.rendering.tone, out, executor_);
  });
}

PlaneView<const float> Pipeline::signal(const RawFrame& frame, const DevelopPlan& plan) {
  mosaic_ = signal_electrons(frame, plan).value;
  return std::as_const(mosaic_).view();
}

// Passes light relative to the scene's white through the model's table; the planes are in the image's own primaries.
CameraPlanes Pipeline::as_modelled(const RgbInput& in, const DevelopPlan& plan) {
  for (Plane<float>& plane : modelled_) fit(plane, plan.width, plan.height);
  const RgbView<float> planes{modelled_[0].view(), modelled_[1].view(), modelled_[2].view()};
  const auto limit = static_cast<float>(plan.rendering.look->look.cd_m2_per_unit / plan.rendering.look->white_cd_m2);
  RgbTransform to_light = plan.rendering.transform;
  for (float& coefficient : to_light.matrix) coefficient *= limit;
  to_light.move_into_gamut = false;
  kernel_->linear(in, to_light, planes, executor_);
  const ColourTable& table = *plan.rendering.look->table;
  const RgbView<const float> light{planes[0], planes[1], planes[2]};
  if (table.by_noise) {
    fit(signal_to_noise_, cells_along(plan.width), cells_along(plan.height));
    signal_to_noise(plan, quarter_view(), luminance_noise_.view(), signal_to_noise_.view(), executor_);
    apply_colour_table(table, light, NoiseGrid{signal_to_noise_.view()}, planes, executor_);
  } else {
    apply_colour_table(table, light, planes, executor_);
  }
  return {{planes[0], planes[1], planes[2]}, {1 / limit, 1 / limit, 1 / limit}};
}

Picture make_picture(const DevelopPlan& plan) {
  const PictureSize size = plan.framing ? plan.framing->size : PictureSize{plan.width, plan.height};
  return make_picture(plan.options.samples, size.width, size.height);
}

}  // namespace lowlux::isp
