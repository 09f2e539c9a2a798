#pragma once

#include "capture/x_trans/x_trans_pattern.h"
#include "isp/base/frame.h"

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

}  // namespace lowlux::capture
