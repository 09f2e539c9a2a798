#pragma once

#include <functional>

#include "capture/x_trans/x_trans_pattern.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Interpolates a frame that holds an X-Trans mosaic, and makes it one of SensorLayout::linear_rgb with floating-point
/// samples [DN] of the active area. The metadata of the frame are converted accordingly:
///   - Black levels become one for each colour, and samples are changed accordingly. A level that is not stated is
///     measured on masked areas that the file states, else it is absent. White levels do not change.
///   - NoiseProfile becomes that of white noise of the same power at low frequencies: the variance of a site divided by
///     the fraction of sites of its colour, 8/36 for red and blue and 20/36 for green.
///   - Defects that the file lists, and detected ones, are repaired before the interpolation.
/// @param frame  readout height x width samples, one for each site; black level of one sample
/// @param phase  phase of the pattern at the corner of the active area
/// @note It runs on up to eight threads.
void interpolate_frame(RawFrame& frame, const XTransPhase& phase);

/// Processes a frame with the X-Trans mosaic of the sensor, for work on single photosites: its layout is
/// SensorLayout::bayer, whose phase has no meaning here. It may change samples, black level, noise and defects.
/// @return whether the frame is to be interpolated; if not it stays a mosaic
using XTransUse = std::function<Result<bool>(RawFrame& mosaic)>;

/// Leaves X-Trans mosaics as they are.
Result<bool> keep_x_trans(RawFrame& mosaic);

/// Calls `use` with the mosaic, if there is one, and interpolates it unless `use` returns false.
Result<void> use_mosaic(RawFrame& frame, const XTransPhase& phase, const XTransUse& use);

}  // namespace lowlux::capture
