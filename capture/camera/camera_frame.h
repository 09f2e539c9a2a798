#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "capture/camera/camera.h"
#include "isp/base/cfa.h"
#include "isp/base/frame.h"

namespace lowlux::capture {

/// Entry of RawFrame::warnings for a colour camera that states no colour matrix.
inline constexpr std::string_view colours_unknown =
    "the colours of the camera are not known: sRGB is assumed; --profile states them";

/// Converts a camera's frame to a raw frame, from which images and raw files are made; `frame.bytes` holds at least
/// frame_bytes(format) and is read once, row by row. White is the largest code. Facts are stored where a DNG has a
/// field for them:
///     black_level_dn             black_tag, a pattern of 2 x 2 in the mosaic's order (R, Gr, Gb, B for monochrome)
///     exposure_s, temperature_c  FrameInfo, the time rounded to a float
///     analogue_gain              FrameInfo::iso, 100 for a gain of 1, rounded to integers
///     colour_gains               as_shot_neutral (1/R, 1, 1/B), largest 1; absent without them
///     colour_matrix              one calibration: forward = Bradford(D65 -> D50) sRGB->XYZ M, and its inverse under
///                                the light of colour_temperature_k, without it under D65
/// Without a matrix M is the identity, and `colours_unknown` is a warning. Colour values are rounded to multiples of
/// 2^-16 (neutral: 2^-20), which a DNG holds exactly: an image made from its file has the same bytes. Invalid facts
/// (not finite, a gain outside 1e-3..1e3, a matrix without an inverse, black not in 0..white) are left out, each with a
/// warning. Digital gain and lux are not stored: raw data precede the first, and the second is not a property of the
/// image.
/// @param camera  its name; FrameInfo::model
RawFrame raw_frame_of(const CameraFrame& frame, const CameraFormat& format, const std::string& camera);

}  // namespace lowlux::capture
