#pragma once

#include <vector>

#include "isp/base/executor.h"
#include "isp/merge/align/luma_pyramid.h"
#include "isp/merge/frame.h"
#include "isp/merge/motion.h"

namespace lowlux::merge {

/// Holds what find_motion needs of a reference frame.
class AlignReference {
 public:
  AlignReference(const FrameView& reference, Executor& executor);

  int width() const { return width_; }
  int height() const { return height_; }
  const LumaPyramid& pyramid() const { return pyramid_; }

 private:
  int width_;
  int height_;
  LumaPyramid pyramid_;
};

/// Limits of the motion that is searched for.
struct AlignOptions {
  int max_shift_px = 128;       // largest displacement of the centre of the frame, along each axis
  double max_rotation_deg = 5;  // either way
  int spacing_px = 32;          // spacing of the nodes: 16, or a multiple
};

/// Returns the displacement of `frame` against the reference; both have the same size and phase. See
/// isp/merge/README.md for the method. Motion::found is false, and the motion 0, if the frames do not share a structure
/// that noise does not explain, or are too small (fewer than 16 pixels in width or height).
/// @param light  expected signal of the frame / that of the reference, > 0: the ratio of their exposures
Motion find_motion(const AlignReference& reference, const FrameView& frame, double light, const AlignOptions& options,
                   Executor& executor);

}  // namespace lowlux::merge
