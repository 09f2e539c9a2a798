#pragma once

#include <vector>

#include "isp/merge/align/global_motion.h"
#include "isp/merge/align/tiles.h"

namespace lowlux::merge {

/// Departures of tiles from the global motion, in pixels, and the variance of each.
struct LocalMotion {
  Motion departure;           // nodes of a grid
  Plane<float> variance_px2;  // variance of a departure along one axis; 0 where there is none
  bool any = false;
};

/// Returns no departure, for the tiles of a grid.
LocalMotion no_departure(const TileGrid& grid);

/// Returns the departures at the nodes of another grid of the same frame.
LocalMotion resampled(const LocalMotion& local, const TileGrid& grid);

/// Makes the scores of tiles that were measured with departures those of the global motion alone.
void refer_to_global(const LocalMotion& local, const TileGrid& grid, std::vector<TileFit>& fits);

/// Finds the departures of tiles: a test from large blocks of tiles to single ones. Each block starts from the
/// departure of the block that it is a quarter of. Its own score against that has a chi-square of 2 degrees of freedom;
/// if noise exceeds it with a probability of less than 1 % in any block of the frame, the block departs by the estimate
/// of estimate() with a normal prior of one cell; else it stays. Within a block, tiles that contradict its departure
/// lose their influence, so that a moving object does not displace its surroundings.
/// @param fits  fits of the tiles, referred to the global motion
/// @param step  step of the global motion, to be added to the one that the tiles were measured with
LocalMotion find_departures(const GlobalMotion& motion, const MotionStep& step, const TileGrid& grid,
                            const std::vector<TileFit>& fits);

}  // namespace lowlux::merge
