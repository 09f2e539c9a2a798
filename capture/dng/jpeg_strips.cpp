#include "capture/dng/jpeg_strips.h"

#include <algorithm>
#include <cstdint>
#include <string>

#include "capture/dng/dng_tags.h"
#include "capture/file/pass_on.h"

namespace lowlux::capture {
namespace {

/// Returns the samples that the frame header of a lossless JPEG states (ITU T.81, B.2.2); 0 if there is none.
std::uint64_t stated_samples(std::span<const std::byte> jpeg) {
  constexpr std::byte lossless_frame{0xC3}, start_of_scan{0xDA};
  for (std::size_t at = 2; at + 10 <= jpeg.size() && jpeg[at] == std::byte{0xFF};) {
    const std::byte marker = jpeg[at + 1];
    const std::byte* const segment = jpeg.data() + at + 2;
    if (marker == lossless_frame) {
      return std::uint64_t{load_u16(segment + 3, true)} * load_u16(segment + 5, true) *
             std::to_integer<std::uint32_t>(segment[7]);
    }
    const std::size_t bytes = load_u16(segment, true);
    if (bytes < 2 || marker == start_of_scan) return 0;
    at += 2 + bytes;
  }
  return 0;
}

}  // namespace

bool is_jpeg_in_strips(const TiffDirectory& directory) {
  const auto compression = directory.whole_or(tag::compression, tag::compression_none);
  const TiffEntry* const strips = directory.find(tag::strip_offsets);
  return compression && *compression == tag::compression_jpeg && directory.find(tag::tile_offsets) == nullptr &&
         strips != nullptr && strips->count > 1;
}

Result<void> check_jpeg_strips(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  auto grid = dng_grid(directory, image, file_bytes);
  if (!grid) return pass_on(grid);
  if (grid->count == 1) {
    return fail(ErrorCode::malformed, "the image has more than one strip of lossless JPEG, but RowsPerStrip states one",
                tag::rows_per_strip.name);
  }
  if (directory.find(tag::strip_offsets)->type == TiffEntry::Type::u32) return {};
  return fail(ErrorCode::unsupported, "lossless JPEG in strips is supported with offsets of 32 bits only",
              tag::strip_offsets.name);
}

Result<void> present_strips_as_tiles(const TiffDirectory& directory, const DngImage& image,
                                     std::vector<std::byte>& file) {
  if (auto good = check_jpeg_strips(directory, image, file.size()); !good) return good;
  const auto grid = dng_grid(directory, image, file.size());
  for (std::size_t i = 0; i < grid->count; ++i) {
    const int rows = std::min(grid->height, image.height - grid->top(i));
    const auto row_samples = static_cast<std::uint64_t>(image.width) * static_cast<std::uint64_t>(image.samples);
    const std::uint64_t needed = static_cast<std::uint64_t>(rows) * row_samples;
    if (stated_samples(grid->at.part(file, i)) >= needed) continue;
    return fail(ErrorCode::malformed, "the lossless JPEG from row " + std::to_string(grid->top(i)) +
                                          " on has too few samples for its " + std::to_string(rows) +
                                          " rows: the file is damaged");
  }
  set_tag(*directory.find(tag::strip_offsets), tag::tile_offsets.id, file);
  set_tag(*directory.find(tag::strip_byte_counts), tag::tile_byte_counts.id, file);
  set_tag(*directory.find(tag::rows_per_strip), tag::tile_length.id, file);
  if (const TiffEntry* const stray = directory.find(tag::tile_width)) set_tag(*stray, 0, file);
  return {};
}

void set_tag(const TiffEntry& entry, std::uint16_t id, std::vector<std::byte>& file) {
  file[entry.place + (entry.big_endian ? 0 : 1)] = static_cast<std::byte>(id >> 8);
  file[entry.place + (entry.big_endian ? 1 : 0)] = static_cast<std::byte>(id & 255);
}

}  // namespace lowlux::capture
