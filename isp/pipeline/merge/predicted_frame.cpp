#include "isp/pipeline/merge/predicted_frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <variant>

#include "isp/pipeline/finished/raw_codes.h"
#include "isp/pipeline/merge/merged_mosaic.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pipeline.h"

namespace lowlux::isp {
namespace {

constexpr std::int64_t max_whole_mean_px = 10'000'000;
constexpr std::int64_t strip_px = 4'000'000;
constexpr int strip_margin_px = 64;  // above and below, as tiles with levels up to standard have it in cells
constexpr int min_strip_rows = 128;

/// Returns the description of a frame whose image is its whole active area, without gains. The samples are borrowed
/// from `frame` and have to be given back.
RawFrame whole_area(RawFrame& frame) {
  RawFrame out;
  out.raw = std::move(frame.raw);
  out.raw.default_crop = {0, 0, out.raw.active.width, out.raw.active.height};
  out.colour = frame.colour;
  out.noise = frame.noise;
  out.noise_ratio = frame.noise_ratio;
  out.corrections.defects = frame.corrections.defects;
  return out;
}

/// Says how a frame is predicted.
struct PredictionWay {
  denoise::Level level = denoise::Level::standard;
  TileLimits limits;
  std::optional<std::array<double, 3>> white_e;  // light at white of R, G, B; absent: that of the frame
};

/// Implements predicted_electrons().
Result<CameraRgb> predicted(RawFrame& frame, const DevelopOptions& options, const PredictionWay& way,
                            Executor& executor) {
  const Rect crop = frame.raw.default_crop;
  RawFrame whole = whole_area(frame);
  const auto return_buffer = [&] {
    frame.raw = std::move(whole.raw);
    frame.raw.default_crop = crop;
  };
  RawElectrons charge;
  Result<DevelopPlan> plan = plan_develop(whole, options_of_signal(options, way.level), executor, &charge);
  if (!plan) {
    return_buffer();
    return tl::make_unexpected(std::move(plan.error()));
  }
  Picture picture = make_picture(*plan);
  Pipeline(executor, way.limits).render(whole, *plan, picture, std::move(charge));
  return_buffer();
  CameraRgb out;
  out.plane = std::move(std::get<SceneLinear>(picture).plane);
  const std::array<double, 3> light_e = way.white_e ? *way.white_e : light_at_white_by_colour(frame.raw, plan->levels);
  for_each_index(executor, out.height(), [&](int y) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto scale = static_cast<float>(light_e[c]);
      float* const row = out.plane[c].row(y);
      for (int x = 0; x < out.width(); ++x) row[x] *= scale;
    }
  });
  return out;
}

/// Returns the options for a mean of frames, of which black, dark frame and defects are removed. Its codes are not
/// those of the sensor, whose level of saturation they do not show.
DevelopOptions options_of_mean(DevelopOptions options) {
  options.black = {};
  options.dark_frame = nullptr;
  options.series_dark_e.reset();
  options.series_saturation.reset();
  options.estimate_dark = options.find_defects = options.find_saturation = false;
  return options;
}

/// Returns the light at white of R, G and B of one frame. The NoiseProfile of a mean counts the electrons of all its
/// frames.
std::array<double, 3> white_of(const ColourLevels& levels) {
  return {levels.white_e[0], levels.white_e[1], levels.white_e[2]};
}

/// Returns the rows of a strip without its margins, a multiple of these.
int strip_rows(int width) {
  const auto rows = static_cast<int>(strip_px / width) - 2 * strip_margin_px;
  return std::max(rows - rows % strip_margin_px, min_strip_rows);
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
  // Tiles bound the memory, as the mean is kept in addition to the frame made of it.
  return predicted(merged.frame, options_of_mean(options),
                   {.limits = {.max_whole_px = max_whole_mean_px}, .white_e = white_of(colour_levels(reference))},
                   executor);
}

Result<void> predict_electrons(const merge::ColourMean& mean, const FrameElectrons& reference, const RawFrame& frame,
                               const DevelopOptions& options, CameraRgb& prediction, Executor& executor) {
  const ColourLevels levels = colour_levels(reference);
  const std::array<double, 3> variance = mean.variance(executor);
  RawFrame strip{.colour = frame.colour, .noise = NoiseProfile{.source = frame.noise->source}};
  for (std::size_t c = 0; c < 3; ++c) {
    strip.noise->scale[c] = variance[c] / levels.white_e[c];
    strip.noise->offset[c] = variance[c] * levels.variance_e2[c] / std::pow(levels.white_e[c], 2);
  }
  const DevelopOptions strip_options = options_of_mean(options);
  const PredictionWay way{.level = denoise::Level::draft, .white_e = white_of(levels)};
  RawDn like;
  like.layout = SensorLayout::linear_rgb;
  const int height = mean.height(), step = strip_rows(mean.width());
  for (int first = 0; first < height; first += step) {
    const int last = std::min(first + step, height);
    const RowBand rows{std::max(first - strip_margin_px, 0), std::min(last + strip_margin_px, height)};
    merge::ColourMean::Image image = mean.image(rows, variance, std::as_const(prediction).view(), executor);
    strip.noise_ratio = std::make_shared<const NoiseRatio>(std::move(image.noise_ratio));
    const PlaneView<const float> samples = std::as_const(image.samples).view();
    strip.raw = encode_signal({.signal_e = samples,
                               .charge_e = samples,
                               .saturation_e = reference.saturation_e,
                               .signal_at_white_e = levels.white_e,
                               .charge_at_white_e = levels.white_e},
                              like, float_levels(), executor);
    image.samples = {};
    const Result<CameraRgb> developed = predicted(strip, strip_options, way, executor);
    if (!developed) return tl::make_unexpected(developed.error());
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t skipped = static_cast<std::size_t>(first - rows.first) * static_cast<std::size_t>(mean.width());
      std::copy_n(developed->plane[c].data() + skipped,
                  static_cast<std::size_t>(last - first) * static_cast<std::size_t>(mean.width()),
                  prediction.plane[c].row(first));
    }
  }
  return {};
}

}  // namespace lowlux::isp
