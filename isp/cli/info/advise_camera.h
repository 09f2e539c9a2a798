#pragma once

#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/cli/info/advise_args.h"
#include "isp/model/sensor/exposure_advice.h"

namespace lowlux::cli {

/// A request, and what it rests on.
struct AdviceCase {
  isp::AdviceRequest request;
  std::string camera;              // sensor and where its figures are from
  std::vector<std::string> notes;  // what was assumed or estimated, one line each
};

/// The request of a command line. A sensor by name has its gain settings of isp/model/sensor_db and sees the light
/// through its camera's filters. Of a profile each gain with a sensor and an ISO speed is one, saturated as
/// ISO 12232 has it (isp/model/sensor/scene_luminance.h); its colours are those of the profile, else of --camera.
/// @param frame  the raw file; null: all is given
/// Errors: an unknown sensor, light or camera; a sensor none of whose gains has the figures; a profile without gain,
/// ISO or colour; a raw file that does not tell what was not given either, or has no black level.
Result<AdviceCase> advice_case(const AdviseArgs& args, const RawFrame* frame);

/// How bright what a raw file shows was, by its green pixels (all of a monochrome file).
struct RawLuminance {
  double median_cd_m2 = 0;
  double highlight_cd_m2 = 0;    // exceeded by the given share of the pixels
  bool highlight_clips = false;  // it is at the white level: the scene was brighter
};

/// A pixel's luminance is its fraction of the white level times the luminance that saturates
/// (isp/model/sensor/scene_luminance.h). Errors: exposure time, f-number or ISO missing; no black level; a median that
/// is not above black.
/// @param info   of the exposure, in place of the frame's own
/// @param share  0..1
Result<RawLuminance> raw_luminance(const RawFrame& frame, const FrameInfo& info, double share);

}  // namespace lowlux::cli
