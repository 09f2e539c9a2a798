#pragma once

#include <cstdint>
#include <utility>

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

  /// Keeps the values of a frame, and which are saturated, if it has less light than all before, or as little and is
  /// the first of them whose displacement was found. @return whether it is kept
  bool add(const FrameElectrons& frame, double light, const Plane<float>& saturated, const merge::Motion& motion);
  /// States where the frame that was kept last matches the reference, as Comparison has it; empty: everywhere.
  void set_matches(Plane<std::uint8_t> block_matches) { min_matches_ = std::move(block_matches); }

  /// Fills sites without a value by those of the frame of least light. Where that frame does not match the reference,
  /// because something moved, blocks in which the reference is saturated are replaced: all of their sites then show the
  /// scene of that frame, as colours would be wrong if some were of the reference and others of another frame.
  void fill_unmatched(merge::MosaicMean& mean);

  /// Returns 1 where the frame of least light is saturated, else 0. NaN outside of it, until fill_unmatched() sets 1
  /// there where the reference is saturated.
  PlaneView<const float> saturated() const { return saturated_.view(); }

 private:
  /// Returns whether a site has no value, and the frame of least light has one.
  bool is_missing(const merge::MosaicMean& mean, int x, int y) const;
  /// Returns whether a block has missing sites at which the reference is saturated.
  bool lacks_values(const merge::MosaicMean& mean, const Rect& block) const;
  void fill_block(merge::MosaicMean& mean, const Rect& block);

  int width_, height_;
  Executor& executor_;
  Plane<float> reference_saturated_;  // 1 where it is, else 0
  Plane<float> saturated_;            // see saturated()
  Plane<float> min_e_;                // values of the frame of least light, in its own light; NaN where it has none
  Plane<std::uint8_t> min_matches_;   // blocks
  double least_light_ = 1;
  bool is_aligned_ = true;         // the displacement of that frame is known
  PerSite<double> variance_e2_{};  // variance of that frame without light
};

}  // namespace lowlux::isp
