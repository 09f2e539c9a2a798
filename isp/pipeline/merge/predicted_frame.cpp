#include "isp/pipeline/merge/predicted_frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <variant>
#include <vector>

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

constexpr int block_px = 16;
constexpr double slight_e = 0.1;  // means below it are not compared
constexpr double max_balance = 1.25;

/// Holds means over blocks of one colour: of the pixels where it is measured, and of the others.
struct BlockMeans {
  Plane<double> measured, others;
};

BlockMeans block_means(const Plane<float>& plane, BayerPhase phase, int colour, Executor& executor) {
  const int columns = (plane.width() + block_px - 1) / block_px, rows = (plane.height() + block_px - 1) / block_px;
  BlockMeans out{Plane<double>(columns, rows), Plane<double>(columns, rows)};
  for_each_index(executor, rows, [&](int j) {
    for (int i = 0; i < columns; ++i) {
      std::array<double, 2> sum{}, n{};
      for (int y = block_px * j; y < std::min(block_px * (j + 1), plane.height()); ++y) {
        for (int x = block_px * i; x < std::min(block_px * (i + 1), plane.width()); ++x) {
          const std::size_t kind = static_cast<int>(colour_at(phase, x & 1, y & 1)) == colour ? 0 : 1;
          sum[kind] += static_cast<double>(plane.at(x, y));
          ++n[kind];
        }
      }
      out.measured.at(i, j) = n[0] > 0 ? sum[0] / n[0] : 0;
      out.others.at(i, j) = n[1] > 0 ? sum[1] / n[1] : out.measured.at(i, j);
    }
  });
  return out;
}

/// Returns the ratio of both means around each block, from 3 x 3 blocks with the weights 1, 2, 1.
Plane<float> balance_of(const BlockMeans& means) {
  const int columns = means.others.width(), rows = means.others.height();
  Plane<float> out(columns, rows);
  const auto around = [&](const Plane<double>& of, int i, int j) {
    double sum = 0;
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        sum += (2 - std::abs(x)) * (2 - std::abs(y)) *
               of.at(std::clamp(i + x, 0, columns - 1), std::clamp(j + y, 0, rows - 1));
      }
    }
    return std::max(sum / 16, 0.0) + slight_e;
  };
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double ratio = around(means.measured, i, j) / around(means.others, i, j);
      out.at(i, j) = static_cast<float>(std::clamp(ratio, 1 / max_balance, max_balance));
    }
  }
  return out;
}

/// Two blocks, and how far a pixel is from the centre of the first to that of the second.
struct Between {
  int first, second;
  float fraction;
};

Between between(int pixel, int blocks) {
  const float place = (static_cast<float>(pixel) + 0.5F) / block_px - 0.5F;
  const float inside = std::clamp(place, 0.0F, static_cast<float>(blocks - 1));
  const int first = static_cast<int>(inside);
  return {first, std::min(first + 1, blocks - 1), inside - static_cast<float>(first)};
}

/// Multiplies interpolated values so that around every place each colour's mean is that of the pixels where it is
/// measured. Interpolation of cube roots shifts the mean of a colour in fine texture by some percent: as each
/// difference of a frame to the prediction is moved from interpolated places to measured ones, the result would have
/// this shift.
void balance_means(BayerPhase phase, CameraRgb& prediction, Executor& executor) {
  for (int colour = 0; colour < 3; ++colour) {
    Plane<float>& plane = prediction.plane[static_cast<std::size_t>(colour)];
    const Plane<float> balance = balance_of(block_means(plane, phase, colour, executor));
    for_each_band(executor, plane.height(), [&](const RowBand& band, int /*index*/) {
      std::vector<float> row(static_cast<std::size_t>(balance.width()));
      for (int y = band.first; y < band.last; ++y) {
        const Between v = between(y, balance.height());
        for (int i = 0; i < balance.width(); ++i) {
          row[i] = balance.at(i, v.first) + v.fraction * (balance.at(i, v.second) - balance.at(i, v.first));
        }
        for (int x = 0; x < plane.width(); ++x) {
          if (static_cast<int>(colour_at(phase, x & 1, y & 1)) == colour) continue;
          const Between u = between(x, balance.width());
          plane.at(x, y) *= row[u.first] + u.fraction * (row[u.second] - row[u.first]);
        }
      }
    });
  }
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
      plan_develop(whole, without_rendering(options, denoise::Level::standard), executor, &charge);
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
  if (frame.raw.layout == SensorLayout::bayer) balance_means(frame.raw.phase, out, executor);
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
  // The NoiseProfile of a mean counts as electrons those of all its frames.
  for (Plane<float>& plane : out->plane) {
    for_each_index(executor, plane.height(), [&](int y) {
      for (int x = 0; x < plane.width(); ++x) plane.at(x, y) /= static_cast<float>(merged.mean_count);
    });
  }
  return out;
}

}  // namespace lowlux::isp
