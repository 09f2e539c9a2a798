#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>

#include "isp/codec/picture_file.h"

namespace lowlux::isp {

struct TiffOptions {
  /// Deflate comes with the horizontal predictor for integers and the floating-point predictor for floats. What it
  /// saves and costs on sensor noise is in the README.
  enum class Compression : std::uint8_t { none, deflate } compression = Compression::none;
};

/// Writes RGB of 8 or 16 bits, or of 32-bit floats (any value, NaN included, comes back as it was), in strips of
/// about 1 MB; BigTIFF where 4 GB would not do. `metadata.icc` becomes the ICC tag; `metadata.info` becomes Make,
/// Model, Software, DateTime and an EXIF directory. Orientation is written as given.
/// @param file open for reading and writing, at its start
Result<void> encode_tiff(const Picture& picture, const FileMetadata& metadata, const TiffOptions& options,
                         std::FILE* file);

/// Reads the first page of a grey or RGB TIFF of 8 or 16 bits or 32-bit floats, in strips or tiles, any compression
/// libtiff knows. Samples beyond the colours (alpha, depth) are dropped. Other kinds are refused by name.
Result<DecodedPicture> decode_tiff(std::span<const std::byte> bytes, const DecodeLimits& limits = {});

}  // namespace lowlux::isp
