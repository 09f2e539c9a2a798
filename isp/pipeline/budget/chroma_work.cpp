#include "isp/pipeline/budget/chroma_work.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "denoise/spatial/chroma_start.h"
#include "denoise/spatial/layout.h"
#include "isp/base/cfa.h"
#include "isp/pipeline/render/cell_figures.h"

namespace lowlux::isp {
namespace {

struct Tile {
  double charge_e = 0;  // sum over blocks
  int blocks = 0;
  double share = 0;  // fraction of the frame
};

/// Describes one direction: the denoiser's tiles along cells, of which the last is the larger.
struct Axis {
  int cells;
  int tiles;
  int blocks;  // number of blocks of the thumbnail

  int tile_of_block(int block) const {
    return denoise::tile_of(static_cast<int>((block + 0.5) / blocks * cells), tiles);
  }
  int block_in(int tile) const {
    return std::min(static_cast<int>((tile + 0.5) * denoise::tile / cells * blocks), blocks - 1);
  }
  int cells_of(int tile) const { return tile + 1 < tiles ? denoise::tile : cells - (tiles - 1) * denoise::tile; }
  double share_of(int tile) const { return static_cast<double>(cells_of(tile)) / cells; }
};

Axis axis_of(int cells, int blocks) { return {cells, denoise::tiles_of(cells), blocks}; }

/// Returns the denoiser's tiles, from left to right and from top to bottom. A block counts in the tile that holds its
/// centre; a tile without any centre, because it is smaller than a block, takes the block around it.
std::vector<Tile> tiles_of(const Axis& across, const Axis& down, const CameraRgb& mean,
                           const std::array<double, 3>& electrons_at_white) {
  const auto charge_e = [&](int x, int y) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto value = static_cast<double>(mean.plane[c].at(x, y));
      if (std::isfinite(value)) sum += fraction_of_sites[c] * electrons_at_white[c] * value;
    }
    return sum;
  };
  const auto index = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(across.tiles) + static_cast<std::size_t>(x);
  };
  std::vector<Tile> out(static_cast<std::size_t>(across.tiles) * static_cast<std::size_t>(down.tiles));
  for (int y = 0; y < down.blocks; ++y) {
    for (int x = 0; x < across.blocks; ++x) {
      Tile& tile = out[index(across.tile_of_block(x), down.tile_of_block(y))];
      tile.charge_e += charge_e(x, y);
      ++tile.blocks;
    }
  }
  for (int y = 0; y < down.tiles; ++y) {
    for (int x = 0; x < across.tiles; ++x) {
      Tile& tile = out[index(x, y)];
      tile.share = across.share_of(x) * down.share_of(y);
      if (tile.blocks == 0) tile = {charge_e(across.block_in(x), down.block_in(y)), 1, tile.share};
    }
  }
  return out;
}

/// @param side  side of a cell [px]
double ratio_of_tile(const RawFrame& frame, const Axis& across, const Axis& down, int side, int index) {
  const int x = index % across.tiles, y = index / across.tiles;
  return view_of(frame.noise_ratio.get())
      .mean(side * denoise::tile * x, side * denoise::tile * y, side * across.cells_of(x), side * down.cells_of(y));
}

/// @param side  side of a cell [px]
ChromaWork work_of_cells(const RawFrame& frame, const CellNoise& cell, int side, const Thumbnail& thumbnail) {
  const denoise::RawNoise& noise = cell.noise;
  const double dark_e = mean_of_sites(noise.dark_mean_e), variance_e2 = mean_of_colours(noise.variance_e2);
  const Rect& active = frame.raw.active;
  const Axis across = axis_of((active.width + side - 1) / side, thumbnail.mean.width());
  const Axis down = axis_of((active.height + side - 1) / side, thumbnail.mean.height());
  const std::vector<Tile> tiles = tiles_of(across, down, thumbnail.mean, cell.cell_e);
  const int pyramid_levels = denoise::levels_of(across.cells, down.cells);
  const std::size_t count = tiles.size();
  std::vector<float> start(count);
  std::vector<unsigned char> has_chroma(count * denoise::max_levels);
  for (std::size_t i = 0; i < count; ++i) {
    const double mean_e = tiles[i].charge_e / tiles[i].blocks;
    const double ratio = ratio_of_tile(frame, across, down, side, static_cast<int>(i));
    const int level = denoise::start_of(mean_e - dark_e, dark_e, variance_e2, ratio);
    start[i] = static_cast<float>(std::min(level, pyramid_levels - 1));
  }
  denoise::ChromaStarts starts{start, has_chroma, across.tiles, down.tiles};
  denoise::complete(starts);
  ChromaWork out{{}, {}};
  for (std::size_t i = 0; i < count; ++i) {
    out.start[static_cast<std::size_t>(start[i])] += tiles[i].share;
    out.work[has_chroma[i] != 0 ? 0 : has_chroma[count + i] != 0 ? 1 : 2] += tiles[i].share;
  }
  return out;
}

}  // namespace

ChromaWork chroma_work(const RawFrame& frame, const RawLevels& levels, const denoise::RawNoise& noise,
                       const Thumbnail& thumbnail) {
  return work_of_cells(frame, {electrons_by_colour(frame.raw, levels), noise}, 2, thumbnail);
}

ChromaWork chroma_work(const RawFrame& frame, const CellNoise& cell, const Thumbnail& thumbnail) {
  return work_of_cells(frame, cell, 1, thumbnail);
}

}  // namespace lowlux::isp
