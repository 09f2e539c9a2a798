#include "calib/picture/noise_samples.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace lowlux::calib {
namespace {

constexpr int side = noise_block;
using Block = std::array<float, side * side>;

/// Returns the matrix of the orthonormal cosine transform, [x][u] for position x and frequency u.
const std::array<std::array<float, side>, side>& cosines() {
  static const auto table = [] {
    std::array<std::array<float, side>, side> out{};
    for (int u = 0; u < side; ++u) {
      const double scale = std::sqrt((u == 0 ? 1.0 : 2.0) / side);
      for (int x = 0; x < side; ++x) {
        out[x][u] = static_cast<float>(scale * std::cos(std::numbers::pi * u * (2 * x + 1) / (2 * side)));
      }
    }
    return out;
  }();
  return table;
}

enum class Band : std::uint8_t { none, low, middle, high };

/// Assigns bands by u + v and not by the smaller of the two: a lens transmits less of the scene the finer a detail is,
/// so the middle ones reveal texture that is equally strong in the high ones. The finest of all holds most of a
/// difference between the two greens of a mosaic, which is not noise.
constexpr Band band_of(int u, int v) {
  if (u + v <= 1 || u + v == 2 * (side - 1)) return Band::none;
  if (u + v >= side) return Band::high;
  return u + v <= 3 ? Band::low : Band::middle;
}

constexpr int count_of(Band band) {
  int count = 0;
  for (int v = 0; v < side; ++v) {
    for (int u = 0; u < side; ++u) count += band_of(u, v) == band ? 1 : 0;
  }
  return count;
}

/// A square lattice of pixels of one colour: pixel (u, v) lies at (x + u ux + v vx, y + u uy + v vy) of the active
/// area.
struct Lattice {
  const RawDn& raw;
  PerSite<float> black_dn;
  std::uint8_t site;  // the lowest of its sites
  int ux, uy, vx, vy;

  /// Returns the code of pixel (0, 0) at (x, y); those of others lie u along() + v across() further.
  const std::uint16_t* at(int x, int y) const { return raw.dn.row(raw.active.y + y) + raw.active.x + x; }
  std::ptrdiff_t along() const { return ux + uy * raw.dn.view().stride; }
  std::ptrdiff_t across() const { return vx + vy * raw.dn.view().stride; }

  /// Returns the black of the pixels with an even and with an odd u + v from (x, y): the two greens of a Bayer mosaic
  /// differ.
  std::array<float, 2> black_at(int x, int y) const {
    return {black_dn[site_of(x, y)], black_dn[site_of(x + ux, y + uy)]};
  }
};

// The innermost loops run over frequencies, whose sums are independent of each other.
void transform(const Block& in, Block& out) {
  const auto& c = cosines();
  Block half{};
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      for (int u = 0; u < side; ++u) half[y * side + u] += c[x][u] * in[y * side + x];
    }
  }
  out.fill(0);
  for (int v = 0; v < side; ++v) {
    for (int y = 0; y < side; ++y) {
      for (int u = 0; u < side; ++u) out[v * side + u] += c[y][v] * half[y * side + u];
    }
  }
}

constexpr int block_window = side + 2 * noise_border;
constexpr double block_step_fraction = 1.0 / (side * side) + 1.0 / (block_window * block_window - side * side);

NoiseSample block_sample(const Lattice& lattice, int x0, int y0) {
  const std::uint16_t* const first = lattice.at(x0, y0);
  const std::ptrdiff_t along = lattice.along(), across = lattice.across();
  const std::array<float, 2> black = lattice.black_at(x0, y0);
  Block pixels, details;
  int all = 0, inside = 0;
  for (int y = -noise_border; y < side + noise_border; ++y) {
    for (int x = -noise_border; x < side + noise_border; ++x) all += first[x * along + y * across];
  }
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const int code = first[x * along + y * across];
      inside += code;
      pixels[y * side + x] = static_cast<float>(code) - black[(x + y) & 1];
    }
  }
  // Half of the pixels of either sum have either black.
  const double mean_black = 0.5 * (static_cast<double>(black[0]) + black[1]);
  const auto mean = [&](int sum, int count) {
    return static_cast<float>(sum / static_cast<double>(count) - mean_black);
  };
  NoiseSample out{.mean_dn = mean(inside, side * side),
                  .around_dn = mean(all - inside, block_window * block_window - side * side),
                  .site = lattice.site};
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

/// Sums of the eight parts of the 7 x 7 sites around the middle 3 x 3: corners of 2 x 2, sides of 3 x 2.
using Parts = std::array<float, 9>;

NoiseSample detail_sample(const Lattice& lattice, int x0, int y0) {
  constexpr std::array<int, 7> part{0, 0, 1, 1, 1, 2, 2};
  constexpr std::array<float, 3> second_difference{1, -2, 1};
  Parts sum{};
  float detail = 0;
  const std::uint16_t* const middle = lattice.at(x0, y0);
  const std::ptrdiff_t along = lattice.along(), across = lattice.across();
  const std::array<float, 2> black = lattice.black_at(x0, y0);
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 7; ++x) {
      const int code = middle[(x - detail_reach) * along + (y - detail_reach) * across];
      const float value = static_cast<float>(code) - black[(x + y) & 1];
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
          .site = lattice.site};
}

