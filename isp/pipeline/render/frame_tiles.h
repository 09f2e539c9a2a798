#pragma once

#include <cstdint>

#include "denoise/denoise_options.h"
#include "isp/base/frame.h"

/// Large frames are processed in tiles, so that their memory stays bounded. All rectangles are relative to the corner
/// of the active area.
namespace lowlux::isp {

/// Corners of tiles whose noise is reduced lie on multiples of this: there the denoiser's blocks, on all its levels,
/// and the tiles that it chooses the start of chroma for lie as they do in the whole frame.
inline constexpr int tile_lattice_px = 256;

/// A padded tile reaches this far beyond its core; with Level::best, whose choice of patches carries small differences
/// on, best_margin_px. The difference from the whole frame is then at most 3 % of the noise of a raw value on real
/// images: README.md has the figures, `measure tile-margin` prints them.
inline constexpr int tile_margin_px = 256, best_margin_px = 384;

/// States which frames are processed in tiles, and in what tiles.
struct TileLimits {
  std::int64_t max_whole_px = 25'000'000;  // pixels of the active area; larger ones are split into tiles
  int side_px = 2048;                      // maximum side of a core; a multiple of tile_lattice_px
};

/// Lists the cores that an image is split into, row by row. Each starts at an even column and row of the image, and at
/// most one pixel behind the lattice.
class TileGrid {
 public:
  /// @param crop  region of the active area that makes the image, not empty
  /// @param side  maximum side of a core; a multiple of tile_lattice_px
  TileGrid(const Rect& crop, int side);

  int count() const { return x_.count * y_.count; }
  /// Returns core i of count(); it may be empty.
  Rect core(int i) const;

 private:
  /// Describes one direction: where it starts, its length, the length of a core, and the number of cores.
  struct Axis {
    int start, length, first, core, count;
    int edge(int i) const;
  };
  static Axis axis(int start, int length, int side);

  Axis x_;
  Axis y_;
};

/// Describes the margin that with_margin adds around `core` in a frame of width x height: `px`, or as much as there is;
/// to the left and above up to the next multiple of `lattice`, an even number, to the right and below up to an even
/// column and row.
struct TileMargin {
  int px = tile_margin_px;
  int lattice = tile_lattice_px;
};
constexpr TileMargin margin_of(denoise::Level level) {
  return {.px = level == denoise::Level::best ? best_margin_px : tile_margin_px};
}
Rect with_margin(const Rect& core, const TileMargin& margin, int width, int height);

/// Returns the area that both rectangles cover; empty, with a width or height of 0, where there is none.
Rect overlap(const Rect& a, const Rect& b);

}  // namespace lowlux::isp
