#pragma once

#include "calib/picture_noise.h"
#include "isp/base/frame.h"
#include "isp/cli/calibration.h"

namespace lowlux::cli {

/// Adds the noise of one ordinary picture to a calibration's text and report, beside what the file says of it.
void show_picture_noise(const calib::PictureNoise& noise, const RawFrame& frame, const BlackPoint& black,
                        Calibration& found);

}  // namespace lowlux::cli
