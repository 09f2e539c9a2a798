#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/base/source_tags.h"

namespace lowlux::isp {

/// Holds the CIE 1931 xy of the three primaries and the white of an RGB space.
struct Chromaticities {
  struct Xy {
    double x = 0;
    double y = 0;
    friend bool operator==(const Xy&, const Xy&) = default;
  };
  Xy red, green, blue, white;
  friend bool operator==(const Chromaticities&, const Chromaticities&) = default;
};

/// Holds the contents of an image file except its pixels; each format keeps what it can hold.
struct FileMetadata {
  std::vector<std::byte> icc;   // ICC profile; empty: none (PNG, JPEG, TIFF)
  std::vector<std::byte> exif;  // EXIF block from its TIFF header on, without "Exif\0\0"; empty: none (PNG, JPEG)
  FrameInfo info;               // stored in the format's own fields (TIFF, OpenEXR)
  std::shared_ptr<const SourceTags> source_tags;  // tags of the raw file, to be added (TIFF, OpenEXR); null: none
  std::optional<Chromaticities> chromaticities;   // OpenEXR
  std::optional<double> white_luminance_cd_m2;    // luminance of RGB (1, 1, 1) (OpenEXR whiteLuminance)
};

/// Holds a decoded image with the metadata of its file.
struct DecodedPicture {
  Picture picture;
  FileMetadata metadata;
};

/// Holds the limits of decoders for untrusted files.
struct DecodeLimits {
  std::int64_t max_pixels = std::int64_t{1} << 28;  // 268 MP; 3.2 GB as float RGB
};

/// Returns an error unless 1 <= width, height <= 2^30 / 3 and width * height <= limits.max_pixels.
Result<void> check_size(std::int64_t width, std::int64_t height, const DecodeLimits& limits);

/// Writes all of `bytes` at the position of `file`; an error includes the system's message.
Result<void> write_bytes(std::FILE* file, std::span<const std::byte> bytes);

/// Returns the error for a file that a library cannot read, ending with the library's message, on one line: it may
/// quote the file, whose names hold any bytes.
tl::unexpected<Error> not_readable(const std::string& what, std::string said);

/// Returns the error for a failed write, from errno.
tl::unexpected<Error> write_failure();

}  // namespace lowlux::isp
