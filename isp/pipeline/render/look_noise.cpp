#include "isp/pipeline/render/look_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/look_grid.h"
#include "isp/pipeline/render/cell_figures.h"
#include "isp/pipeline/render/pixel_cells.h"

namespace lowlux::isp {
namespace {

/// Returns the luma of white in the unit of the maps of residual variance [e-].
double luma_at_white(const DevelopPlan& plan, const RawDn& raw) {
  const std::optional<std::array<double, 3>>& cell_e = plan.noise_reduction.cell_e;
  if (!cell_e) return mean_of_sites(light_at_white_e(plan.levels));
  return (*cell_e)[1] / parts_of(raw)[1];  // luma is of colours balanced to green; see scale_to_pixels
}

// Averages the residual variance of luma over the cells of the denoiser that lie in each cell of the grid: a cell is 2
// x 2 sites, or a pixel that has all colours or none.
void of_maps(const DevelopPlan& plan, const RawDn& raw, const PlaneView<const float>& residual, PlaneView<float> out,
             Executor& executor) {
  const Rect& crop = raw.default_crop;
  const std::array<float, 3> weights = luminance_of_camera(plan);
  const float unit = (weights[0] + weights[1] + weights[2]) / static_cast<float>(luma_at_white(plan, raw));
  const int side = plan.noise_reduction.cell_e ? 1 : 2;  // side of a cell of the denoiser [px]
  const int cells = (plan.options.half ? 8 : 4) / side;  // along a side of the grid's
  for_each_band(executor, out.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < out.width; ++x) {
        float sum = 0;
        for (int k = 0; k < cells * cells; ++k) {
          sum += residual.at(std::min(crop.x / side + cells * x + k % cells, residual.width - 1),
                             std::min(crop.y / side + cells * y + k / cells, residual.height - 1));
        }
        out.row(y)[x] = unit * unit * sum / static_cast<float>(cells * cells);
      }
    }
  });
}

// Returns the noise profile at fractions of light_at_white_e: with dark charge d and E electrons at white, raw values
// are d / E + (1 - d / E) x.
NoiseProfile profile_of_light(const DevelopPlan& plan, const NoiseProfile& raw, BayerPhase phase) {
  NoiseProfile out = raw;
  const PerSite<double>& dark_e = plan.levels.black.dark_mean_e;
  if (dark_e == PerSite<double>{}) return out;
  for (int site = 0; site < 4; ++site) {
    const auto c = static_cast<std::size_t>(colour_at(phase, site & 1, site >> 1));
    const double dark = dark_e[site] / (*plan.levels.electrons_at_white)[site], light = 1 - dark;
    out.scale[c] = raw.scale[c] / light;
    out.offset[c] = (raw.offset[c] + raw.scale[c] * dark) / (light * light);
  }
  return out;
}

// Applies the raw frame's variance at the fraction x of white, scale x + offset, to each channel, as if each pixel had
// its own three, except for monochrome frames.
void of_model(const DevelopPlan& plan, const Rect& crop, const NoiseProfile& noise, const RgbView<const float>& quarter,
              PlaneView<float> out, Executor& executor) {
  const NoiseRatioView ratio = view_of(plan.noise_reduction.noise_ratio.get()).from(crop.x, crop.y);
  const int side = plan.options.half ? 8 : 4;  // side of a cell of the grid, in pixels of the mosaic
  const std::array<float, 3> weights = luminance_of_camera(plan);
  const bool monochrome = !plan.rendering.white;  // one plane serves for all three
  for_each_band(executor, out.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < out.width; ++x) {
        float sum = 0, weight = 0;
        for (int c = 0; c < 3; ++c) {
          const float gain = plan.rendering.white_gain[c];
          const float fraction = std::max(quarter[c].row(y)[x], 0.0f) / gain;
          const float variance = static_cast<float>(noise.scale[c]) * fraction + static_cast<float>(noise.offset[c]);
          sum += weights[c] * weights[c] * gain * gain * variance;
          weight += weights[c] * gain;
          if (monochrome) sum = weight * weight * variance;
        }
        out.row(y)[x] = static_cast<float>(ratio.mean(side * x, side * y, side, side)) * sum;
      }
    }
  });
}

/// Logarithms of light and of the noise variance, to the base of 2.
struct LightAndNoise {
  float light, variance;
};

