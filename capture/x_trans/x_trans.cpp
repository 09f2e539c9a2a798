#include "capture/x_trans/x_trans.h"

#include <algorithm>
#include <cstddef>
#include <optional>

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
  float mean;                  // of all samples, scaled: what a colour without any site gets

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

}  // namespace lowlux::capture
