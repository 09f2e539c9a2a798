#pragma once

#include <optional>
#include <string>

#include "capture/dng/dng_file.h"
#include "isp/base/frame.h"

namespace lowlux::capture {

/// Camera, exposure, time and orientation of a DNG. What is missing, zero or absurd stays absent.
FrameInfo read_info(const DngFile& dng);

/// The values a camera can have meant; nullopt for all others, zero and NaN included.
std::optional<double> plausible_exposure_s(double seconds);
std::optional<double> plausible_iso(double iso);
std::optional<double> plausible_f_number(double f_number);
std::optional<double> plausible_focal_length_mm(double mm);
std::optional<double> plausible_temperature_c(double celsius);

/// The text, if it is a date as EXIF writes it, "YYYY:MM:DD hh:mm:ss"; else empty.
std::string plausible_date(const std::string& text);

}  // namespace lowlux::capture
