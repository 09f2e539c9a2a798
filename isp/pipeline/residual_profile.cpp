#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "isp/pipeline/clean_raw.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

constexpr double least_scale = 1 / most_electrons_at_white;
constexpr std::int64_t most_cells = 100'000;

struct Sample {
  double x;  // fraction of white
  double variance;
};

/// Weighted least squares of variance = scale x + offset, weights 1 / variance^2: every level counts alike. Where the
/// line would fall, or start below 0, the better of the two lines at that bound is taken.
struct Line {
  double scale = least_scale;
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
  if (scale >= least_scale && offset >= 0) return {scale, offset};
  if (scale < least_scale) return {least_scale, std::max((wy - least_scale * wx) / w, 0.0)};
  return {std::max(wxy / wxx, least_scale), 0};
}

}  // namespace

NoiseProfile residual_profile(const SignalElectrons& signal_e, const std::array<Plane<float>, 3>& site_variance_e2,
                              const PerSite<double>& electrons_at_white, double added) {
  std::array<std::vector<Sample>, 3> samples;
  const int columns = signal_e.value.width() / 2, rows = signal_e.value.height() / 2;
  const std::int64_t cells = static_cast<std::int64_t>(columns) * rows;
  const std::int64_t step = std::max<std::int64_t>(1, cells / most_cells);
  for (std::int64_t cell = 0; cell < cells; cell += step) {
    const auto cell_x = static_cast<int>(cell % columns), cell_y = static_cast<int>(cell / columns);
    for (int site = 0; site < 4; ++site) {
      const int x = 2 * cell_x + (site & 1), y = 2 * cell_y + (site >> 1);
      const auto colour = static_cast<std::size_t>(colour_at(signal_e.phase, x, y));
      const double unit = 1 / electrons_at_white[site];
      const double variance = site_variance_e2[colour].at(cell_x, cell_y) * unit * unit + added;
      if (variance > 0) samples[colour].push_back({std::max(0.0, signal_e.value.at(x, y) * unit), variance});
    }
  }
  NoiseProfile out;
  for (std::size_t c = 0; c < 3; ++c) {
    const Line line = fitted(samples[c]);
    out.scale[c] = line.scale;
    out.offset[c] = line.offset;
  }
  return out;
}

}  // namespace lowlux::isp
