#include "isp/pipeline/render/frame_tiles.h"

#include <algorithm>
#include <cassert>

namespace lowlux::isp {
namespace {

int rounded_up(int value, int unit) { return (value + unit - 1) / unit * unit; }

/// Holds the first and last pixel, the latter excluded, that a padded tile covers along one direction.
struct Span {
  int first;
  int last;
};

Span grown(const Span& core, const TileMargin& margin, int size) {
  return {std::max(core.first - margin.px, 0) / margin.lattice * margin.lattice,
          std::min(rounded_up(core.last + margin.px, 2), size)};
}

}  // namespace

TileGrid::Axis TileGrid::axis(int start, int length, int side) {
  assert(length > 0 && start >= 0 && side >= tile_lattice_px && side % tile_lattice_px == 0);
  const int first = start / tile_lattice_px * tile_lattice_px, span = start + length - first;
  const int fewest = (span + side - 1) / side;
  const int core = rounded_up((span + fewest - 1) / fewest, tile_lattice_px);  // none is much smaller than the others
  return {start, length, first, core, (span + core - 1) / core};
}

TileGrid::TileGrid(const Rect& crop, int side)
    : x_(axis(crop.x, crop.width, side)), y_(axis(crop.y, crop.height, side)) {}

int TileGrid::Axis::edge(int i) const {
  if (i == 0) return start;
  if (i == count) return start + length;
  const int line = first + i * core;
  return line + ((line - start) & 1);  // even in the image: a cell of half size stays in one tile
}

Rect TileGrid::core(int i) const {
  const int column = i % x_.count, row = i / x_.count;
  const int x = x_.edge(column), y = y_.edge(row);
  return {x, y, x_.edge(column + 1) - x, y_.edge(row + 1) - y};
}

Rect with_margin(const Rect& core, const TileMargin& margin, int width, int height) {
  const Span x = grown({core.x, core.x + core.width}, margin, width);
  const Span y = grown({core.y, core.y + core.height}, margin, height);
  return {x.first, y.first, x.last - x.first, y.last - y.first};
}

Rect overlap(const Rect& a, const Rect& b) {
  const int x = std::max(a.x, b.x), y = std::max(a.y, b.y);
  return {x, y, std::max(std::min(a.x + a.width, b.x + b.width) - x, 0),
          std::max(std::min(a.y + a.height, b.y + b.height) - y, 0)};
}

}  // namespace lowlux::isp
