#include "isp/render/highlights.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace lowlux::isp {
namespace {

constexpr int cell_px = 4;
constexpr float saturated_from = 0.95f, saturated_fully = 0.99f;
constexpr float bright_from = 0.05f;     // fraction of saturation below which a pixel says nothing about a light
constexpr float enough_evidence = 0.5f;  // weight from which a cell needs no wider means

constexpr float max_log_ratio = 4;  // 55 times: no light of lamps is more saturated in camera RGB

/// Holds sums of the logarithms of R / G and B / G and their weight, for one cell.
struct Colour {
  float red = 0;
  float blue = 0;
  float weight = 0;
};

using Level = Plane<Colour>;

float saturated_fraction(float value, float saturation) {
  const float t = std::clamp((value / saturation - saturated_from) / (saturated_fully - saturated_from), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

/// Returns what a pixel says about the colour of the light.
Colour evidence_of(const std::array<float, 3>& value, const std::array<float, 3>& saturation) {
  float brightest = 0, darkest = INFINITY;
  for (std::size_t c = 0; c < 3; ++c) {
    brightest = std::max(brightest, value[c] / saturation[c]);
    darkest = std::min(darkest, value[c] / saturation[c]);
  }
  if (!(brightest < saturated_from && brightest > bright_from) || !(darkest > 0)) return {};
  const float weight = brightest * brightest * (0.1f + 0.9f * darkest);
  const auto log_ratio = [](float a, float b) { return std::clamp(std::log(a / b), -max_log_ratio, max_log_ratio); };
  return {weight * log_ratio(value[0], value[1]), weight * log_ratio(value[2], value[1]), weight};
}

Colour sum_of(const Colour& a, const Colour& b) { return {a.red + b.red, a.blue + b.blue, a.weight + b.weight}; }

std::array<float, 3> pixel_of(const RgbView<float>& rgb, int x, int y) {
  return {rgb[0].row(y)[x], rgb[1].row(y)[x], rgb[2].row(y)[x]};
}

/// Sums what the pixels of each cell say; `touched` is 1 where one of them has a saturated channel.
Level cells_of(const RgbView<float>& rgb, const std::array<float, 3>& saturation, Plane<std::uint8_t>& touched,
               Executor& executor) {
  Level out(touched.width(), touched.height());
  for_each_band(executor, out.height(), [&](const RowBand& band, int /*index*/) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < out.width(); ++x) {
        Colour sum;
        bool any = false;
        for (int j = cell_px * y; j < std::min(cell_px * (y + 1), rgb[0].height); ++j) {
          for (int i = cell_px * x; i < std::min(cell_px * (x + 1), rgb[0].width); ++i) {
            const std::array<float, 3> value = pixel_of(rgb, i, j);
            for (std::size_t c = 0; c < 3; ++c) any = any || value[c] >= saturated_from * saturation[c];
            sum = sum_of(sum, evidence_of(value, saturation));
          }
        }
        out.at(x, y) = sum;
        touched.at(x, y) = any ? 1 : 0;
      }
    }
  });
  return out;
}

bool has_neighbour(const Plane<std::uint8_t>& touched, int x, int y) {
  for (int j = std::max(0, y - 1); j <= std::min(touched.height() - 1, y + 1); ++j) {
    for (int i = std::max(0, x - 1); i <= std::min(touched.width() - 1, x + 1); ++i) {
      if (touched.at(i, j) != 0) return true;
    }
  }
  return false;
}

/// Keeps cells at saturated places and next to them: what is farther away is another thing.
void keep_borders(const Plane<std::uint8_t>& touched, Level& cells) {
  for (int y = 0; y < cells.height(); ++y) {
    for (int x = 0; x < cells.width(); ++x) {
      if (!has_neighbour(touched, x, y)) cells.at(x, y) = {};
    }
  }
}

/// Returns the sums of 2 x 2 cells.
Level coarser(const Level& fine) {
  Level out((fine.width() + 1) / 2, (fine.height() + 1) / 2);
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      Colour sum;
      for (int j = 2 * y; j < std::min(2 * y + 2, fine.height()); ++j) {
        for (int i = 2 * x; i < std::min(2 * x + 2, fine.width()); ++i) sum = sum_of(sum, fine.at(i, j));
      }
      out.at(x, y) = sum;
    }
  }
  return out;
}

