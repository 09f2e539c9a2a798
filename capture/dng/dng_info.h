#pragma once

#include <optional>
#include <string>

#include "capture/dng/dng_file.h"
#include "isp/base/frame.h"

namespace lowlux::capture {

/// Reads camera, exposure, time and orientation of a DNG. Missing, zero or implausible values stay absent.
FrameInfo read_info(const DngFile& dng);

/// Each returns the value if it is plausible for a camera; nullopt otherwise, zero and NaN included.
std::optional<double> plausible_exposure_s(double seconds);
std::optional<double> plausible_iso(double iso);
std::optional<double> plausible_f_number(double f_number);
std::optional<double> plausible_focal_length_mm(double mm);
std::optional<double> plausible_temperature_c(double celsius);

/// Returns the text if it is a date as EXIF writes it, "YYYY:MM:DD hh:mm:ss"; else empty.
std::string plausible_date(const std::string& text);

}  // namespace lowlux::capture
