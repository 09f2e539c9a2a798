#pragma once

#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::cli {

/// How bright what a raw file shows was, by its green pixels (all of a monochrome file).
struct RawLuminance {
  double median_cd_m2 = 0;
  double highlight_cd_m2 = 0;    // exceeded by the given share of the pixels
  bool highlight_clips = false;  // it is at the white level: the scene was brighter
};

/// A pixel's luminance is its fraction of the white level times the luminance that saturates
/// (isp/model/scene_luminance.h). Errors: exposure time, f-number or ISO missing; no black level; a median that is not
/// above black.
/// @param info   of the exposure, in place of the frame's own
/// @param share  0..1
Result<RawLuminance> raw_luminance(const RawFrame& frame, const FrameInfo& info, double share);

}  // namespace lowlux::cli
