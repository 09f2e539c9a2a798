#pragma once

#include <functional>
#include <vector>

#include "isp/base/plane.h"

namespace lowlux::reference {

/// Computes what denoise::FrameMotion does, one cell at a time.
class FrameMotion {
 public:
  struct Displacement {
    int x = 0, y = 0;
    bool operator==(const Displacement&) const = default;
  };

  void forget() { of_tile_ = {}; }
  /// @param frame_e, mean_e  signal at a site
  /// @param offset_e2  variance of a cell's sum without light
  /// @param share  of each block, before; replaced by that of the displaced mean
  void find(int width, int height, const std::function<double(int, int)>& frame_e,
            const std::function<double(int, int)>& mean_e, double offset_e2, Plane<double>& share);
  /// Returns the displacement of a block [sites].
  Displacement at(int x, int y) const { return {2 * of_block_.at(x, y).x, 2 * of_block_.at(x, y).y}; }
  bool found() const { return found_; }

 private:
  struct Cells {
    int width = 0, height = 0;
    Plane<double> frame, mean;
    double cost(int left, int top, int columns, int rows, Displacement by, int step) const;
  };
  struct Slopes {
    bool known = false;
    double xx = 0, xy = 0, yy = 0, xd = 0, yd = 0;
  };
  static Displacement of_frame(const Cells& fine, const Cells& coarse);
  Displacement of_tile(const Cells& fine, int x, int y, Displacement of_frame, double share) const;
  Displacement of_block(const Cells& fine, int x, int y, double share) const;
  static Slopes slopes_of(const Cells& fine, int x, int y, Displacement by);

  Plane<Displacement> of_tile_, of_block_;
  bool found_ = false;
};

}  // namespace lowlux::reference
