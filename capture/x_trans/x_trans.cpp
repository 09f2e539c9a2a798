#include "capture/x_trans/x_trans.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "capture/x_trans/x_trans_tile.h"

namespace lowlux::capture {
namespace {

using x_trans::core;
using x_trans::margin;
using x_trans::padded;

/// Returns index i of n mirrored at the first and the last without repeating them.
int mirrored(int i, int n) {
  if (n == 1) return 0;
  const int period = 2 * (n - 1);
  const int at = (i % period + period) % period;
  return at < n ? at : period - at;
}

/// A mosaic that is continued beyond its borders.
struct Continued {
  PlaneView<const float> mosaic;
  const XTransSetting& setting;
  std::array<float, 3> scale;  // by which samples of each colour are multiplied
  float mean;                  // mean of all samples, scaled: what a colour without any site gets

  std::size_t colour(int x, int y) const { return static_cast<std::size_t>(colour_at(setting.phase, x, y)); }

  /// Returns the mean of the sites of a colour on the smallest square around (x, y) that has some.
  float nearest(std::size_t wanted, int x, int y) const {
    for (int r = 0; r < std::max(mosaic.width, mosaic.height); ++r) {
      float sum = 0;
      int count = 0;
      for (int j = std::max(y - r, 0); j <= std::min(y + r, mosaic.height - 1); ++j) {
        for (int i = std::max(x - r, 0); i <= std::min(x + r, mosaic.width - 1); ++i) {
          if (colour(i, j) != wanted) continue;
          sum += mosaic.row(j)[i];
          ++count;
        }
      }
      if (count > 0) return sum / static_cast<float>(count) * scale[wanted];
    }
    return mean;
  }

  float at(int x, int y) const {
    const std::size_t own = colour(x, y);
    const bool inside = x >= 0 && x < mosaic.width && y >= 0 && y < mosaic.height;
    if (inside) return mosaic.row(y)[x] * scale[own];
    return nearest(own, mirrored(x, mosaic.width), mirrored(y, mosaic.height));
  }
};

Continued continued(PlaneView<const float> mosaic, const XTransSetting& setting) {
  Continued out{mosaic, setting, {}, 0};
  for (std::size_t c = 0; c < 3; ++c) out.scale[c] = static_cast<float>(setting.neutral[1] / setting.neutral[c]);
  if (mosaic.width >= 3 && mosaic.height >= 3) return out;  // every colour has a site
  double sum = 0;
  for (int y = 0; y < mosaic.height; ++y) {
    for (int x = 0; x < mosaic.width; ++x) sum += static_cast<double>(out.at(x, y));
  }
  out.mean = static_cast<float>(sum / (static_cast<double>(mosaic.width) * mosaic.height));
  return out;
}

void fill(x_trans::Tile& tile, const Continued& from, int x0, int y0, const PlaneView<float>& out) {
  for (int j = 0; j < padded; ++j) {
    float* to = tile.samples(j);
    const bool used = j < out.height + 2 * margin;
    for (int i = 0; i < padded; ++i)
      to[i] = used && i < out.width / 3 + 2 * margin ? from.at(x0 - margin + i, y0 - margin + j) : 0;
  }
}

constexpr std::size_t levels = 16, min_blocks = 64;
constexpr double quartile_of_normal = 0.31864;  // of the absolute value of a normal deviate
constexpr int rows_used_of_all = 1200;          // rows of blocks; of larger mosaics some are skipped

/// A group of blocks of similar brightness.
struct Level {
  std::vector<float> difference;  // absolute value
  double sum = 0;                 // sum of the means
};

bool is_green_block(const XTransPhase& phase, int x, int y) {
  const auto green = [&](int dx, int dy) { return colour_at(phase, x + dx, y + dy) == CfaColour::green; };
  return green(0, 0) && green(1, 0) && green(0, 1) && green(1, 1);
}

std::array<Level, levels> group_blocks(PlaneView<const float> mosaic, const XTransPhase& phase) {
  std::array<Level, levels> groups;
  const int step = 3 * std::max(1, mosaic.height / (3 * rows_used_of_all));
  int first_x = 0, first_y = 0;  // blocks repeat every third row and column
  while (first_y < 3 && !is_green_block(phase, first_x, first_y)) {
    if (++first_x == 3) first_x = 0, ++first_y;
  }
  for (int y = first_y; y + 1 < mosaic.height; y += step) {
    const float *above = mosaic.row(y), *below = mosaic.row(y + 1);
    for (int x = first_x; x + 1 < mosaic.width; x += 3) {
      const double mean = (static_cast<double>(above[x]) + above[x + 1] + below[x] + below[x + 1]) / 4;
      if (mean >= 1) continue;
      Level& level = groups[static_cast<std::size_t>(std::sqrt(std::max(mean, 0.0)) * levels)];
      level.difference.push_back(std::fabs(above[x] - above[x + 1] - below[x] + below[x + 1]) / 2);
      level.sum += mean;
    }
  }
  return groups;
}

constexpr int neighbourhood = 2, tested_border = 3, search = 6, period = x_trans_period;
constexpr float floor_of_white = 0.01F, noise_factor = 8, detail_factor = 12;
constexpr float noise_range = 4.5F;  // of the sites of a colour, in standard deviations, as for Bayer mosaics
constexpr float max_shared = 0.1F, max_shared_green = 0.07F;

struct Offset {
  int x, y;
};

/// Lists for each of the 36 sites the offsets of those of its colour within two pixels.
using Neighbours = std::array<std::vector<Offset>, static_cast<std::size_t>(period) * period>;

Neighbours neighbours_of(const XTransPhase& phase) {
  Neighbours all;
  for (int y = 0; y < period; ++y) {
    for (int x = 0; x < period; ++x) {
      for (int dy = -neighbourhood; dy <= neighbourhood; ++dy) {
        for (int dx = -neighbourhood; dx <= neighbourhood; ++dx) {
          if ((dx != 0 || dy != 0) && colour_at(phase, x + dx, y + dy) == colour_at(phase, x, y))
            all[y * period + x].push_back({dx, dy});
        }
      }
    }
  }
  return all;
}

struct Criterion {
  PlaneView<const float> mosaic;
  const XTransPhase& phase;
  const NoiseLine& noise;
  const Neighbours& neighbours;

