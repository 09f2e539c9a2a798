#pragma once

#include <optional>
#include <string>

#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"

namespace lowlux::cli {

/// A mosaic that another program saved as a grey TIFF or as a floating-point DNG, for example the mean of dark frames.
struct MosaicTiff {
  std::string file;
  Plane<float> dn;
  bool rounded = true;  // the file holds whole codes
  bool scaled = false;  // its values are at most 1 and were taken as fractions of 65535, as Siril and PixInsight save
  /// White level of a DNG, in its own units: values are scaled to the white level of the image. Absent: codes.
  std::optional<double> white;
  FrameInfo info;  // metadata of the file
};

/// Returns whether the file has the extension of a TIFF: .tif or .tiff in any case.
bool is_tiff_name(const std::string& file);

/// Returns the mosaic of a frame of floating-point samples, borders included. Error: demosaiced samples.
Result<MosaicTiff> mosaic_of(RawFrame frame, const std::string& file);

/// Reads a grey TIFF of 16 bits or 32-bit floats. Errors: those of reading and of isp::decode_tiff; 8 bits; colours;
/// values that are not finite.
Result<MosaicTiff> read_mosaic_tiff(const std::string& file);

}  // namespace lowlux::cli
