#include "isp/pipeline/finished/residual_profile.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

constexpr double min_scale = 1 / max_electrons_at_white;
constexpr std::int64_t max_cells = 100'000;
constexpr int fit_rounds = 12;
constexpr double min_offset_fraction = 0.1;  // of the offset of the round before

struct Sample {
  double x;  // fraction of white
  double variance;
};

/// Holds the line, variance = scale x + offset, of the largest likelihood of variances with a gamma distribution of one
/// relative scatter, which is that of least squares with the weights 1 / line^2: every level counts alike, and a few
/// samples of little variance do not draw it below all others. Where the line would fall, or start below 0, the best
/// line at that bound is used.
struct Line {
  double scale = min_scale;
  double offset = 0;
};

/// Returns the line of least squares with weights by the line `at`; without it, by the variances themselves.
Line weighted_fit(const std::vector<Sample>& samples, const Line* at) {
  double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
  for (const Sample& s : samples) {
    const double expected = at != nullptr ? at->scale * s.x + at->offset : s.variance;
    const double weight = 1 / (expected * expected);
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

Line fitted(const std::vector<Sample>& samples, ProfileFit fit) {
  if (fit == ProfileFit::least) return weighted_fit(samples, nullptr);
  double sum = 0;
  for (const Sample& s : samples) sum += s.variance;
  if (!(sum > 0)) return {};
  Line out{.scale = 0, .offset = sum / static_cast<double>(samples.size())};
  for (int i = 0; i < fit_rounds; ++i) {
    Line next = weighted_fit(samples, &out);
    // An offset of 0 would give samples without light all the weight.
    next.offset = std::max(next.offset, min_offset_fraction * out.offset);
    out = next;
  }
  return out;
}

NoiseProfile profile_of(const std::array<std::vector<Sample>, 3>& samples, ProfileFit fit) {
  NoiseProfile out{.reduced = true};
  for (std::size_t c = 0; c < 3; ++c) {
    const Line line = fitted(samples[c], fit);
    out.scale[c] = line.scale;
    out.offset[c] = line.offset;
  }
  return out;
}

/// Returns the distance between the cells that are sampled of so many.
std::int64_t sample_step(std::int64_t cells) { return std::max<std::int64_t>(1, cells / max_cells); }

}  // namespace

NoiseProfile residual_profile(const SignalElectronsView& signal_e, const std::array<Plane<float>, 3>& site_variance_e2,
                              const PerSite<double>& light_e, double added, ProfileFit fit) {
  std::array<std::vector<Sample>, 3> samples;
  const int columns = signal_e.value.width / 2, rows = signal_e.value.height / 2;
  const std::int64_t cells = static_cast<std::int64_t>(columns) * rows;
  const std::int64_t step = sample_step(cells);
  for (std::int64_t cell = 0; cell < cells; cell += step) {
    const auto cell_x = static_cast<int>(cell % columns), cell_y = static_cast<int>(cell / columns);
    for (int site = 0; site < 4; ++site) {
      const int x = 2 * cell_x + (site & 1), y = 2 * cell_y + (site >> 1);
      const auto colour = static_cast<std::size_t>(colour_at(signal_e.phase, x, y));
      const double unit = 1 / light_e[site];
      const float variance_e2 = site_variance_e2[colour].at(cell_x, cell_y);
      if (!(variance_e2 > 0)) continue;
      samples[colour].push_back({std::max(0.0, signal_e.value.at(x, y) * unit), variance_e2 * unit * unit + added});
    }
  }
  NoiseProfile out = profile_of(samples, fit);
  for (std::size_t c = 0; c < 3; ++c) {
    if (samples[c].empty()) out.offset[c] = added;
  }
  return out;
}

NoiseProfile residual_profile(std::span<const Plane<float>> planes, const NoiseMaps& maps,
                              const std::array<double, 3>& cell_e, double added) {
  std::array<std::vector<Sample>, 3> samples;
  const std::int64_t width = planes[0].width(), pixels = width * planes[0].height();
  const std::int64_t step = sample_step(pixels);
  for (std::int64_t pixel = 0; pixel < pixels; pixel += step) {
    const auto x = static_cast<int>(pixel % width), y = static_cast<int>(pixel / width);
    for (std::size_t c = 0; c < planes.size(); ++c) {
      const Plane<float>& of_site = planes.size() == 1 ? maps.residual_variance_e2 : maps.site_variance_e2[c];
      const double unit = 1 / cell_e[c], variance = of_site.at(x, y) * unit * unit + added;
      if (variance > 0) samples[c].push_back({std::max(0.0, static_cast<double>(planes[c].at(x, y))), variance});
    }
  }
  if (planes.size() == 1) samples[1] = samples[2] = samples[0];
  return profile_of(samples, ProfileFit::mean);
}

}  // namespace lowlux::isp
