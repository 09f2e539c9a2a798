#pragma once

#include <cstddef>

#include "isp/base/executor.h"
#include "isp/raw/kernel/demosaic.h"
#include "isp/raw/kernel/raw_to_rgb_rows.h"
#include "isp/raw/kernel/rgb_input.h"

namespace lowlux::isp {

/// Returns the number of floats of scratch memory that a ResidualBand needs for mosaics up to `width` pixels wide.
std::size_t residual_floats(int width);

/// Interpolates a band of rows of a mosaic by DemosaicMethod::residual or residual_median. A row of the result depends
/// on 12 rows and columns to each side, mirrored at the borders of the mosaic without repeating the edge.
///
/// The columns are split into blocks whose intermediate rows stay in the second-level cache; a few rows at a time are
/// made of all blocks. Neither blocks nor bands change a bit of the result.
template <class Mosaic>
class ResidualBand {
 public:
  /// @param clip    values are limited to it before interpolation
  /// @param memory  residual_floats(width of the mosaic), on a cache line
  ResidualBand(const Mosaic& in, const Demosaic& how, float clip, RowBand band, float* memory);

  /// Makes the next rows and returns the end of those that row() gives: from the previous end on.
  int advance();

  /// Returns linear R, G and B of row y. Precondition: the last advance() made it.
  rows::PlaneRows row(int y) const;

 private:
  struct Block;
  void add_row(const Block& block, int y) const;
  void read_row(const Block& block, int y) const;
  void add_green(const Block& block, int y) const;
  void add_differences(const Block& block, int y) const;
  void finish_row(const Block& block, int y) const;
  bool own_is_odd(int y) const;
  int shift(int y) const { return own_is_odd(y) ? 1 : 0; }
  rows::SplitRow made(int y, int colour) const;

  Mosaic in_;
  float clip_;
  RowBand band_;
  rows::Encoding encoding_;
  float ridge_;
  float floor_;         // smallest sum of gradients
  float detail_floor_;  // smallest squared detail
  bool median_;
  float* blocks_;
  float* made_;
  int next_;  // the next row of the mosaic, virtual ones beyond its borders included
};

}  // namespace lowlux::isp
