#include "isp/pipeline/render/image_stages.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <variant>

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/pipeline/render/frame_needs.h"
#include "isp/pipeline/render/look_noise.h"
#include "isp/render/capture_sharpening.h"
#include "isp/render/highlights.h"
#include "isp/render/local_tone.h"
#include "isp/render/night/seeing_map.h"
#include "isp/render/profile_tables.h"

namespace lowlux::isp {
namespace {

/// Writes the mean of each complete 2x2 block to `out`, which is floor(height / 2) x floor(width / 2).
void bin_plane(PlaneView<const float> in, PlaneView<float> out, Executor& executor) {
  for_each_band(executor, out.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      const float* above = in.row(2 * y);
      const float* below = in.row(2 * y + 1);
      float* row = out.row(y);
      for (int x = 0; x < out.width; ++x) {
        row[x] = 0.25f * ((above[2 * x] + above[2 * x + 1]) + (below[2 * x] + below[2 * x + 1]));
      }
    }
  });
}

using Planes = std::array<Plane<float>, 3>;

void fit(Planes& planes, int width, int height) {
  for (Plane<float>& plane : planes) lowlux::fit(plane, width, height);
}

/// Returns views of planes that are at least as large.
RgbView<float> views_of(Planes& planes, int width, int height) {
  RgbView<float> out;
  for (std::size_t c = 0; c < 3; ++c) out[c] = planes[c].view().crop(0, 0, width, height);
  return out;
}

RgbView<const float> constant(const RgbView<float>& planes) { return {planes[0], planes[1], planes[2]}; }

struct Size {
  int width, height;
};

Size size_of(const RgbInput& in) {
  return std::visit(
      [](const auto& input) -> Size {
        using Input = std::remove_cvref_t<decltype(input)>;
        if constexpr (std::is_same_v<Input, DnMosaic>) {
          return {input.dn.width, input.dn.height};
        } else if constexpr (std::is_same_v<Input, SignedMosaic>) {
          return {input.value.width, input.value.height};
        } else {
          return {input.rgb[0].width, input.rgb[0].height};
        }
      },
      in);
}

/// Returns the white-balanced camera RGB of a saturated pixel.
std::array<float, 3> saturation_of(const DevelopPlan& plan) {
  std::array<float, 3> out = plan.rendering.white_gain;
  for (std::size_t c = 0; c < 3; ++c) out[c] *= static_cast<float>(plan.saturation[c]);
  return out;
}

}  // namespace

void ImageStages::reserve(const RegionSize& largest, const DevelopPlan& plan) {
  kernel(largest.seen_width);
  const int cell = plan.options.half ? 2 : 1, width = largest.seen_width / cell, height = largest.seen_height / cell;
  if (plan.options.half) fit(half_, width, height);
  if (plan.rendering.profile) fit(modelled_, width, height);
}

RawToRgb& ImageStages::kernel(int width) {
  if (!kernel_ || kernel_width_ < width) {
    kernel_ = std::make_unique<RawToRgb>(width, executor_.width());
    kernel_width_ = width;
  }
  return *kernel_;
}

CameraPlanes ImageStages::halve(const RgbInput& in) {
  const auto [width, height] = size_of(in);
  const RgbView<float> half = views_of(half_, width / 2, height / 2);
  CameraPlanes out{constant(half), {1, 1, 1}};
  std::visit(
      [&](const auto& input) {
        if constexpr (!std::is_same_v<std::remove_cvref_t<decltype(input)>, CameraPlanes>) {
          kernel_->bin2x2(input, half, executor_);
        } else {
          out.gain = input.gain;
          for (std::size_t c = 0; c < 3; ++c) {
            const bool repeats = c > 0 && input.rgb[c].data == input.rgb[0].data;  // a monochrome frame
            if (repeats) {
              out.rgb[c] = half[0];
            } else {
              bin_plane(input.rgb[c], half[c], executor_);
            }
          }
        }
      },
      in);
  return out;
}

// Computes means of the image that is rendered, and their noise where it is needed.
void ImageStages::measure_cells(const RgbInput& in, const RawFrame& frame, const DevelopPlan& plan,
                                const NoiseMaps& maps) {
  const int width = cells_along(plan.width), height = cells_along(plan.height);
  fit(quarter_, width, height);
  kernel_->quarter(in, views_of(quarter_, width, height), executor_);
  if (!needs_noise(plan)) return;
  lowlux::fit(luminance_noise_, width, height);
  noise_of_luminance(plan, frame, maps, quarter_view(), luminance_noise_.view(), executor_);
}

RgbView<const float> ImageStages::quarter_view() const {
  return {quarter_[0].view(), quarter_[1].view(), quarter_[2].view()};
}

