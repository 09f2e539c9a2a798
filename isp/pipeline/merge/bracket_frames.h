#pragma once

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/merge/frame.h"
#include "isp/merge/mosaic_mean.h"
#include "isp/merge/motion.h"
#include "isp/pipeline/merge/frame_electrons.h"

namespace lowlux::isp {

/// Holds additional data for merging frames of different exposure: weights, ratios of light, saturation.
class BracketFrames {
 public:
  BracketFrames(int width, int height, Executor& executor);

  /// Sets saturated sites of a frame to NaN. @return 1 where a site is saturated, else 0
  Plane<float> remove_saturated(FrameElectrons& frame) const;
  /// Does the same for the reference, and keeps it as the frame of least light.
  void begin(FrameElectrons& reference);

  /// Returns the inverse variance of the frame's values, at the sites of the reference.
  Plane<float> placed_weights(const FrameElectrons& frame, double light, const merge::Motion& motion) const;

  /// Returns the measured ratio of light of a frame to the reference, or the stated one where it cannot be measured or
  /// does not differ.
  double measured_light(const merge::FrameView& reference, const FrameElectrons& frame, const merge::Motion& motion,
                        double stated) const;

  /// Keeps the values of a frame, and which are saturated, if it has less light than all before.
  void add(const FrameElectrons& frame, double light, const Plane<float>& saturated, const merge::Motion& motion);

  /// Replaces blocks that lack values by those of the frame of least light: the reference is saturated there, and the
  /// others do not match it, because something moved. All sites of a block then show the scene of one frame: colours
  /// would be wrong if some were of the reference, and others of another frame.
  void fill_unmatched(merge::MosaicMean& mean) const;

  /// Returns 1 where the frame of least light is saturated, or where it has no site and the reference is; else 0.
  PlaneView<const float> saturated() const { return saturated_.view(); }

 private:
  /// Returns whether a block has sites without a value at which the frame of least light has one.
  bool lacks_values(const merge::MosaicMean& mean, int left, int top) const;

  int width_, height_;
  Executor& executor_;
  Plane<float> saturated_;
  Plane<float> least_e_;  // values of the frame of least light, in its own light; NaN where it has none
  double least_light_ = 1;
  PerSite<double> variance_e2_{};  // of that frame without light
};

}  // namespace lowlux::isp
