#include "denoise/spatial/saturated_chroma.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace lowlux::denoise {
namespace {

/// Calls blend(i, before, after, fraction of after) for each i of 0..count - 1 that is a hole: with the nearest valid
/// index before and after, or twice with the only one; with none if all are holes.
template <class Hole, class Blend>
void over_holes(int count, const Hole& hole, const Blend& blend) {
  for (int i = 0; i < count; ++i) {
    if (!hole(i)) continue;
    int end = i;
    while (end < count && hole(end)) ++end;
    if (i == 0 && end == count) return;
    const int before = i > 0 ? i - 1 : end, after = end < count ? end : before;
    for (; i < end; ++i) {
      blend(i, before, after,
            before == after ? 0 : static_cast<float>(i - before) / static_cast<float>(after - before));
    }
  }
}

constexpr int widest = 1 << (max_levels - 1);  // cells of a tile, each way

/// Fill that works on tiles, each a cell of the coarsest level. In `value[0]`, plane 0 holds the fraction of valid
/// cells, the others their mean chroma, in tiles that hold saturated cells and in adjacent ones: no others are read.
struct Fill {
  const FrameMemory& memory;
  int levels;

  const PyramidLevel& coarsest() const { return memory.level[levels - 1]; }
  int side(int level) const { return 1 << (levels - 1 - level); }
  const std::uint8_t* saturated(int y) const { return memory.saturated.row(y); }
  float* value(int level, int p, int y) const { return memory.level[level].value[0].row(p, y); }

  /// Returns a row of flags: whether each tile holds saturated cells.
  float* held(int tile_y) const { return coarsest().value[1].row(0, tile_y); }

  void find(int tile_y) const {
    float* const out = held(tile_y);
    std::fill_n(out, coarsest().width, 0.0f);
    for (int y = tile_y * side(0); y < (tile_y + 1) * side(0); ++y) {
      const std::uint8_t *const row = saturated(y), *const end = row + memory.level[0].width;
      for (const std::uint8_t* at = row; at < end;) {
        at = static_cast<const std::uint8_t*>(std::memchr(at, 1, static_cast<std::size_t>(end - at)));
        if (at == nullptr) break;
        const auto tile_x = (at - row) / side(0);
        out[tile_x] = 1;
        at = row + (tile_x + 1) * side(0);
      }
    }
  }

  bool any() const {
    for (int y = 0; y < coarsest().height; ++y) {
      const float* const row = held(y);
      if (std::find(row, row + coarsest().width, 1.0f) != row + coarsest().width) return true;
    }
    return false;
  }

  bool near(int tile_x, int tile_y) const {
    bool out = false;
    for (int y = std::max(tile_y - 1, 0); y <= std::min(tile_y + 1, coarsest().height - 1); ++y) {
      for (int x = std::max(tile_x - 1, 0); x <= std::min(tile_x + 1, coarsest().width - 1); ++x) {
        out = out || held(y)[x] != 0;
      }
    }
    return out;
  }

  /// Calls work(first x, last x + 1, y) for the rows of a tile on a level.
  template <class Work>
  void for_rows(int level, int tile_x, int tile_y, const Work& work) const {
    const int n = side(level);
    for (int y = tile_y * n; y < (tile_y + 1) * n; ++y) work(tile_x * n, (tile_x + 1) * n, y);
  }

  void take(int first, int last, int y) const {
    const std::uint8_t* const unseen = saturated(y);
    float* const share = value(0, 0, y);
    for (int x = first; x < last; ++x) share[x] = unseen[x] != 0 ? 0.0f : 1.0f;
    for (int p = 1; p < 4; ++p)
      std::copy_n(memory.level[0].noisy.row(p, y) + first, last - first, value(0, p, y) + first);
  }

  void pull(int level, int first, int last, int y) const {
    const float *const upper_fraction = value(level - 1, 0, 2 * y), *const lower_fraction =
                                                                        value(level - 1, 0, 2 * y + 1);
    float* const share = value(level, 0, y);
    for (int x = first; x < last; ++x) {
      share[x] = 0.25f * (upper_fraction[2 * x] + upper_fraction[2 * x + 1] + lower_fraction[2 * x] +
                          lower_fraction[2 * x + 1]);
    }
    for (int p = 1; p < 4; ++p) {
      const float *const upper = value(level - 1, p, 2 * y), *const lower = value(level - 1, p, 2 * y + 1);
      float* const out = value(level, p, y);
      for (int x = first; x < last; ++x) {
        const float sum = upper_fraction[2 * x] * upper[2 * x] + upper_fraction[2 * x + 1] * upper[2 * x + 1] +
                          lower_fraction[2 * x] * lower[2 * x] + lower_fraction[2 * x + 1] * lower[2 * x + 1];
        out[x] = share[x] > 0 ? 0.25f * sum / share[x] : 0.0f;
      }
    }
  }

