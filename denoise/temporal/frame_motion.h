#pragma once

#include <cstdint>
#include <vector>

#include "denoise/denoise_options.h"
#include "denoise/spatial/bands.h"
#include "denoise/temporal/motion_rows.h"
#include "denoise/temporal/temporal_rows.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"

namespace lowlux::denoise {

/// Finds where the content of a frame lies in the mean of the previous frames: a displacement by whole 2x2 cells for
/// each block of 8 x 8 sites, and how wrong the displaced mean still is. denoise/README.md has the method. Allocates
/// only in the constructor; the results are the same for every number of threads and every instruction set.
class FrameMotion {
 public:
  static constexpr int min_side = 64;                // smallest side of frames, in sites; smaller ones are not searched
  static constexpr float no_content = 1e6f;          // relative variance of a block that no previous frame shows
  static constexpr int tile = 2 * rows::tile_cells;  // sites of a side

  /// Sites along each axis, even.
  struct Displacement {
    int x = 0;
    int y = 0;
    bool operator==(const Displacement&) const = default;
  };

  /// Allocates for mosaics of up to max_width x max_height pixels: 1.5 bytes for each pixel.
  FrameMotion(int max_width, int max_height);

  /// Forgets the displacements of the last frame, which are tried again in the next one.
  void forget();

  /// The mean of the previous frames, and for each block its variance over that of a raw value.
  struct Before {
    PlaneView<const float> mean_e;  // without dark charge, in the light of the frame; as large as the frame or larger
    PlaneView<const float> share;
  };
  /// Compares a frame of at least min_side each way with what was before.
  /// @param share  for each block: variance of the displaced mean over that of a raw value, errors of the displacement
  /// included; no_content where the block lies partly outside
  void find(const RawElectronsView& raw, const rows::SiteNoise& noise, const Before& before, PlaneView<float> share,
            const Workers& workers);

  /// Returns where the content of a block lies in the mean, relative to its own place.
  Displacement at(int block_x, int block_y) const {
    const Displacement cells = of_block_.at(block_x, block_y);
    return {2 * cells.x, 2 * cells.y};
  }
  /// Returns whether a part of the last frame was displaced, by whole cells or by less.
  bool found() const { return found_; }

 private:
  class Search;
  /// Part of the displacement of a tile that is not whole cells.
  struct Residual {
    double x_cells = 0;
    double y_cells = 0;
  };

  Plane<std::int16_t> frame_, mean_;                // stabilised cells
  Plane<std::int16_t> coarse_frame_, coarse_mean_;  // means of 4 x 4 cells, scaled to the noise of one cell
  Plane<Displacement> of_tile_, of_tile_before_;    // in cells, as below
  Plane<Displacement> of_block_;
  Plane<rows::BlockSlopes> slopes_;
  Plane<Residual> residual_;
  std::vector<double> cost_;      // cost of each displacement of the whole frame
  std::vector<double> mismatch_;  // sum of the relative variance added to the blocks, for each row of tiles
  bool found_ = false;
};

}  // namespace lowlux::denoise
