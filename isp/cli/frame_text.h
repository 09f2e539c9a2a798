#pragma once

#include <string>

namespace lowlux::cli {

/// An exposure time as photographers write it: "1/60 s" below a quarter of a second, else with one decimal at most,
/// "5 s", "0.3 s" (the rule of ExifTool's PrintExposureTime).
std::string exposure_text(double exposure_s);

/// "f/5.6"; below f/1 with two decimals.
std::string f_number_text(double f_number);

}  // namespace lowlux::cli
