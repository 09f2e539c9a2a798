#include "isp/pipeline/finished/clean_raw.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "isp/pipeline/finished/raw_codes.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/electron_mosaic.h"
#include "isp/pipeline/render/noise_reducer.h"
#include "isp/pipeline/stage_clock.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

/// Returns the standard deviation of a dark pixel in fractions of white, the largest of all sites.
double dark_noise(const DevelopPlan& plan) {
  const PerSite<double> light_e = light_at_white_e(plan.levels);
  double noise = 0;
  for (int site = 0; site < 4; ++site) {
    const denoise::RawNoise& n = plan.noise_reduction.noise;
    const double variance = *std::ranges::max_element(n.variance_e2) + n.dark_mean_e[site];
    noise = std::max(noise, std::sqrt(variance) / light_e[site]);
  }
  return noise;
}

}  // namespace

Result<CleanRaw> clean_raw(const RawFrame& frame, const DevelopOptions& options, Executor& executor) {
  if (frame.raw.layout != SensorLayout::bayer) {
    return fail(ErrorCode::unsupported,
                "clean raws are made of Bayer mosaics, and this is none: develop reduces its noise in images");
  }
  Result<DevelopPlan> plan = plan_develop(frame, options, executor);
  if (!plan) return tl::make_unexpected(std::move(plan.error()));
  if (!plan->noise_reduction.has_level()) return fail(ErrorCode::insufficient, plan->noise_reduction.reason);
  CleanRaw out;
  out.plan = *std::move(plan);
  StageClock clock(out.plan.times);
  RawElectrons raw = raw_electrons(frame, out.plan.levels, {}, executor);
  const SignalElectrons signal = NoiseReducer(executor).run(raw, out.plan.noise_reduction, {}, &out.maps);
  clock.lap("denoise");
  const SampleLevels levels = frame.raw.is_float() ? float_levels() : code_levels(dark_noise(out.plan));
  out.frame.raw = encode_signal({.signal_e = signal.value.view(),
                                 .charge_e = std::as_const(raw.value).view(),
                                 .saturation_e = out.plan.noise_reduction.noise.saturation_e,
                                 .signal_at_white_e = light_at_white_e(out.plan.levels),
                                 .charge_at_white_e = *out.plan.levels.electrons_at_white},
                                frame.raw, levels, executor);
  out.frame.colour = frame.colour;
  out.frame.corrections = frame.corrections;
  out.frame.corrections.defects.clear();
  out.frame.source_tags = frame.source_tags;
  out.frame.noise = residual_profile(signal, out.maps.site_variance_e2, light_at_white_e(out.plan.levels),
                                     levels.rounding_variance());
  if (!options.denoise.maps) out.maps = {};
  clock.lap("codes");
  return out;
}

namespace {

constexpr double min_scale = 1 / max_electrons_at_white;
constexpr std::int64_t max_cells = 100'000;

struct Sample {
  double x;  // fraction of white
  double variance;
};

/// Holds a line of weighted least squares, variance = scale x + offset, weights 1 / variance^2: every level counts
/// alike. Where the line would fall, or start below 0, the best line at that bound is used.
struct Line {
  double scale = min_scale;
  double offset = 0;
};

Line fitted(const std::vector<Sample>& samples) {
  double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
  for (const Sample& s : samples) {
    const double weight = 1 / (s.variance * s.variance);
    w += weight;
    wx += weight * s.x;
    wy += weight * s.variance;
    wxx += weight * s.x * s.x;
    wxy += weight * s.x * s.variance;
  }
  if (!(w > 0)) return {};
  const double spread = w * wxx - wx * wx;
  const double scale = spread > 1e-12 * w * wxx ? (w * wxy - wx * wy) / spread : 0;
  const double offset = (wy - scale * wx) / w;
  if (scale >= min_scale && offset >= 0) return {scale, offset};
  if (scale < min_scale) return {min_scale, std::max((wy - min_scale * wx) / w, 0.0)};
  return {std::max(wxy / wxx, min_scale), 0};
}

}  // namespace

NoiseProfile residual_profile(const SignalElectrons& signal_e, const std::array<Plane<float>, 3>& site_variance_e2,
                              const PerSite<double>& light_e, double added) {
  std::array<std::vector<Sample>, 3> samples;
  const int columns = signal_e.value.width() / 2, rows = signal_e.value.height() / 2;
  const std::int64_t cells = static_cast<std::int64_t>(columns) * rows;
  const std::int64_t step = std::max<std::int64_t>(1, cells / max_cells);
  for (std::int64_t cell = 0; cell < cells; cell += step) {
    const auto cell_x = static_cast<int>(cell % columns), cell_y = static_cast<int>(cell / columns);
    for (int site = 0; site < 4; ++site) {
      const int x = 2 * cell_x + (site & 1), y = 2 * cell_y + (site >> 1);
      const auto colour = static_cast<std::size_t>(colour_at(signal_e.phase, x, y));
      const double unit = 1 / light_e[site];
      const double variance = site_variance_e2[colour].at(cell_x, cell_y) * unit * unit + added;
      if (variance > 0) samples[colour].push_back({std::max(0.0, signal_e.value.at(x, y) * unit), variance});
    }
  }
  NoiseProfile out{.reduced = true};
  for (std::size_t c = 0; c < 3; ++c) {
    const Line line = fitted(samples[c]);
    out.scale[c] = line.scale;
    out.offset[c] = line.offset;
  }
  return out;
}

}  // namespace lowlux::isp