  bool hole(int tile_x, int tile_y) const {
    return held(tile_y)[tile_x] != 0 && value(levels - 1, 0, tile_y)[tile_x] == 0;
  }

  void fill_coarsest() const {
    const int width = coarsest().width, height = coarsest().height;
    const auto blend = [&](int x, int y, int x0, int y0, int x1, int y1, float share) {
      for (int p = 1; p < 4; ++p) {
        value(levels - 1, p, y)[x] = (1 - share) * value(levels - 1, p, y0)[x0] + share * value(levels - 1, p, y1)[x1];
      }
    };
    const auto empty = [&](int y) {
      bool out = true;
      for (int x = 0; x < width && out; ++x) out = hole(x, y);
      return out;
    };
    for (int y = 0; y < height; ++y) {
      if (empty(y)) {
        for (int p = 1; p < 4; ++p) std::fill_n(value(levels - 1, p, y), width, 0.0f);
      }
      over_holes(
          width, [&](int x) { return hole(x, y); },
          [&](int x, int before, int after, float share) { blend(x, y, before, y, after, y, share); });
    }
    over_holes(height, empty, [&](int y, int before, int after, float share) {
      for (int x = 0; x < width; ++x) blend(x, y, x, before, x, after, share);
    });
  }

  void push(int level, int first, int last, int y) const {
    const PyramidLevel& coarse = memory.level[level + 1];
    const int near_y = y / 2, far_y = std::clamp(near_y + 2 * (y % 2) - 1, 0, coarse.height - 1);
    const float* const share = value(level, 0, y);
    for (int p = 1; p < 4; ++p) {
      const float *const upper = value(level + 1, p, near_y), *const lower = value(level + 1, p, far_y);
      float* const out = value(level, p, y);
      std::array<float, widest / 2 + 2> between{};  // coarser cells, with one before and one after the tile
      const int before = first / 2 - 1, count = (last - first) / 2;
      for (int i = 0; i < count + 2; ++i) {
        const int x = std::clamp(before + i, 0, coarse.width - 1);
        between[i] = 0.75f * upper[x] + 0.25f * lower[x];
      }
      for (int i = 0; i < count; ++i) {
        const int x = first + 2 * i;
        const float even = 0.75f * between[i + 1] + 0.25f * between[i];
        const float odd = 0.75f * between[i + 1] + 0.25f * between[i + 2];
        out[x] = share[x] > 0 ? out[x] : even;
        out[x + 1] = share[x + 1] > 0 ? out[x + 1] : odd;
      }
    }
  }

  void give(int first, int last, int y) const {
    const float* const share = value(0, 0, y);
    for (int p = 1; p < 4; ++p) {
      const float* const from = value(0, p, y);
      float* const to = memory.level[0].noisy.row(p, y);
      for (int x = first; x < last; ++x) to[x] = share[x] > 0 ? to[x] : from[x];
    }
  }
};

}  // namespace

void fill_saturated_chroma(const FrameMemory& memory, int levels, const Workers& workers) {
  const Fill fill{memory, levels};
  const auto for_tiles = [&](const auto& wanted, const auto& work) {
    in_bands(workers, fill.coarsest().height, [&](int first, int last, int) {
      for (int y = first; y < last; ++y) {
        for (int x = 0; x < fill.coarsest().width; ++x) {
          if (wanted(x, y)) work(x, y);
        }
      }
    });
  };
  in_bands(workers, fill.coarsest().height, [&](int first, int last, int) {
    for (int y = first; y < last; ++y) fill.find(y);
  });
  if (!fill.any()) return;
  const auto near = [&](int x, int y) { return fill.near(x, y); };
  const auto held = [&](int x, int y) { return fill.held(y)[x] != 0; };
  for_tiles(near, [&](int tile_x, int tile_y) {
    fill.for_rows(0, tile_x, tile_y, [&](int first, int last, int y) { fill.take(first, last, y); });
    for (int l = 1; l < levels; ++l) {
      fill.for_rows(l, tile_x, tile_y, [&](int first, int last, int y) { fill.pull(l, first, last, y); });
    }
  });
  fill.fill_coarsest();
  for (int l = levels - 2; l >= 0; --l) {
    for_tiles(held, [&](int tile_x, int tile_y) {
      fill.for_rows(l, tile_x, tile_y, [&](int first, int last, int y) { fill.push(l, first, last, y); });
    });
  }
  for_tiles(held, [&](int tile_x, int tile_y) {
    fill.for_rows(0, tile_x, tile_y, [&](int first, int last, int y) { fill.give(first, last, y); });
  });
}

}  // namespace lowlux::denoise