  const std::vector<Offset>& around(int x, int y) const { return neighbours[y % period * period + x % period]; }

  /// Returns the difference of a site from the median of its neighbours; (skip_x, skip_y) is none of them.
  float excess(int x, int y, int skip_x, int skip_y) const {
    std::array<float, 24> values;
    std::size_t count = 0;
    for (const Offset& o : around(x, y)) {
      const bool inside = x + o.x >= 0 && x + o.x < mosaic.width && y + o.y >= 0 && y + o.y < mosaic.height;
      if (inside && (x + o.x != skip_x || y + o.y != skip_y)) values[count++] = mosaic.row(y + o.y)[x + o.x];
    }
    if (count == 0) return 0;
    float* const middle = values.data() + count / 2;
    std::nth_element(values.data(), middle, values.data() + count);
    return mosaic.row(y)[x] - *middle;
  }

  bool is_outlier(int x, int y) const {
    const float value = mosaic.row(y)[x];
    float low = INFINITY, high = -INFINITY;
    for (const Offset& o : around(x, y)) {
      const float v = mosaic.row(y + o.y)[x + o.x];
      low = std::min(low, v);
      high = std::max(high, v);
    }
    const float beyond = std::max(value - high, low - value);
    if (!(beyond > floor_of_white)) return false;
    const double nearer = std::max(0.0F, value > high ? high : low);
    const auto deviation = static_cast<float>(std::sqrt(noise.scale * nearer + noise.offset));
    const float detail = std::max(0.0F, high - low - noise_range * deviation);
    return beyond > floor_of_white + noise_factor * deviation + detail_factor * detail;
  }

