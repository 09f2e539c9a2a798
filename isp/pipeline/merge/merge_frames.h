#pragma once

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/pipeline/merge/merged_raw.h"

namespace lowlux::isp {

/// Merges raw frames of one camera and scene to one raw frame with less noise. Memory does not grow with their number.
///
/// The scene is that of the reference frame. Each frame is compared with it by the noise model
/// (merge::compare_mosaics), and averaged where it matches. Without motion, the frames are compared with the mean of
/// the reference and of the robust mean of up to four others, where these two match; where they do not, the majority of
/// them decides, unless MergeOptions::reference names the scene (merge::make_static_reference). Frames that are aligned
/// by stars are compared with a robust mean too (find_star_reference). Frames whose exposures differ are a bracket:
/// they are weighted by their inverse variance, without saturated sites, and compared with the reference. The
/// NoiseProfile is that of the mean. Black and white levels are those of each frame; orientation and crop are those of
/// the reference, and mosaics lie as the sensor reads them out. Errors: no frame (invalid_argument); frames of other
/// cameras, active areas or mosaics (invalid_argument, with the name), and of a bracket without exposure times
/// (insufficient); too few stars (insufficient); frames that did not move or differ in exposure where they are to be
/// drizzled (invalid_argument); those of frame_electrons. Frames with the samples of another one are averaged, with a
/// warning.
Result<MergedRaw> merge_frames(int count, const FrameReader& read, const MergeOptions& options, Executor& executor,
                               const MergeProgress& progress = {});

}  // namespace lowlux::isp
