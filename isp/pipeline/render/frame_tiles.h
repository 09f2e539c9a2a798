#pragma once

#include <cstdint>

#include "isp/base/frame.h"

/// Large frames are worked on piece by piece, so that their memory stays bounded. All rectangles count from the corner
/// of the active area.
namespace lowlux::isp {

/// Corners of pieces whose noise is reduced lie on multiples of this: there the denoiser's blocks, on all its levels,
/// and the tiles it chooses chroma's start for lie as they do in the whole frame.
inline constexpr int tile_lattice_px = 256;

/// What a piece reaches beyond its core. What differs from the whole frame then is at most 3 % of the noise of a raw
/// value on real pictures: README.md has the figures, tests/bench/tile_margin_bench.cpp prints them.
inline constexpr int tile_margin_px = 256;

/// Which frames go piece by piece, and in what pieces.
struct TileLimits {
  std::int64_t most_whole_px = 25'000'000;  // of the active area; larger ones are cut up
  int side_px = 2048;                       // of a core, at most; a multiple of tile_lattice_px
};

/// The cores a picture is cut into, row by row. Each starts at an even column and row of the picture, and at most one
/// pixel behind the lattice.
class TileGrid {
 public:
  /// @param crop  the part of the active area that makes the picture, not empty
  /// @param side  of a core, at most; a multiple of tile_lattice_px
  TileGrid(const Rect& crop, int side);

  int count() const { return x_.count * y_.count; }
  /// Core i of count(); it may be empty.
  Rect core(int i) const;

 private:
  /// One direction: where it starts, its length, that of a core, and how many there are.
  struct Axis {
    int start, length, first, core, count;
    int edge(int i) const;
  };
  static Axis axis(int start, int length, int side);

  Axis x_;
  Axis y_;
};

/// `core` and what is around it in a frame of width x height, `margin` or as much as there is; to the left and above up
/// to the next multiple of `lattice`, an even number, to the right and below up to an even column and row.
struct TileMargin {
  int px = tile_margin_px;
  int lattice = tile_lattice_px;
};
Rect with_margin(const Rect& core, const TileMargin& margin, int width, int height);

/// Of what both hold; empty, with a width or height of 0, where there is nothing.
Rect overlap(const Rect& a, const Rect& b);

}  // namespace lowlux::isp
