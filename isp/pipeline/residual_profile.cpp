#include <algorithm>
#include <array>
#include <vector>

#include "isp/pipeline/clean_raw.h"

namespace lowlux::isp {
namespace {

constexpr double least_scale = 1e-9;
constexpr std::size_t most_samples = 100'000;  // of each colour

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
  const int width = signal_e.value.width(), height = signal_e.value.height();
  const std::size_t step = std::max<std::size_t>(1, signal_e.value.size() / 4 / most_samples);
  std::size_t seen = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (seen++ % step != 0) continue;
      const int site = site_of(x, y);
      const auto colour = static_cast<std::size_t>(colour_at(signal_e.phase, x, y));
      const double unit = 1 / electrons_at_white[site];
      const double variance = site_variance_e2[colour].at(x / 2, y / 2) * unit * unit + added;
      const double level = std::max(0.0, signal_e.value.at(x, y) * unit);
      if (variance > 0) samples[colour].push_back({level, variance});
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
