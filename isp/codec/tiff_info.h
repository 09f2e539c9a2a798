#pragma once

#include <cstdint>

#include "isp/base/frame.h"

struct tiff;  // libtiff's open file

namespace lowlux::isp {

/// Writes an EXIF directory (exposure, aperture, focal length, sensitivity, temperature, time) and leaves `file` at a
/// new main directory. @return its offset in the file, for TIFFTAG_EXIFIFD; 0 if it could not be written
std::uint64_t write_tiff_exif(tiff* file, const FrameInfo& info);

/// Sets Make, Model, Software, DateTime and Orientation of the main directory.
void set_tiff_info(tiff* file, const FrameInfo& info);

/// Returns the information of both directories. Leaves `file` at its EXIF directory if it has one: call it last.
FrameInfo read_tiff_info(tiff* file);

}  // namespace lowlux::isp
