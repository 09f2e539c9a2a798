#include "capture/dng/exif_blocks.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

namespace lowlux::capture {
namespace {

using namespace std::string_view_literals;
using Bytes = std::span<const std::byte>;

constexpr TagName jpg_from_raw{0x2E, "JpgFromRaw"};  // of RW2
constexpr std::size_t max_boxes = 1024;

bool starts_with(Bytes bytes, std::string_view text) {
  return bytes.size() >= text.size() &&
         std::string_view(reinterpret_cast<const char*>(bytes.data()), text.size()) == text;
}

/// Returns `size` bytes from `offset` on; nullopt if they are not all there.
std::optional<Bytes> part_of(Bytes bytes, std::uint64_t offset, std::uint64_t size) {
  if (offset > bytes.size() || size > bytes.size() - offset) return std::nullopt;
  return bytes.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(size));
}

void add_block(Bytes tiff, ExifBlock::First first, std::vector<ExifBlock>& out) {
  if (auto opened = TiffFile::open(tiff)) out.push_back({*opened, first});
}

/// Adds the EXIF data of a JPEG image: those of its segment APP1 (EXIF 2.32, 4.5.4), which comes before the samples.
void add_jpeg(Bytes jpeg, std::vector<ExifBlock>& out) {
  constexpr std::byte start_of_scan{0xDA}, app1{0xE1};
  constexpr std::string_view name = "Exif\0\0"sv;
  if (!starts_with(jpeg, "\xFF\xD8"sv)) return;
  for (std::size_t at = 2; at + 4 <= jpeg.size() && jpeg[at] == std::byte{0xFF};) {
    const std::byte marker = jpeg[at + 1];
    if (marker == std::byte{0xFF}) {  // a fill byte (ITU T.81, B.1.1.2)
      ++at;
      continue;
    }
    const std::size_t size = load_u16(jpeg.data() + at + 2, true);
    const auto segment = part_of(jpeg, at + 2, size);
    if (size < 2 || marker == start_of_scan || !segment) return;
    const Bytes content = segment->subspan(2);
    if (marker == app1 && starts_with(content, name)) {
      add_block(content.subspan(name.size()), ExifBlock::First::main, out);
      return;
    }
    at += 2 + size;
  }
}

/// Adds the EXIF data of the JPEG image that a RAF names in its header.
void add_raf(Bytes file, std::vector<ExifBlock>& out) {
  constexpr std::size_t place = 84;
  if (file.size() < place + 8) return;
  const auto jpeg = part_of(file, load_u32(file.data() + place, true), load_u32(file.data() + place + 4, true));
  if (jpeg) add_jpeg(*jpeg, out);
}

/// Calls visit(type, content) for each box of ISO/IEC 14496-12 until one is not whole.
template <class Visit>
void each_box(Bytes bytes, const Visit& visit) {
  for (std::size_t i = 0; i < max_boxes && bytes.size() >= 8; ++i) {
    std::uint64_t size = load_u32(bytes.data(), true), header = 8;
    if (size == 1 && bytes.size() >= 16) {
      size = std::uint64_t{load_u32(bytes.data() + 8, true)} << 32 | load_u32(bytes.data() + 12, true);
      header = 16;
    } else if (size == 0) {
      size = bytes.size();  // to the end of the file
    }
    if (size < header || size > bytes.size()) return;
    const auto whole = static_cast<std::size_t>(size), head = static_cast<std::size_t>(header);
    visit(std::string_view(reinterpret_cast<const char*>(bytes.data()) + 4, 4), bytes.subspan(head, whole - head));
    bytes = bytes.subspan(whole);
  }
}

/// Adds the EXIF data of a CR3: TIFF structures in boxes of Canon's box in `moov`.
void add_cr3(Bytes file, std::vector<ExifBlock>& out) {
  constexpr std::string_view canon = "\x85\xC0\xB6\x87\x82\x0F\x11\xE0\x81\x11\xF4\xCE\x46\x2B\x6A\x48"sv;
  each_box(file, [&](std::string_view type, Bytes movie) {
    if (type != "moov"sv) return;
    each_box(movie, [&](std::string_view inner, Bytes content) {
      if (inner != "uuid"sv || !starts_with(content, canon)) return;
      each_box(content.subspan(canon.size()), [&](std::string_view name, Bytes tiff) {
        if (name == "CMT1"sv) add_block(tiff, ExifBlock::First::main, out);
        if (name == "CMT2"sv) add_block(tiff, ExifBlock::First::exif, out);
        if (name == "CMT4"sv) add_block(tiff, ExifBlock::First::gps, out);
      });
    });
  });
}

}  // namespace

std::vector<ExifBlock> find_exif(Bytes file) {
  std::vector<ExifBlock> out;
  if (const auto tiff = TiffFile::open_raw(file)) {
    out.push_back({*tiff, ExifBlock::First::main});
    const auto main = tiff->directory(tiff->first_directory());
    if (main) {
      if (const auto jpeg = main->bytes(jpg_from_raw)) add_jpeg(*jpeg, out);
    }
  } else if (starts_with(file, "FUJIFILMCCD-RAW "sv)) {
    add_raf(file, out);
  } else if (file.size() > 12 && starts_with(file.subspan(4), "ftypcrx "sv)) {
    add_cr3(file, out);
  }
  return out;
}

}  // namespace lowlux::capture
