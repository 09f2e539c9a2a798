#pragma once

#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/cli/develop/dark_files.h"
#include "isp/raw/black_point.h"

namespace lowlux::cli {

/// Subtracts the dark frame of an image from its X-Trans mosaic, before it is interpolated: dark charge and black level
/// belong to single photosites, whatever their colour. The samples become floating-point numbers of the active area,
/// whose black level is the mean of the dark frame; pixels whose dark value is unknown become defects, and the variance
/// that the dark frame adds is added to a NoiseProfile.
/// @param mosaic  as XTransUse has it
/// @return true: the mosaic is to be interpolated. Errors: those of DarkSource::frame_for and isp::black_of
Result<bool> subtract_from_x_trans(DarkSource& darks, const isp::BlackRequest& black, RawFrame& mosaic);

}  // namespace lowlux::cli
