#pragma once

#include <cstdint>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/merge/block_test.h"

namespace lowlux::merge {

/// Finds which blocks of the reference show what stands still, such as a landscape, while the rest of the scene moves,
/// such as the stars above it.
///
/// For each site, with r, a and u the values of the reference, of a frame brought to the place of the reference by the
/// motion, and of the frame as it is,
///     t = ((a - r)^2 - (u - r)^2) / V,   V: the variance of either difference,
/// has mean 0 and variance 3 where neither differs from the reference. A square of 16 x 16 sites stands still if the
/// median over frames of the sum of t exceeds 5 of its standard deviations, and moves if it is below -5 of them. Where
/// it is between, the squares around it decide that are 2, 4, 8 ... times as wide, the first to exceed the limit; where
/// none does, nothing can be seen, and the square moves with the scene. In these, r, a and u are without the means of
/// their squares of 16 x 16 and sites of the CFA cell: gradients of the sky and vignetting stand still too.
class StillBlocks {
 public:
  StillBlocks(int width, int height);

  /// Adds a frame. All are as large as the reference, in its light; NaN where there is no value.
  /// @param noise  noise of each of the three frames
  void add(PlaneView<const float> reference, PlaneView<const float> aligned, PlaneView<const float> unmoved,
           const MosaicNoise& noise, Executor& executor);

  /// Returns ceil(height / 8) x ceil(width / 8) blocks as compare_mosaics has them: 1 where they stand still, else 0.
  /// All are 0 if no frame was added.
  Plane<std::uint8_t> blocks() const;

 private:
  static constexpr int side_px = 2 * block_px;  // side of the squares that are compared

  struct Sums {
    std::vector<float> with_mean;  // sum of t of each frame; only for the smallest squares
    std::vector<float> t;          // the same, of values without their means
    float sites = 0;               // mean over frames
  };

  static std::vector<Sums> halved(const std::vector<Sums>& of, int columns, int rows);
  void decide(const std::vector<Sums>& level, int scale, Plane<std::uint8_t>& decided) const;

  int width_, height_;
  int columns_, rows_;  // of squares
  int frames_ = 0;
  std::vector<Sums> squares_;
};

}  // namespace lowlux::merge
