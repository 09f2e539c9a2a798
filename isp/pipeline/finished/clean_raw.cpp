#include "isp/pipeline/finished/clean_raw.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "isp/base/random/random.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/electron_mosaic.h"
#include "isp/pipeline/render/noise_reducer.h"
#include "isp/pipeline/stage_clock.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

constexpr double most_dn = 65535;
constexpr double rounding_dn2 = 1.0 / 6;  // mean of f (1 - f) over fractions f

/// Holds the levels of the new codes.
struct Levels {
  double black_dn;
  double range_dn;
};

/// Returns the levels of the new codes: black is a multiple of 256 from 1024 on, at most a quarter of the codes.
Levels levels_for(const DevelopPlan& plan) {
  const PerSite<double> light_e = light_at_white_e(plan.levels);
  double noise = 0;  // of a dark pixel, in fractions of white
  for (int site = 0; site < 4; ++site) {
    const denoise::RawNoise& n = plan.noise_reduction.noise;
    const double variance = *std::ranges::max_element(n.variance_e2) + n.dark_mean_e[site];
    noise = std::max(noise, std::sqrt(variance) / light_e[site]);
  }
  const double wanted = 8 * noise / (1 + 8 * noise) * most_dn;
  const double black_dn = std::clamp(256 * std::ceil(wanted / 256), 1024.0, 16384.0);
  return {black_dn, most_dn - black_dn};
}

std::uint16_t rounded(double dn, std::uint32_t word) {
  const double up = (static_cast<double>(word) + 0.5) / 4294967296.0;
  return static_cast<std::uint16_t>(std::clamp(std::floor(dn + up), 0.0, most_dn));
}

Plane<std::uint16_t> coded(const SignalElectrons& signal, const RawElectrons& raw, const DevelopPlan& plan,
                           const Levels& levels, Executor& executor) {
  const int width = signal.value.width(), height = signal.value.height();
  const std::array<double, 3>& saturation_e = plan.noise_reduction.noise.saturation_e;
  Plane<std::uint16_t> out(width, height);
  PerSite<double> dn_per_e = light_at_white_e(plan.levels);
  for (double& per_e : dn_per_e) per_e = levels.range_dn / per_e;
  for_each_band(executor, height, [&](RowBand band, int) {
    std::vector<std::uint32_t> words(width);
    for (int y = band.first; y < band.last; ++y) {
      words_row({.purpose = draw_purpose::code_dither}, 0, y, 0, words);
      for (int x = 0; x < width; ++x) {
        const auto colour = static_cast<std::size_t>(colour_at(raw.phase, x, y));
        const bool saturated = static_cast<double>(raw.value.at(x, y)) >= saturation_e[colour];
        const double dn = levels.black_dn + signal.value.at(x, y) * dn_per_e[site_of(x, y)];
        out.at(x, y) = saturated ? static_cast<std::uint16_t>(most_dn) : rounded(dn, words[x]);
      }
    }
  });
  return out;
}

RawDn clean_readout(const RawDn& raw, Plane<std::uint16_t> codes, const Levels& levels) {
  RawDn out;
  out.active = {0, 0, codes.width(), codes.height()};
  out.dn = std::move(codes);
  out.layout = raw.layout;
  out.phase = raw.phase;
  out.default_crop = raw.default_crop;
  out.black_tag = BlackLevel{.pattern_dn = {levels.black_dn}};
  out.white_dn.fill(most_dn);
  out.info = raw.info;
  return out;
}

}  // namespace

Result<CleanRaw> clean_raw(const RawFrame& frame, const DevelopOptions& options, Executor& executor) {
  Result<DevelopPlan> plan = plan_develop(frame, options, executor);
  if (!plan) return tl::make_unexpected(std::move(plan.error()));
  if (!plan->noise_reduction.has_level()) return fail(ErrorCode::insufficient, plan->noise_reduction.reason);
  CleanRaw out;
  out.plan = *std::move(plan);
  StageClock clock(out.plan.times);
  RawElectrons raw = raw_electrons(frame, out.plan.levels, {}, executor);
  const SignalElectrons signal = NoiseReducer(executor).run(raw, out.plan.noise_reduction, {}, &out.maps);
  clock.lap("denoise");
  const Levels levels = levels_for(out.plan);
  out.frame.raw = clean_readout(frame.raw, coded(signal, raw, out.plan, levels, executor), levels);
  out.frame.colour = frame.colour;
  out.frame.corrections = frame.corrections;
  out.frame.corrections.defects.clear();
  const double step = 1 / levels.range_dn;
  out.frame.noise = residual_profile(signal, out.maps.site_variance_e2, light_at_white_e(out.plan.levels),
                                     rounding_dn2 * step * step);
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
