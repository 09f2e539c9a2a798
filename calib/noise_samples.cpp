#include "calib/noise_samples.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

namespace lowlux::calib {
namespace {

constexpr int side = noise_block;
using Block = std::array<float, side * side>;

/// Row u of the orthonormal cosine transform.
const std::array<std::array<float, side>, side>& cosines() {
  static const auto table = [] {
    std::array<std::array<float, side>, side> out{};
    for (int u = 0; u < side; ++u) {
      const double scale = std::sqrt((u == 0 ? 1.0 : 2.0) / side);
      for (int x = 0; x < side; ++x) {
        out[u][x] = static_cast<float>(scale * std::cos(std::numbers::pi * u * (2 * x + 1) / (2 * side)));
      }
    }
    return out;
  }();
  return table;
}

enum class Band : std::uint8_t { none, low, middle, high };

constexpr Band band_of(int u, int v) {
  if (u + v <= 1 || (u == 3 && v == 3)) return Band::none;
  if (u >= 3 && v >= 3) return Band::high;
  return u + v <= 3 ? Band::low : Band::middle;
}

constexpr int count_of(Band band) {
  int count = 0;
  for (int v = 0; v < side; ++v) {
    for (int u = 0; u < side; ++u) count += band_of(u, v) == band ? 1 : 0;
  }
  return count;
}

/// The pixels of one site, counted from black.
struct SitePlane {
  const RawDn& raw;
  int site;
  float black_dn;
  int width;
  int height;

  float at(int x, int y) const {
    const int column = raw.active.x + 2 * x + (site & 1), row = raw.active.y + 2 * y + (site >> 1);
    return static_cast<float>(raw.dn.at(column, row)) - black_dn;
  }
};

SitePlane site_plane(const RawDn& raw, const SamplePlan& plan, int site) {
  return {raw, site, static_cast<float>(plan.black_dn[site]), (raw.active.width - (site & 1) + 1) / 2,
          (raw.active.height - (site >> 1) + 1) / 2};
}

void transform(const Block& in, Block& out) {
  const auto& c = cosines();
  Block half;
  for (int y = 0; y < side; ++y) {
    for (int u = 0; u < side; ++u) {
      float sum = 0;
      for (int x = 0; x < side; ++x) sum += c[u][x] * in[y * side + x];
      half[y * side + u] = sum;
    }
  }
  out.fill(0);
  for (int v = 0; v < side; ++v) {
    for (int y = 0; y < side; ++y) {
      for (int u = 0; u < side; ++u) out[v * side + u] += c[v][y] * half[y * side + u];
    }
  }
}

constexpr int block_window = side + 2 * noise_border;
constexpr double block_step_share = 1.0 / (side * side) + 1.0 / (block_window * block_window - side * side);

NoiseSample block_sample(const SitePlane& plane, int x0, int y0) {
  Block pixels, details;
  float all = 0, inside = 0;
  for (int y = -noise_border; y < side + noise_border; ++y) {
    for (int x = -noise_border; x < side + noise_border; ++x) {
      const float value = plane.at(x0 + x, y0 + y);
      all += value;
      if (x < 0 || x >= side || y < 0 || y >= side) continue;
      inside += value;
      pixels[y * side + x] = value;
    }
  }
  NoiseSample out{.mean_dn = inside / (side * side),
                  .around_dn = (all - inside) / (block_window * block_window - side * side),
                  .site = static_cast<std::uint8_t>(plane.site)};
  for (float& p : pixels) p -= out.mean_dn;
  transform(pixels, details);
  std::array<float, 4> energy{};
  for (int v = 0; v < side; ++v) {
    for (int u = 0; u < side; ++u) {
      const float d = details[v * side + u];
      energy[static_cast<int>(band_of(u, v))] += d * d;
    }
  }
  const auto mean_of = [&](Band band) { return energy[static_cast<int>(band)] / static_cast<float>(count_of(band)); };
  out.low_dn2 = mean_of(Band::low);
  out.middle_dn2 = mean_of(Band::middle);
  out.high_dn2 = mean_of(Band::high);
  return out;
}

constexpr int detail_reach = 3;  // sites on each side of the middle one

/// Sums of the eight parts of the 7 x 7 sites about the middle 3 x 3: corners of 2 x 2, sides of 3 x 2.
using Parts = std::array<float, 9>;

NoiseSample detail_sample(const SitePlane& plane, int x0, int y0) {
  constexpr std::array<int, 7> part{0, 0, 1, 1, 1, 2, 2};
  constexpr std::array<float, 3> second_difference{1, -2, 1};
  Parts sum{};
  float detail = 0;
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 7; ++x) {
      const float value = plane.at(x0 + x - detail_reach, y0 + y - detail_reach);
      sum[3 * part[y] + part[x]] += value;
      if (part[x] == 1 && part[y] == 1) detail += second_difference[x - 2] * second_difference[y - 2] * value;
    }
  }
  const float northwest = sum[0], north = sum[1], northeast = sum[2], west = sum[3], east = sum[5], southwest = sum[6],
              south = sum[7], southeast = sum[8];
  const std::array<float, 3> of_sides{west - east, north - south, west + east - north - south};
  const std::array<float, 3> of_corners{northwest + southwest - northeast - southeast,
                                        northwest + northeast - southwest - southeast,
                                        northwest + southeast - northeast - southwest};
  float low = of_sides[0] * of_sides[0] / 12 + of_sides[1] * of_sides[1] / 12 + of_sides[2] * of_sides[2] / 24;
  for (const float c : of_corners) low += c * c / 16;
  const float ring = northwest + north + northeast + west + east + southwest + south + southeast;
  return {.mean_dn = sum[4] / 9,
          .around_dn = ring / 40,
          .low_dn2 = low / 6,
          .high_dn2 = detail * detail / 36,
          .site = static_cast<std::uint8_t>(plane.site)};
}

