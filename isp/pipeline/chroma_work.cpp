#include "isp/pipeline/chroma_work.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "denoise/chroma_start.h"
#include "denoise/layout.h"

namespace lowlux::isp {
namespace {

constexpr std::array share_of_sites{0.25, 0.5, 0.25};

double mean_of(const std::array<double, 3>& of_colour) {
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) sum += share_of_sites[c] * of_colour[c];
  return sum;
}

struct Tile {
  double charge_e = 0;  // sum over blocks
  int blocks = 0;
};

/// The denoiser's, from left to right, from above.
struct Tiles {
  int columns = 0;
  int rows = 0;
  int levels = 0;
  std::vector<Tile> all;
};

int tile_of_block(int block, int blocks, int cells, int tiles) {
  return denoise::tile_of(static_cast<int>((block + 0.5) / blocks * cells), tiles);
}

/// Each block counts where its middle lies.
Tiles tiles_of(const Rect& active, const CameraRgb& mean, const std::array<double, 3>& electrons_at_white) {
  const int across = (active.width + 1) / 2, down = (active.height + 1) / 2;
  Tiles out{denoise::tiles_of(across), denoise::tiles_of(down), denoise::levels_of(across, down), {}};
  out.all.resize(static_cast<std::size_t>(out.columns) * static_cast<std::size_t>(out.rows));
  for (int y = 0; y < mean.height(); ++y) {
    const int row = tile_of_block(y, mean.height(), down, out.rows);
    for (int x = 0; x < mean.width(); ++x) {
      const int column = tile_of_block(x, mean.width(), across, out.columns);
      Tile& tile = out.all[static_cast<std::size_t>(row * out.columns + column)];
      for (std::size_t c = 0; c < 3; ++c) {
        const auto value = static_cast<double>(mean.plane[c].at(x, y));
        if (std::isfinite(value)) tile.charge_e += share_of_sites[c] * electrons_at_white[c] * value;
      }
      ++tile.blocks;
    }
  }
  return out;
}

}  // namespace

ChromaWork chroma_work(const RawFrame& frame, const DevelopPlan& plan, const denoise::RawNoise& noise,
                       const Thumbnail& thumbnail) {
  std::array<double, 3> electrons_at_white{};
  for (int site = 0; site < 4; ++site) {
    electrons_at_white[static_cast<std::size_t>(colour_at(frame.raw.phase, site & 1, site >> 1))] =
        (*plan.electrons_at_white)[site];
  }
  double dark_e = 0;
  for (const double d : noise.dark_mean_e) dark_e += d / 4;
  const Tiles tiles = tiles_of(frame.raw.active, thumbnail.mean, electrons_at_white);
  const std::size_t count = tiles.all.size();
  std::vector<float> start(count);
  std::vector<unsigned char> has_chroma(count * denoise::most_levels);
  for (std::size_t i = 0; i < count; ++i) {
    // A tile smaller than a block has none of its own: it is taken for dark.
    const double mean_e = tiles.all[i].charge_e / std::max(tiles.all[i].blocks, 1);
    const int level = denoise::start_of(mean_e - dark_e, dark_e, mean_of(noise.variance_e2));
    start[i] = static_cast<float>(std::min(level, tiles.levels - 1));
  }
  denoise::ChromaStarts starts{start, has_chroma, tiles.columns, tiles.rows};
  denoise::complete(starts);
  ChromaWork out{{}, {}};
  for (std::size_t i = 0; i < count; ++i) {
    const double share = 1.0 / static_cast<double>(count);
    out.start[static_cast<std::size_t>(start[i])] += share;
    out.work[has_chroma[i] != 0 ? 0 : has_chroma[count + i] != 0 ? 1 : 2] += share;
  }
  return out;
}

}  // namespace lowlux::isp
