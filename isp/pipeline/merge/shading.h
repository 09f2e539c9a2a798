#pragma once

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/merge/motion.h"
#include "isp/pipeline/merge/frame_electrons.h"

/// A lens shades the corners, and what is there in one frame is in the middle of another. Merged frames keep the
/// shading of the reference, whose gain maps correct it later.
namespace lowlux::isp {

/// Returns what a lens without shading would have given, for alignment; empty where the frame has no gain.
Plane<float> unshaded(const FrameElectrons& frame, Executor& executor);

/// Calls use() with the view of a frame whose shading is undone. Its noise is stated as that of the frame: near enough
/// for alignment.
template <class Use>
auto with_unshaded(const FrameElectrons& frame, Executor& executor, const Use& use) {
  const Plane<float> signal_e = unshaded(frame, executor);
  merge::FrameView view = view_of(frame);
  if (!signal_e.empty()) view.signal_e = signal_e.view();
  return use(view);
}

/// Changes the shading of a frame to that which the reference has where it shows the same: each pixel is multiplied by
/// its gain and divided by that of the reference. Both differ little, so that the noise stays as stated. Saturated
/// pixels stay.
/// @param reference_gain  empty: the reference has none
void change_shading(FrameElectrons& frame, const merge::Motion& motion, PlaneView<const float> reference_gain,
                    Executor& executor);

}  // namespace lowlux::isp