// Sharpens luminance as the image has it. Saturated pixels are those at the clip, or, where highlights are rebuilt, at
// the saturation of each channel.
void ImageStages::sharpen(const RawFrame& frame, const DevelopPlan& plan, const NoiseMaps& maps,
                          const RgbView<float>& planes) {
  measure_cells(CameraPlanes{constant(planes), {1, 1, 1}}, frame, plan, maps);
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

void ImageStages::change_local_tone(const RawFrame& frame, const DevelopPlan& plan, const NoiseMaps& maps,
                                    const RgbView<float>& planes) {
  const LocalTone how{.share = static_cast<float>(plan.options.local_tone),
                      .luminance = luminance_of_camera(plan),
                      .limit = static_cast<float>(plan.rendering.limit)};
  PlaneView<const float> variance;
  if (plan.local_tone_by_noise) {
    measure_cells(CameraPlanes{constant(planes), {1, 1, 1}}, frame, plan, maps);
    variance = std::as_const(luminance_noise_).view();
  }
  apply_local_tone(how, variance, planes, executor_);
}

CameraPlanes ImageStages::finish(const RgbInput& in, const RawFrame& frame, const DevelopPlan& plan,
                                 const NoiseMaps& maps) {
  fit(finished_, plan.width, plan.height);
  const RgbView<float> planes = views_of(finished_, plan.width, plan.height);
  kernel_->linear(in, {.clip = plan.rendering.transform.clip, .move_into_gamut = false}, planes, executor_);
  if (plan.options.highlights == Highlights::reconstruct) {
    reconstruct_highlights(planes, saturation_of(plan), executor_);
  }
  if (plan.sharpen_px) sharpen(frame, plan, maps, planes);
  if (plan.options.local_tone > 0) change_local_tone(frame, plan, maps, planes);
  return {constant(planes), {1, 1, 1}};
}

ImageStages::Light ImageStages::look(const RgbInput& in, const RawFrame& frame, const DevelopPlan& plan,
                                     const NoiseMaps& maps) {
  if (needs_grid(plan) || needs_noise(plan) || needs_seeing_map(plan)) measure_cells(in, frame, plan, maps);
  RgbTransform transform = plan.rendering.transform;
  if (needs_grid(plan)) transform.look = look_grid(frame.raw.default_crop, plan);
  seeing_.reset();
  if (needs_seeing_map(plan)) map_seeing_of(plan);
  if (needs_table(plan)) return {through_table(in, plan), transform_of_light(plan, transform.look)};
  if (plan.rendering.profile) return {through_profile(in, plan), transform_of_light(plan, transform.look)};
  return {in, transform};
}

const LookGrid* ImageStages::look_grid(const Rect& crop, const DevelopPlan& plan) {
  if (!look_ || look_width_ < plan.width || look_height_ < plan.height) {
    look_width_ = std::max(plan.width, look_width_);
    look_height_ = std::max(plan.height, look_height_);
    look_.reset();  // frees its memory before the next one is allocated
    look_ = std::make_unique<NightLookGrid>(look_width_, look_height_);
  }
  std::optional<NoiseLimit> limit;
  if (bounds_noise(plan)) {
    limit = {*plan.rendering.look->noise_limit, plan.rendering.limit, luminance_noise_.view()};
    if (plan.noise_reduction.has_level()) {
      lowlux::fit(plain_noise_, luminance_noise_.width(), luminance_noise_.height());
      noise_of_plain_areas(plan, crop, quarter_view(), luminance_noise_.view(), plain_noise_.view(), executor_);
      limit->variance = plain_noise_.view();
    }
  }
  const RgbTransform& transform = plan.rendering.transform;
  grid_ = look_->make(quarter_view(), transform.matrix, transform.clip, plan.rendering.look->look, limit, executor_);
  return &grid_;
}

void ImageStages::map_seeing_of(const DevelopPlan& plan) {
  SeeingMap& map = seeing_.emplace();
  map.probability = Plane<float>(quarter_[0].width(), quarter_[0].height());
  const RgbTransform& transform = plan.rendering.transform;
  map.seen_fraction = map_seeing(quarter_view(), transform.matrix, transform.clip, plan.rendering.look->look,
                                 map.probability.view(), executor_);
}

// Passes light relative to the scene's white through the model's table; the planes are in the image's own primaries.
CameraPlanes ImageStages::through_table(const RgbInput& in, const DevelopPlan& plan) {
  fit(modelled_, plan.width, plan.height);
  const RgbView<float> planes = views_of(modelled_, plan.width, plan.height);
  const auto limit = static_cast<float>(plan.rendering.look->look.cd_m2_per_unit / plan.rendering.look->white_cd_m2);
  RgbTransform to_light = plan.rendering.transform;
  for (float& coefficient : to_light.matrix) coefficient *= limit;
  to_light.move_into_gamut = false;
  kernel_->linear(in, to_light, planes, executor_);
  const ColourTable& table = *plan.rendering.look->table;
  if (table.by_noise) {
    lowlux::fit(signal_to_noise_, cells_along(plan.width), cells_along(plan.height));
    signal_to_noise(plan, quarter_view(), luminance_noise_.view(), signal_to_noise_.view(), executor_);
    apply_colour_table(table, constant(planes), NoiseGrid{signal_to_noise_.view()}, planes, executor_);
  } else {
    apply_colour_table(table, constant(planes), planes, executor_);
  }
  return {constant(planes), {1 / limit, 1 / limit, 1 / limit}};
}

// Makes linear values of the output space, exposure included, and applies the tables of the profile to them.
CameraPlanes ImageStages::through_profile(const RgbInput& in, const DevelopPlan& plan) {
  const auto [width, height] = size_of(in);
  const RgbView<float> planes = views_of(modelled_, width, height);
  RgbTransform to_light = plan.rendering.transform;
  to_light.move_into_gamut = false;
  kernel_->linear(in, to_light, planes, executor_);
  apply_profile(*plan.rendering.profile, constant(planes), planes, executor_);
  return {constant(planes), {1, 1, 1}};
}

RgbTransform transform_of_light(const DevelopPlan& plan, const LookGrid* look) {
  RgbTransform out;
  out.luminance = plan.rendering.transform.luminance;
  out.clip = INFINITY;
  out.move_into_gamut = plan.rendering.transform.move_into_gamut;
  out.look = look;
  return out;
}

}  // namespace lowlux::isp
