#pragma once

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/merge/frame.h"
#include "isp/merge/motion.h"
#include "isp/pipeline/merge/frame_electrons.h"

namespace lowlux::isp {

/// Holds additional data for merging frames of different exposure: weights, ratios of light, saturation.
class BracketFrames {
 public:
  BracketFrames(int width, int height, Executor& executor);

  /// Sets saturated sites of a frame to NaN. @return 1 where a site is saturated, else 0
  Plane<float> remove_saturated(FrameElectrons& frame) const;
  /// Does the same for the reference, and remembers it as the frame of least light.
  void begin(FrameElectrons& reference);

  /// Returns the inverse variance of the frame's values, at the sites of the reference.
  Plane<float> placed_weights(const FrameElectrons& frame, double light, const merge::Motion& motion) const;

  /// Returns the measured ratio of light of a frame to the reference, or the stated one where it cannot be measured or
  /// does not differ.
  double measured_light(const merge::FrameView& reference, const FrameElectrons& frame, const merge::Motion& motion,
                        double stated) const;

  /// Remembers which sites are saturated if this frame has less light than all before.
  void add(const FrameElectrons& frame, double light, const Plane<float>& saturated, const merge::Motion& motion);

  /// Returns 1 where the frame of least light is saturated, else 0; NaN outside of it.
  PlaneView<const float> saturated() const { return saturated_.view(); }

 private:
  int width_, height_;
  Executor& executor_;
  Plane<float> saturated_;
  double least_light_ = 1;
};

}  // namespace lowlux::isp
