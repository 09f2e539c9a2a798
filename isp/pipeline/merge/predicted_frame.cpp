#include "isp/pipeline/merge/predicted_frame.h"

#include <array>
#include <cstdint>
#include <utility>
#include <variant>

#include "isp/pipeline/merge/merged_mosaic.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pipeline.h"

namespace lowlux::isp {
namespace {

constexpr std::int64_t max_whole_mean_px = 10'000'000;

/// Returns the description of a frame whose image is its whole active area, without gains. The samples are borrowed
/// from `frame` and have to be given back.
RawFrame whole_area(RawFrame& frame) {
  RawFrame out;
  out.raw = std::move(frame.raw);
  out.raw.default_crop = {0, 0, out.raw.active.width, out.raw.active.height};
  out.colour = frame.colour;
  out.noise = frame.noise;
  out.corrections.defects = frame.corrections.defects;
  return out;
}

/// Implements predicted_electrons() in tiles, for frames above `limits`.
Result<CameraRgb> predicted(RawFrame& frame, const DevelopOptions& options, const TileLimits& limits,
                            Executor& executor) {
  const Rect crop = frame.raw.default_crop;
  RawFrame whole = whole_area(frame);
  const auto give_back = [&] {
    frame.raw = std::move(whole.raw);
    frame.raw.default_crop = crop;
  };
  RawElectrons charge;
  Result<DevelopPlan> plan =
      plan_develop(whole, options_of_signal(options, denoise::Level::standard), executor, &charge);
  if (!plan) {
    give_back();
    return tl::make_unexpected(std::move(plan.error()));
  }
  Picture picture = make_picture(*plan);
  Pipeline(executor, limits).render(whole, *plan, picture, std::move(charge));
  give_back();
  CameraRgb out;
  out.plane = std::move(std::get<SceneLinear>(picture).plane);
  const std::array<double, 3> light_e = light_at_white_by_colour(frame.raw, plan->levels);
  for_each_index(executor, out.height(), [&](int y) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto scale = static_cast<float>(light_e[c]);
      float* const row = out.plane[c].row(y);
      for (int x = 0; x < out.width(); ++x) row[x] *= scale;
    }
  });
  return out;
}

}  // namespace

Result<CameraRgb> predicted_electrons(RawFrame& frame, const DevelopOptions& options, Executor& executor) {
  return predicted(frame, options, {}, executor);
}

Result<CameraRgb> predicted_electrons(merge::MosaicMean mean, const FrameElectrons& reference, const RawFrame& frame,
                                      const DevelopOptions& options, Executor& executor) {
  RawFrame like{.colour = frame.colour, .noise = frame.noise};
  like.raw.phase = reference.phase;
  MergedRaw merged;
  merged.frames.resize(1);
  encode_merged(mean, reference, {}, like, merged, executor);
  mean = merge::MosaicMean(0, 0);
  DevelopOptions options_of_mean = options;
  options_of_mean.black = {};
  options_of_mean.estimate_dark = options_of_mean.find_defects = false;
  // Tiles bound the memory, as the mean is kept in addition to the frame made of it.
  Result<CameraRgb> out = predicted(merged.frame, options_of_mean, {.max_whole_px = max_whole_mean_px}, executor);
  if (!out) return out;
  // The NoiseProfile of a mean counts as electrons those of all its frames, as many as it states for each colour.
  std::array<double, 3> frame_white_e{};
  for (int site = 0; site < 4; ++site) {
    const auto colour = static_cast<std::size_t>(colour_at(reference.phase, site & 1, site >> 1));
    frame_white_e[colour] += reference.light_at_white_e[site] * (colour == 1 ? 0.5 : 1);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const auto scale = static_cast<float>(frame_white_e[c] * merged.frame.noise->scale[c]);
    Plane<float>& plane = out->plane[c];
    for_each_index(executor, plane.height(), [&](int y) {
      for (int x = 0; x < plane.width(); ++x) plane.at(x, y) *= scale;
    });
  }
  return out;
}

}  // namespace lowlux::isp
