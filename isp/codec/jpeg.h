#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>

#include "isp/codec/picture_file.h"

namespace lowlux::isp {

/// Holds the options of encode_jpeg().
struct JpegOptions {
  int quality = 92;  // 1..100, the scale of the IJG library
  /// Selects chroma at full resolution, or at half in both directions.
  enum class Chroma : std::uint8_t { full, half } chroma = Chroma::full;
};

/// Writes a baseline JFIF file, with the profile in APP2 segments and EXIF in APP1 if `metadata` has them. An error if
/// a side is above 65500 pixels (libjpeg's limit), the EXIF block above 65527 bytes or the quality outside its range.
Result<void> encode_jpeg(const Encoded8& picture, const FileMetadata& metadata, const JpegOptions& options,
                         std::FILE* file);

/// Reads 8-bit grey, YCbCr and RGB files, baseline or progressive, to Encoded8; CMYK is an error. A file that ends
/// early or has damaged entropy-coded data is an error, never an image filled up with grey.
Result<DecodedPicture> decode_jpeg(std::span<const std::byte> bytes, const DecodeLimits& limits = {});

}  // namespace lowlux::isp