/// Where samples of a site lie: at first + i * step, their pixels within the plane.
struct Lattice {
  int first = 0;
  int step = 1;
  int columns = 0;
  int rows = 0;
};

Lattice lattice_of(const SitePlane& plane, int before, int after, int step) {
  const auto places = [&](int length) {
    return length < before + after + 1 ? 0 : (length - before - after - 1) / step + 1;
  };
  return {before, step, places(plane.width), places(plane.height)};
}

template <class Sampler>
std::vector<NoiseSample> samples_of(const RawDn& raw, const SamplePlan& plan, Executor& executor,
                                    const std::array<int, 3>& before_after_step, const Sampler& sampler) {
  assert(raw.layout != SensorLayout::linear_rgb && plan.most_samples > 0);
  PerSite<Lattice> lattice;
  std::int64_t all = 0;
  for (int site = 0; site < 4; ++site) {
    const auto& [before, after, step] = before_after_step;
    lattice[site] = lattice_of(site_plane(raw, plan, site), before, after, step);
    all += static_cast<std::int64_t>(lattice[site].columns) * lattice[site].rows;
  }
  const int every = static_cast<int>((all + plan.most_samples - 1) / plan.most_samples);
  std::vector<NoiseSample> out;
  for (int site = 0; site < 4 && every > 0; ++site) {
    const Lattice& l = lattice[site];
    const SitePlane plane = site_plane(raw, plan, site);
    const int rows = (l.rows + every - 1) / every;
    const std::size_t start = out.size();
    out.resize(start + static_cast<std::size_t>(rows) * l.columns);
    for_each_band(executor, rows, [&](const RowBand& band, int) {
      for (int i = band.first; i < band.last; ++i) {
        for (int j = 0; j < l.columns; ++j) {
          out[start + static_cast<std::size_t>(i) * l.columns + j] =
              sampler(plane, l.first + j * l.step, l.first + i * every * l.step);
        }
      }
    });
  }
  return out;
}

}  // namespace

NoiseSamples block_samples(const RawDn& raw, const SamplePlan& plan, Executor& executor) {
  return {{count_of(Band::low), count_of(Band::middle), count_of(Band::high), block_step_share, 1},
          samples_of(raw, plan, executor, {noise_border, side + noise_border - 1, side}, block_sample)};
}

NoiseSamples detail_samples(const RawDn& raw, const SamplePlan& plan, Executor& executor) {
  // Samples two sites apart share pixels: their squares are correlated by 1/36 (beside) and 1/1296 (diagonally).
  constexpr double share = 1 / (1 + 4.0 / 36 + 4.0 / 1296);
  return {{6, 0, 1, 1.0 / 9 + 1.0 / 40, share},
          samples_of(raw, plan, executor, {detail_reach, detail_reach, 2}, detail_sample)};
}

}  // namespace lowlux::calib