/// Returns the colour at a place of a level, in units of its cells, linear between their centres.
Colour colour_between(const Level& level, float x, float y) {
  const float u = std::clamp(x - 0.5f, 0.0f, static_cast<float>(level.width() - 1));
  const float v = std::clamp(y - 0.5f, 0.0f, static_cast<float>(level.height() - 1));
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const int right = std::min(i + 1, level.width() - 1), below = std::min(j + 1, level.height() - 1);
  const float s = u - static_cast<float>(i), t = v - static_cast<float>(j);
  const auto mix = [](const Colour& a, const Colour& b, float by) {
    return Colour{a.red + by * (b.red - a.red), a.blue + by * (b.blue - a.blue), 1};
  };
  return mix(mix(level.at(i, j), level.at(right, j), s), mix(level.at(i, below), level.at(right, below), s), t);
}

/// Turns the sums of a level into means; cells with little weight take what they lack from the next coarser level.
void fill(Level& level, const Level* coarse) {
  for (int y = 0; y < level.height(); ++y) {
    for (int x = 0; x < level.width(); ++x) {
      Colour& cell = level.at(x, y);
      const Colour around = coarse == nullptr ? Colour{}
                                              : colour_between(*coarse, 0.5f * (static_cast<float>(x) + 0.5f),
                                                               0.5f * (static_cast<float>(y) + 0.5f));
      const float lack = std::max(enough_evidence - cell.weight, 0.0f), total = cell.weight + lack;
      cell = {(cell.red + lack * around.red) / total, (cell.blue + lack * around.blue) / total, 1};
    }
  }
}

Level colour_of_light(const RgbView<float>& rgb, const std::array<float, 3>& saturation, Executor& executor) {
  Plane<std::uint8_t> touched((rgb[0].width + cell_px - 1) / cell_px, (rgb[0].height + cell_px - 1) / cell_px);
  std::vector<Level> levels;
  levels.push_back(cells_of(rgb, saturation, touched, executor));
  keep_borders(touched, levels.front());
  while (levels.back().width() > 1 || levels.back().height() > 1) levels.push_back(coarser(levels.back()));
  const Level* coarse = nullptr;
  for (auto level = levels.rbegin(); level != levels.rend(); ++level) {
    fill(*level, coarse);
    coarse = &*level;
  }
  return std::move(levels.front());
}

std::array<float, 3> rebuilt(const std::array<float, 3>& value, const std::array<float, 3>& saturation,
                             const std::array<float, 3>& fraction, const Colour& light) {
  const std::array<float, 3> colour{std::exp(light.red), 1, std::exp(light.blue)};
  float scale = 0, weight = 0, least = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    scale += (1 - fraction[c]) * value[c] / colour[c];
    weight += 1 - fraction[c];
    least = std::max(least, saturation[c] / colour[c]);
  }
  // When the last channel saturates, its own value reaches the least light that saturates all: nothing jumps.
  const float known = std::min(weight, 1.0f);
  const float light_level = weight > 0 ? known * (scale / weight) + (1 - known) * least : least;
  std::array<float, 3> out = value;
  for (std::size_t c = 0; c < 3; ++c) {
    out[c] += fraction[c] * std::max(light_level * colour[c] - value[c], 0.0f);
  }
  return out;
}

}  // namespace

void reconstruct_highlights(const RgbView<float>& rgb, const std::array<float, 3>& saturation, Executor& executor) {
  if (rgb[0].width == 0 || rgb[0].height == 0) return;
  const Level light = colour_of_light(rgb, saturation, executor);
  for_each_band(executor, rgb[0].height, [&](const RowBand& band, int /*index*/) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < rgb[0].width; ++x) {
        const std::array<float, 3> value = pixel_of(rgb, x, y);
        std::array<float, 3> fraction{};
        float any = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          fraction[c] = saturated_fraction(value[c], saturation[c]);
          any = std::max(any, fraction[c]);
        }
        if (!(any > 0)) continue;
        const Colour colour =
            colour_between(light, (static_cast<float>(x) + 0.5f) / cell_px, (static_cast<float>(y) + 0.5f) / cell_px);
        const std::array<float, 3> out = rebuilt(value, saturation, fraction, colour);
        for (std::size_t c = 0; c < 3; ++c) rgb[c].row(y)[x] = out[c];
      }
    }
  });
}

}  // namespace lowlux::isp