/// Returns the lattices of a mosaic. The greens of a Bayer mosaic are one lattice at 45 degrees: with only one of its
/// two halves, whose pixels lie two apart, details would be aliased with finer ones of the scene. Each other site is a
/// lattice of its own.
std::vector<Lattice> lattices_of(const RawDn& raw, const PerSite<double>& black_dn) {
  PerSite<float> black;
  for (int site = 0; site < 4; ++site) black[site] = static_cast<float>(black_dn[site]);
  std::vector<Lattice> out;
  for (int site = 0; site < 4; ++site) {
    const bool green =
        raw.layout == SensorLayout::bayer && colour_at(raw.phase, site & 1, site >> 1) == CfaColour::green;
    const auto index = static_cast<std::uint8_t>(site);
    if (!green) {
      out.push_back({raw, black, index, 2, 0, 0, 2});
    } else if (site < 2) {
      out.push_back({raw, black, index, 1, 1, 1, -1});
    }
  }
  return out;
}

/// Extent of a sample from its first pixel, and distance to the next one: [pixels of the lattice].
struct Reach {
  int before = 0;
  int after = 0;
  int step = 1;
};

/// Positions of the samples of a lattice: rows of them, every second one shifted where the lattice is turned.
struct Places {
  int x = 0, y = 0;
  int step_x = 1, step_y = 1;
  int shift = 0;
  int columns = 0, rows = 0;
};

Places places_of(const Lattice& l, const Reach& reach) {
  const auto count = [](int room, int step) { return room < 0 ? 0 : room / step + 1; };
  const int site_x = l.site & 1, site_y = l.site >> 1;
  const int width = l.raw.active.width, height = l.raw.active.height, long_side = reach.before + reach.after;
  Places out;
  if (l.vx == 0) {
    out = {site_x + 2 * reach.before, site_y + 2 * reach.before, 2 * reach.step, 2 * reach.step};
    out.columns = count(width - 1 - out.x - 2 * reach.after, out.step_x);
    out.rows = count(height - 1 - out.y - 2 * reach.after, out.step_y);
    return out;
  }
  out = {2 * reach.before + site_x, long_side + (long_side & 1), 2 * reach.step, reach.step, reach.step};
  out.columns = count(width - 1 - out.x - out.shift - 2 * reach.after, out.step_x);
  out.rows = count(height - 1 - out.y - long_side, out.step_y);
  return out;
}

template <class Sampler>
std::vector<NoiseSample> samples_of(const RawDn& raw, const SamplePlan& plan, Executor& executor, const Reach& reach,
                                    const Sampler& sampler) {
  assert(raw.layout != SensorLayout::linear_rgb && plan.max_samples > 0);
  const std::vector<Lattice> lattices = lattices_of(raw, plan.black_dn);
  std::int64_t all = 0;
  for (const Lattice& lattice : lattices) {
    const Places places = places_of(lattice, reach);
    all += static_cast<std::int64_t>(places.columns) * places.rows;
  }
  const int every = static_cast<int>((all + plan.max_samples - 1) / plan.max_samples);
  std::vector<NoiseSample> out;
  for (const Lattice& lattice : lattices) {
    if (every == 0) break;
    const Places p = places_of(lattice, reach);
    const int rows = (p.rows + every - 1) / every;
    const std::size_t start = out.size();
    out.resize(start + static_cast<std::size_t>(rows) * p.columns);
    for_each_band(executor, rows, [&](const RowBand& band, int) {
      for (int i = band.first; i < band.last; ++i) {
        const int row = i * every, x = p.x + (row % 2) * p.shift;
        for (int j = 0; j < p.columns; ++j) {
          out[start + static_cast<std::size_t>(i) * p.columns + j] =
              sampler(lattice, x + j * p.step_x, p.y + row * p.step_y);
        }
      }
    });
  }
  return out;
}

}  // namespace

NoiseSamples block_samples(const RawDn& raw, const SamplePlan& plan, Executor& executor) {
  return {{count_of(Band::low), count_of(Band::middle), count_of(Band::high), block_step_fraction, 1},
          samples_of(raw, plan, executor, {noise_border, side + noise_border - 1, side}, block_sample)};
}

NoiseSamples detail_samples(const RawDn& raw, const SamplePlan& plan, Executor& executor) {
  // Samples two sites apart have pixels in common: their squares are correlated by 1/36 (adjacent) and 1/1296
  // (diagonal).
  constexpr double share = 1 / (1 + 4.0 / 36 + 4.0 / 1296);
  return {{6, 0, 1, 1.0 / 9 + 1.0 / 40, share},
          samples_of(raw, plan, executor, {detail_reach, detail_reach, 2}, detail_sample)};
}

}  // namespace lowlux::calib