  bool is_defect(int x, int y) const {
    if (!is_outlier(x, y)) return false;
    const float own = excess(x, y, -1, -1);
    float shared = 0;
    for (const auto& [dx, dy] : {Offset{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) shared += excess(x + dx, y + dy, x, y) / 4;
    const bool green = colour_at(phase, x, y) == CfaColour::green;
    return shared * (own > 0 ? 1.0F : -1.0F) < (green ? max_shared_green : max_shared) * std::fabs(own);
  }
};

/// Returns the mean of the sound sites of a colour on the smallest square around (x, y) that has some; the value there
/// if no square has.
float sound_mean(PlaneView<const float> mosaic, const XTransPhase& phase, PlaneView<const std::uint8_t> defective,
                 int x, int y) {
  for (int r = 1; r <= search; ++r) {
    float sum = 0;
    int count = 0;
    for (int j = std::max(y - r, 0); j <= std::min(y + r, mosaic.height - 1); ++j) {
      for (int i = std::max(x - r, 0); i <= std::min(x + r, mosaic.width - 1); ++i) {
        if (colour_at(phase, i, j) != colour_at(phase, x, y) || defective.row(j)[i] != 0) continue;
        sum += mosaic.row(j)[i];
        ++count;
      }
    }
    if (count > 0) return sum / static_cast<float>(count);
  }
  return mosaic.row(y)[x];
}

}  // namespace

void interpolate_x_trans(PlaneView<const float> mosaic, const XTransSetting& setting, PlaneView<float> out,
                         Executor& executor) {
  const Continued from = continued(mosaic, setting);
  const int columns = (mosaic.width + core - 1) / core, rows = (mosaic.height + core - 1) / core;
  const int workers = std::min(executor.width(), columns * rows);
  for_each_index(executor, workers, [&](int worker) {
    x_trans::Tile tile(setting);
    for (int t = worker; t < columns * rows; t += workers) {
      const int x = t % columns * core, y = t / columns * core;
      const int width = std::min(core, mosaic.width - x), height = std::min(core, mosaic.height - y);
      const PlaneView<float> part = out.crop(3 * x, y, 3 * width, height);
      fill(tile, from, x, y, part);
      tile.run(x, y, part);
    }
  });
}

NoiseLine estimate_mosaic_noise(PlaneView<const float> mosaic, const XTransPhase& phase) {
  // Least squares of relative errors, in which each level weighs by its number of blocks.
  double w = 0, wx = 0, wxx = 0, wv = 0, wxv = 0;
  for (Level& level : group_blocks(mosaic, phase)) {
    if (level.difference.size() < min_blocks) continue;
    const auto quartile = level.difference.begin() + static_cast<std::ptrdiff_t>(level.difference.size() / 4);
    std::nth_element(level.difference.begin(), quartile, level.difference.end());
    const double count = static_cast<double>(level.difference.size()), x = std::max(level.sum / count, 0.0);
    const double deviation = static_cast<double>(*quartile) / quartile_of_normal, v = deviation * deviation;
    const double weight = count / std::max(v * v, 1e-20);
    w += weight, wx += weight * x, wxx += weight * x * x, wv += weight * v, wxv += weight * x * v;
  }
  if (w == 0) return {};
  const double determinant = w * wxx - wx * wx;
  const double scale = determinant > 1e-9 * w * wxx ? (w * wxv - wx * wv) / determinant : 0;
  const double offset = (wv - scale * wx) / w;
  if (scale < 0 || wxx == 0) return {0, wv / w};
  if (offset < 0) return {wxv / wxx, 0};
  return {scale, offset};
}

std::vector<DefectRect> find_mosaic_defects(PlaneView<const float> mosaic, const XTransPhase& phase,
                                            const NoiseLine& noise, Executor& executor) {
  const Neighbours neighbours = neighbours_of(phase);
  const Criterion judge{mosaic, phase, noise, neighbours};
  std::vector<std::vector<DefectRect>> found(static_cast<std::size_t>(executor.width()));
  for_each_band(executor, mosaic.height, [&](RowBand band, int index) {
    const int last = std::min(band.last, mosaic.height - tested_border);
    for (int y = std::max(band.first, tested_border); y < last; ++y) {
      for (int x = tested_border; x < mosaic.width - tested_border; ++x) {
        if (judge.is_defect(x, y)) found[static_cast<std::size_t>(index)].push_back({x, y, 1, 1});
      }
    }
  });
  std::vector<DefectRect> all;
  for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
  return all;
}

void repair_mosaic(PlaneView<float> mosaic, const XTransPhase& phase, const std::vector<DefectRect>& defects) {
  if (defects.empty()) return;
  Plane<std::uint8_t> defective(mosaic.width, mosaic.height);
  std::fill_n(defective.data(), defective.size(), std::uint8_t{0});
  const auto each = [&](const auto& use) {
    for (const DefectRect& d : defects) {
      for (int y = std::max(d.y, 0); y < std::min(d.y + d.height, mosaic.height); ++y) {
        for (int x = std::max(d.x, 0); x < std::min(d.x + d.width, mosaic.width); ++x) use(x, y);
      }
    }
  };
  each([&](int x, int y) { defective.row(y)[x] = 1; });
  each([&](int x, int y) { mosaic.row(y)[x] = sound_mean(mosaic, phase, defective.view(), x, y); });
}

}  // namespace lowlux::capture
