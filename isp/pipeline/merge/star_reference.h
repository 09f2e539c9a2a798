#pragma once

#include <cstdint>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/pipeline/merge/frame_electrons.h"
#include "isp/pipeline/merge/frame_loader.h"
#include "isp/pipeline/merge/star_alignment.h"

namespace lowlux::isp {

/// Holds what the frames of a night sky are compared with.
struct StarReference {
  Plane<float> signal_e;      // robust mean of a few frames in the place of the reference
  double fraction = 1;        // its variance over that of one frame
  CameraRgb prediction;       // R, G and B of it [e-]
  Plane<std::uint8_t> still;  // blocks that stand still while the stars move: 1, else 0; empty if not asked for
};

/// Makes the robust mean of the reference and of other frames that are aligned to it by the stars, so that satellites
/// and the like are in none of them. The frames are read twice: first they are placed to whole CFA cells, and developed
/// from their mean, a prediction brings them to fractions of a pixel. Where frames do not overlap, there is no value.
/// @param others           frames that are averaged with the reference; those whose stars do not match are left out
/// @param keep_foreground  find what stands still, and average it in its place
/// Errors: those of reading. If exposures differ, the result is unfinished, and FrameLoader::exposures_differ() is set.
Result<StarReference> find_star_reference(FrameLoader& loader, const FrameElectrons& reference,
                                          const StarAlignment& stars, const std::vector<int>& others,
                                          bool keep_foreground, Executor& executor);

/// Replaces the blocks of a mosaic that stand still by those of the frame as it was taken.
void put_still_blocks(const Plane<std::uint8_t>& still, PlaneView<const float> unmoved, PlaneView<float> mosaic,
                      Executor& executor);

}  // namespace lowlux::isp