/// Returns medians of groups in the order of their light, of 64 cells and half a stop at least. The last cells, which
/// are fewer or more alike, belong to the group before them.
std::vector<LightAndNoise> medians_by_light(std::vector<LightAndNoise> cells) {
  constexpr std::ptrdiff_t min_cells = 64;
  constexpr float min_stops = 0.5f;
  const auto by_light = [](const LightAndNoise& a, const LightAndNoise& b) { return a.light < b.light; };
  const auto by_noise = [](const LightAndNoise& a, const LightAndNoise& b) { return a.variance < b.variance; };
  std::sort(cells.begin(), cells.end(), by_light);
  std::vector<LightAndNoise> out;
  for (auto first = cells.begin(); first != cells.end();) {
    auto last = cells.end() - first < min_cells ? cells.end() : first + min_cells;
    while (last != cells.end() && last->light < first->light + min_stops) ++last;
    if (cells.end() - last < min_cells || cells.back().light < last->light + min_stops) last = cells.end();
    const auto middle = first + (last - first) / 2;
    const float light = middle->light;
    std::nth_element(first, middle, last, by_noise);
    out.push_back({light, middle->variance});
    first = last;
  }
  return out;
}

/// Interpolates between the medians, and keeps the first and the last beyond them.
float noise_at(const std::vector<LightAndNoise>& medians, float light) {
  const auto after = std::upper_bound(medians.begin(), medians.end(), light,
                                      [](float value, const LightAndNoise& median) { return value < median.light; });
  if (after == medians.begin()) return after->variance;
  const LightAndNoise& low = after[-1];
  if (after == medians.end()) return low.variance;
  return low.variance + (light - low.light) / (after->light - low.light) * (after->variance - low.variance);
}

}  // namespace

std::array<float, 3> luminance_of_camera(const DevelopPlan& plan) {
  std::array<float, 3> weights{};
  for (int c = 0; c < 3; ++c) {
    for (int j = 0; j < 3; ++j)
      weights[c] += plan.rendering.transform.luminance[j] * plan.rendering.transform.matrix[3 * j + c];
  }
  return weights;
}

void noise_of_luminance(const DevelopPlan& plan, const RawFrame& frame, const NoiseMaps& maps,
                        const RgbView<const float>& quarter, PlaneView<float> out, Executor& executor) {
  if (plan.noise_reduction.has_level()) {
    of_maps(plan, frame.raw, maps.residual_variance_e2.view(), out, executor);
  } else {
    const RawDn& raw = frame.raw;
    of_model(plan, raw.default_crop, profile_of_light(plan, *frame.noise, raw.phase), quarter, out, executor);
  }
}

void noise_of_plain_areas(const DevelopPlan& plan, const Rect& crop, const RgbView<const float>& quarter,
                          PlaneView<const float> variance, PlaneView<float> out, Executor& executor) {
  const NoiseRatioView ratio = view_of(plan.noise_reduction.noise_ratio.get()).from(crop.x, crop.y);
  const int side = plan.options.half ? 8 : 4;  // side of a cell of the grid, in pixels of the mosaic
  const std::array<float, 3> weights = luminance_of_camera(plan);
  const auto log_light = [&](int x, int y) {
    float light = 0;
    for (std::size_t c = 0; c < 3; ++c) light += weights[c] * quarter[c].row(y)[x];
    return light > 1e-9f ? std::log2(std::min(light, 1e9f)) : -30;  // also if it is not a number
  };
  const auto ratio_at = [&](int x, int y) { return static_cast<float>(ratio.mean(side * x, side * y, side, side)); };
  constexpr int max_along = 256;  // cells that are read along each side: their medians are exact enough
  const int step_x = (out.width + max_along - 1) / max_along, step_y = (out.height + max_along - 1) / max_along;
  std::vector<LightAndNoise> cells;
  for (int y = step_y / 2; y < out.height; y += step_y) {
    for (int x = step_x / 2; x < out.width; x += step_x) {
      const float plain = variance.row(y)[x] / ratio_at(x, y);
      if (plain > 0 && plain < 1e30f) cells.push_back({log_light(x, y), std::log2(plain)});
    }
  }
  const std::vector<LightAndNoise> medians = medians_by_light(std::move(cells));
  for_each_band(executor, out.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < out.width; ++x) {
        out.row(y)[x] = medians.empty() ? 0 : ratio_at(x, y) * std::exp2(noise_at(medians, log_light(x, y)));
      }
    }
  });
}

void signal_to_noise(const DevelopPlan& plan, const RgbView<const float>& quarter, PlaneView<const float> variance,
                     PlaneView<float> out, Executor& executor) {
  constexpr float min_variance = 1e-20f, max_ratio = 1e6f;
  const std::array<float, 3> weights = luminance_of_camera(plan);
  for_each_band(executor, out.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < out.width; ++x) {
        float light = 0;
        for (std::size_t c = 0; c < 3; ++c) light += weights[c] * quarter[c].row(y)[x];
        const float ratio = light / std::sqrt(std::max(variance.row(y)[x], min_variance));
        out.row(y)[x] = ratio > 0 ? std::min(ratio, max_ratio) : 0;
      }
    }
  });
}

}  // namespace lowlux::isp
