#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/dng/quad_bayer.h"
#include "capture/dng/tiff_directory.h"
#include "capture/x_trans/x_trans_pattern.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

inline constexpr int min_libraw_side = 22;     // LibRaw treats smaller images as thumbnails
inline constexpr int max_libraw_side = 64000;  // and larger ones as damaged

/// What decodes the samples of a raw image.
enum class DngDecoder : std::uint8_t {
  libraw,      // integers without compression, or in lossless JPEG
  rows,        // integers and floating-point numbers, uncompressed or deflated (dng_rows.h)
  lossy_jpeg,  // 8-bit codes in baseline JPEG, one for each strip or tile (dng_lossy.h)
  jpeg_xl      // codes in JPEG XL, one for each strip or tile (dng_jpeg_xl.h)
};

/// Layout and storage of the samples of one raw image.
struct DngImage {
  int width = 0, height = 0;  // of the readout
  int samples = 1;            // per pixel
  int bits = 0;               // per sample, as stored
  bool is_float = false;      // floating-point samples, of 16, 24 or 32 bits
  bool is_planar = false;     // stored colour after colour, and not pixel after pixel
  bool is_dng_1_0 = false;    // of a file of DNG 1.0, whose lossless JPEG differs (lossless_jpeg_rows.h)
  DngDecoder decoder = DngDecoder::libraw;
  int row_interleave = 1, column_interleave = 1;  // images that they are stored as; 1 but for JPEG XL
  SensorLayout layout = SensorLayout::bayer;
  BayerPhase phase = BayerPhase::rggb;
  std::optional<QuadBayer> quad_bayer;  // of a mosaic that is Quad Bayer
  std::optional<XTransPhase> x_trans;   // of a mosaic that is X-Trans and not Bayer, from the corner of the active area
};

/// Returns whether an image is stored in lossy JPEG or JPEG XL, of which OpcodeList2 makes linear values.
inline bool is_encoded(const DngImage& image) {
  return image.decoder == DngDecoder::lossy_jpeg || image.decoder == DngDecoder::jpeg_xl;
}

/// Returns whether LibRaw reads an image of this size.
inline bool is_libraw_size(const DngImage& image) {
  return std::min(image.width, image.height) >= min_libraw_side &&
         std::max(image.width, image.height) <= max_libraw_side;
}

/// Locations of the parts (strips or tiles) of an image, all inside the file.
struct DngParts {
  std::vector<double> offset, bytes;
  bool tiled = false;

  /// Returns the bytes of part i.
  std::span<const std::byte> part(std::span<const std::byte> file, std::size_t i) const {
    return file.subspan(static_cast<std::size_t>(offset[i]), static_cast<std::size_t>(bytes[i]));
  }
};

Result<DngParts> dng_parts(const TiffDirectory& directory, std::size_t file_bytes);

/// Returns the error of an image that has fewer parts than it needs.
Result<void> check_part_count(const DngImage& image, double needed, const DngParts& parts);

/// Parts of equal size that cover an image row after row; the last ones may extend beyond it. An image that is stored
/// colour after colour is covered once for each colour.
struct DngGrid {
  DngParts at;
  int width = 0, height = 0;  // of one part [pixels]
  int across = 0;             // parts next to each other
  std::size_t covering = 0;   // parts that cover the image once
  std::size_t count = 0;      // parts that the image needs

  /// Returns the first column and row of part i, and the number of its colour: 0 if it has all of them.
  int left(std::size_t i) const { return static_cast<int>(i % covering % static_cast<std::size_t>(across)) * width; }
  int top(std::size_t i) const { return static_cast<int>(i % covering / static_cast<std::size_t>(across)) * height; }
  int plane(std::size_t i) const { return static_cast<int>(i / covering); }
};

/// Returns the grid of an image. Errors: parts without pixels, far larger than the image, too few or outside the file,
/// or parts that share bytes.
Result<DngGrid> dng_grid(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes);

/// Returns the value of a tag that must be there and be an integer.
Result<std::uint32_t> required_whole(const TiffDirectory& directory, TagName name);

/// Returns whether a compression is Deflate, by one of its two numbers.
bool is_deflate(std::uint32_t compression);

/// Returns a compression's name for messages, "JPEG XL (52546)".
std::string compression_name(std::uint32_t compression);

}  // namespace lowlux::capture
