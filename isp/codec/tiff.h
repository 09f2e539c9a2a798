#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>

#include "isp/codec/picture_file.h"

namespace lowlux::isp {

/// Holds the options of encode_tiff().
struct TiffOptions {
  /// Deflate uses the horizontal predictor for integers and the floating-point predictor for floats. The README states
  /// its size and time on sensor noise.
  enum class Compression : std::uint8_t { none, deflate } compression = Compression::none;
};

/// Writes RGB of 8 or 16 bits, or of 32-bit floats (any value, NaN included, is preserved exactly), in strips of about
/// 1 MB; BigTIFF where 4 GB would not suffice. `metadata.icc` becomes the ICC tag; `metadata.info` becomes Make, Model,
/// Software, DateTime and an EXIF directory. Orientation is written as given.
/// @param file open for reading and writing, at its start
Result<void> encode_tiff(const Picture& picture, const FileMetadata& metadata, const TiffOptions& options,
                         std::FILE* file);

/// Reads the first page of a grey or RGB TIFF of 8 or 16 bits or 32-bit floats, in strips or tiles, any compression
/// libtiff supports. Samples beyond the colours (alpha, depth) are dropped. Other kinds are errors that name the kind.
Result<DecodedPicture> decode_tiff(std::span<const std::byte> bytes, const DecodeLimits& limits = {});

}  // namespace lowlux::isp
