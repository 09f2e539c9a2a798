#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "isp/base/cfa.h"
#include "tests/support/dng/tiff_writer.h"

namespace lowlux::test {

enum class DngStorage : std::uint8_t { uncompressed, lossless_jpeg, tiled_lossless_jpeg };

/// Writes small DNG files for tests, valid ones and others. Not built upon a TIFF library, which would refuse the
/// others.
///
///     DngBuilder dng;
///     dng.width = 27, dng.height = 25, dng.bits = 12, dng.phase = BayerPhase::gbrg;
///     dng.pixels = ramp(dng);
///     dng.set(50829, Tag::numbers(TagType::u32, {1, 1, 5, 6}));   // ActiveArea
///     const std::vector<std::byte> file = dng.build();
///
/// Defaults: 24 x 24 pixels, 16 bits, no compression, black 64 and white 2^bits - 1, one colour matrix (D65), a neutral
/// of (0.5, 1, 0.6), make "Test", model "Camera".
struct DngBuilder {
  int width = 24, height = 24;          // LibRaw rejects anything below 22 x 22
  int samples = 1;                      // 1: a mosaic or monochrome, 3: LinearRaw
  bool monochrome = false;              // LinearRaw with one sample
  int bits = 16;                        // below 16: packed, first bit first, rows start at bytes
  BayerPhase phase = BayerPhase::rggb;  // counted from the corner of the active area, as CFAPattern is
  std::vector<std::uint16_t> pixels;    // height x (width * samples); empty: ramp()
  DngStorage storage = DngStorage::uncompressed;
  int jpeg_components = 2;  // components that a mosaic's row is split into; LinearRaw has one for each sample
  int tile_width = 16, tile_height = 16;
  int rows_per_strip = 0;                            // 0: one strip
  std::vector<std::vector<std::byte>> stored_parts;  // strips or tiles as stored, instead of pixels and storage
  bool parts_are_tiles = false;
  int part_gap = 0;             // bytes between strips or tiles
  bool parts_reversed = false;  // the last strip or tile comes first in the file
  bool big_tiff = false;        // with offsets of 64 bits
  bool big_endian = false;
  bool raw_in_sub_ifd = false;  // a small RGB preview comes first, the raw image is its SubIFD

  /// Adds a tag to, or replaces it in, the directory where DNG requires it (EXIF tags: the EXIF directory).
  DngBuilder& set(std::uint16_t id, Tag tag);
  /// Leaves a tag out.
  DngBuilder& remove(std::uint16_t id);

  std::vector<std::byte> build() const;

 private:
  using Parts = std::vector<std::vector<std::byte>>;  // strips or tiles
  struct Directories {
    TagDirectory main, exif, raw;
  };
  struct Offsets {
    std::size_t exif = 0, raw = 0, data = 0;
  };
  std::vector<double> part_offsets(const Parts& parts, std::size_t data) const;
  Directories directories(const Parts& parts, const Offsets& at) const;

  std::map<std::uint16_t, Tag> set_;
  std::set<std::uint16_t> removed_;
};

/// Returns samples that differ from their neighbours, use all bits and both ends of the range.
std::vector<std::uint16_t> ramp(const DngBuilder& dng);

}  // namespace lowlux::test
