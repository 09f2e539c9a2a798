#pragma once

#include <functional>

#include "capture/x_trans/x_trans_pattern.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Interpolates a frame that holds an X-Trans mosaic, and makes it one of SensorLayout::linear_rgb with floating-point
/// samples [DN] of the active area. Everything that the frame states is brought to that:
///   - Black levels become one for each colour, and the samples follow. What is not stated is measured on masked areas
///     that the file states, else it stays absent. White levels stay.
///   - NoiseProfile becomes that of white noise of the same power at low frequencies: the variance of a site divided by
///     the fraction of sites of its colour, 8/36 for red and blue and 20/36 for green.
///   - Defects that the file names, and those that are found, are repaired before the interpolation.
/// @param frame  readout height x width samples, one for each site; black level of one sample
/// @param phase  of the corner of the active area
/// @note It runs on up to eight threads.
void interpolate_frame(RawFrame& frame, const XTransPhase& phase);

/// Uses a frame that holds an X-Trans mosaic as the sensor gave it, for work on single photosites: its layout is
/// SensorLayout::bayer, whose phase means nothing here. It may change samples, black level, noise and defects.
/// @return whether the frame is to be interpolated; if not it stays a mosaic
using XTransUse = std::function<Result<bool>(RawFrame& mosaic)>;

/// Leaves X-Trans mosaics as they are.
Result<bool> keep_x_trans(RawFrame& mosaic);

/// Gives the mosaic to `use`, if there is one, and interpolates it unless `use` states otherwise.
Result<void> use_mosaic(RawFrame& frame, const XTransPhase& phase, const XTransUse& use);

}  // namespace lowlux::capture
