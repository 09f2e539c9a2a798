#pragma once

#include <optional>

#include "capture/decoder/decoded_raw.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// The frame of a raw that is not a DNG: everything from the decoder, whose figures are checked, not trusted.
Result<RawFrame> frame_of_decoder(DecodedRaw decoded);

/// XYZ to camera RGB from the decoder's table of cameras; nullopt if it does not know this one.
std::optional<ColourCalibration> table_calibration(const DecodedHeader& header);

/// Temperature of the sensor, else of the camera [deg C]; nullopt if neither is told.
std::optional<double> decoder_temperature_c(const DecodedHeader& header);

}  // namespace lowlux::capture
