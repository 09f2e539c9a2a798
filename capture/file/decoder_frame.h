#pragma once

#include <optional>

#include "capture/decoder/decoded_raw.h"
#include "capture/x_trans/x_trans_frame.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Returns the frame of a raw that is not a DNG: all values come from the decoder and are checked, not trusted.
/// An X-Trans mosaic is used as use_mosaic (x_trans_frame.h) states.
Result<RawFrame> frame_of_decoder(DecodedRaw decoded, const XTransUse& x_trans_use = {});

/// Returns XYZ to camera RGB from the decoder's table of cameras; nullopt if the camera is not in it.
std::optional<ColourCalibration> table_calibration(const DecodedHeader& header);

/// Returns the temperature of the sensor, else of the camera [deg C]; nullopt if neither is known.
std::optional<double> decoder_temperature_c(const DecodedHeader& header);

}  // namespace lowlux::capture
