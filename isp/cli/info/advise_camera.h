#pragma once

#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/cli/info/advise_args.h"
#include "isp/model/sensor/exposure_advice.h"

namespace lowlux::cli {

/// Holds a request, and the assumptions it is based on.
struct AdviceCase {
  isp::AdviceRequest request;
  std::string camera;              // sensor and source of its values
  std::vector<std::string> notes;  // assumptions and estimates, one line each
};

/// Returns the request of the arguments. A named sensor has its gain settings of isp/model/sensor_db and receives light
/// through its camera's filters. For a profile, each gain with a sensor and an ISO speed is a setting, saturated as by
/// ISO 12232 (isp/model/sensor/scene_luminance.h); its colours are those of the profile, else of --camera.
/// @param frame  the raw file; null: all values are given
/// Errors: an unknown sensor, light or camera; a sensor none of whose gains has the values; a profile without gain, ISO
/// or colour; a raw file that lacks values that were not given either, or has no black level.
Result<AdviceCase> advice_case(const AdviseArgs& args, const RawFrame* frame);

/// Holds the luminance of the scene of a raw file, by its green pixels (all of a monochrome file).
struct RawLuminance {
  double median_cd_m2 = 0;
  double highlight_cd_m2 = 0;    // exceeded by the given fraction of the pixels
  bool highlight_clips = false;  // the highlight is at the white level: the scene was brighter
};

/// Estimates the luminance of a scene. A pixel's luminance is its fraction of the white level times the luminance that
/// saturates (isp/model/sensor/scene_luminance.h). Errors: exposure time, f-number or ISO missing; no black level; a
/// median that is not above black.
/// @param info   exposure data, in place of the frame's own
/// @param share  0..1
Result<RawLuminance> raw_luminance(const RawFrame& frame, const FrameInfo& info, double share);

}  // namespace lowlux::cli
