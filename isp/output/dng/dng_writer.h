#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/output/atomic_file.h"

namespace lowlux::isp {

/// Lists the compressions of samples.
enum class DngCompression : std::uint8_t {
  none,
  lossless,  // lossless JPEG of 16-bit samples in tiles; Deflate of floats
};

/// Holds the options of write_dng().
struct DngWriteOptions {
  Overwrite overwrite = Overwrite::no;
  std::string software = "lowlux";  // with its version; replaces the name in the frame
  /// Processing of the frame, for ImageDescription: it follows the caption that the source tags have there. Printable
  /// ASCII is kept.
  std::string description;
  Sync sync = Sync::no;
  /// By how much raw developers brighten the image by default (BaselineExposure), in addition to what the source
  /// states; the sum is -100 to 100. For a merge of exposures the ratio of the exposure that the image is to have to
  /// the one that white belongs to.
  double baseline_exposure_ev = 0;
  DngCompression compression = DngCompression::none;
};

/// Writes a raw frame as DNG 1.4, completely or not at all: 16 bits, or 32-bit floats if the frame has floating-point
/// samples, by default uncompressed, in adjacent strips of about 1 MB. Samples are preserved bit by bit.
/// Mosaics and monochrome have one sample per pixel, SensorLayout::linear_rgb three. Every figure of the frame that has
/// a DNG tag is written; what is absent stays absent. Its source tags are written as they are, those of the camera
/// profile only with its colour matrices; their UniqueCameraModel takes the place of make and model. Rationals are
/// within 1e-7 of the figure, relative.
///
/// Figures rounded to what DNG can hold: white levels to integer DN; the temperature of a calibration to the nearest
/// light source of EXIF (light_source_of). UniqueCameraModel, which DNG requires, is make and model, or "Unknown".
///
/// Errors
///     invalid_argument  a figure that DNG cannot hold or that contradicts another (the message names it); samples
///                       that are not finite or too large (unusable_sample); with floats a white level that is no
///                       integer; sides that raw developers do not read: with codes outside of 22 to 64000 px, the
///                       limits of LibRaw, with floats above 65535 px
///     too_large         as check_dng_size
///     exists, unwritable  as AtomicFile
Result<void> write_dng(const RawFrame& frame, const std::string& path, const DngWriteOptions& options = {});

/// Writes a raw frame as above to a file that gets its name by AtomicFile::commit or commit_all.
Result<AtomicFile> prepare_dng(const RawFrame& frame, const std::string& path, const DngWriteOptions& options = {});

/// Writes a raw frame as above to a file descriptor that may be a pipe (write_to_stream).
Result<void> write_dng(const RawFrame& frame, int descriptor, const DngWriteOptions& options = {});

/// Returns an error if this number of samples would need offsets of 64 bits (BigTIFF), which raw developers do not
/// read.
Result<void> check_dng_size(std::int64_t samples, std::size_t sample_bytes = 2);

}  // namespace lowlux::isp
