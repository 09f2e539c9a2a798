#include "tests/support/dng/dng_builder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "isp/base/plane.h"
#include "isp/codec/lossless_jpeg.h"

namespace lowlux::test {
namespace {

std::vector<std::byte> packed_rows(const DngBuilder& dng, const std::vector<std::uint16_t>& pixels) {
  ByteWriter writer(dng.big_endian);
  const int stride = dng.width * dng.samples;
  for (int y = 0; y < dng.height; ++y) {
    std::uint32_t pending = 0;
    int pending_bits = 0;
    for (int i = 0; i < stride; ++i) {
      const std::uint16_t sample = pixels[static_cast<std::size_t>(y) * stride + i];
      if (dng.bits == 16) {
        writer.number(sample, 2);
        continue;
      }
      pending = pending << dng.bits | sample;
      for (pending_bits += dng.bits; pending_bits >= 8; pending_bits -= 8) {
        writer.number(pending >> (pending_bits - 8) & 255, 1);
      }
    }
    if (pending_bits > 0) writer.number(pending << (8 - pending_bits) & 255, 1);
  }
  return writer.out;
}

/// Encodes one tile or strip as lossless JPEG; what lies outside of the image repeats its last row and column.
std::vector<std::byte> jpeg_part(const DngBuilder& dng, const std::vector<std::uint16_t>& pixels, int x0, int y0,
                                 int width, int height) {
  const int components = dng.samples == 1 ? dng.jpeg_components : dng.samples;
  Plane<std::uint16_t> part(width * dng.samples / components * components, height);
  for (int y = 0; y < height; ++y) {
    for (int i = 0; i < part.width(); ++i) {
      const int from_x = std::min(x0 + i / dng.samples, dng.width - 1), from_y = std::min(y0 + y, dng.height - 1);
      const std::size_t pixel = static_cast<std::size_t>(from_y) * dng.width + from_x;
      part.view().row(y)[i] = pixels[pixel * dng.samples + i % dng.samples];
    }
  }
  return isp::encode_lossless_jpeg(std::as_const(part).view(), components, dng.bits);
}

std::vector<std::vector<std::byte>> image_parts(const DngBuilder& dng) {
  if (!dng.stored_parts.empty()) return dng.stored_parts;
  const std::vector<std::uint16_t> pixels = dng.pixels.empty() ? ramp(dng) : dng.pixels;
  std::vector<std::vector<std::byte>> parts;
  if (dng.storage == DngStorage::lossless_jpeg) {
    const int strip = dng.rows_per_strip > 0 ? dng.rows_per_strip : dng.height;
    for (int y = 0; y < dng.height; y += strip) {
      parts.push_back(jpeg_part(dng, pixels, 0, y, dng.width, std::min(strip, dng.height - y)));
    }
    return parts;
  }
  if (dng.storage == DngStorage::tiled_lossless_jpeg) {
    for (int y = 0; y < dng.height; y += dng.tile_height) {
      for (int x = 0; x < dng.width; x += dng.tile_width) {
        parts.push_back(jpeg_part(dng, pixels, x, y, dng.tile_width, dng.tile_height));
      }
    }
    return parts;
  }
  const std::vector<std::byte> all = packed_rows(dng, pixels);
  const int rows = dng.rows_per_strip > 0 ? dng.rows_per_strip : dng.height;
  const std::size_t row_bytes = all.size() / dng.height;
  for (int y = 0; y < dng.height; y += rows) {
    const auto first = all.begin() + static_cast<std::ptrdiff_t>(y * row_bytes);
    parts.emplace_back(first, first + static_cast<std::ptrdiff_t>(std::min(rows, dng.height - y) * row_bytes));
  }
  return parts;
}

Tag one(TagType type, double value) { return Tag::numbers(type, {value}); }

/// Returns whether a tag belongs to the image data; all others go into the first directory.
bool belongs_to_image(std::uint16_t id) {
  constexpr std::uint16_t others[] = {322,   323,   324,   325,   33421, 33422, 50710, 50711,
                                      50712, 50713, 50714, 50715, 50716, 50717, 50718, 50719,
                                      50720, 50829, 50830, 51008, 51009, 51022, 51041};
  return (id >= 254 && id <= 262) || id == 273 || (id >= 277 && id <= 284) || id == 317 || id == 339 ||
         std::find(std::begin(others), std::end(others), id) != std::end(others);
}

bool belongs_to_exif(std::uint16_t id) {
  return id == 33434 || id == 33437 || (id >= 34850 && id <= 34867 && id != 34853) || (id >= 36864 && id <= 42080);
}

void add_image_tags(const DngBuilder& dng, const std::vector<double>& offsets, const std::vector<double>& sizes,
                    TagDirectory& directory) {
  const bool tiled = dng.stored_parts.empty() ? dng.storage == DngStorage::tiled_lossless_jpeg : dng.parts_are_tiles;
  const bool mosaic = dng.samples == 1 && !dng.monochrome;
  directory[254] = one(TagType::u32, 0);
  directory[256] = one(TagType::u32, dng.width);
  directory[257] = one(TagType::u32, dng.height);
  directory[258] = Tag::numbers(TagType::u16, std::vector<double>(dng.samples, dng.bits));
  directory[259] = one(TagType::u16, dng.storage == DngStorage::uncompressed ? 1 : 7);
  directory[262] = one(TagType::u16, mosaic ? 32803 : 34892);
  directory[277] = one(TagType::u16, dng.samples);
  directory[284] = one(TagType::u16, 1);
  directory[tiled ? 324 : 273] = Tag::numbers(TagType::u32, offsets);
  directory[tiled ? 325 : 279] = Tag::numbers(TagType::u32, sizes);
  if (tiled) {
    directory[322] = one(TagType::u32, dng.tile_width);
    directory[323] = one(TagType::u32, dng.tile_height);
  } else {
    directory[278] = one(TagType::u32, dng.rows_per_strip > 0 ? dng.rows_per_strip : dng.height);
  }
  if (mosaic) {
    std::vector<double> pattern(4);
    for (int i = 0; i < 4; ++i) pattern[i] = static_cast<double>(colour_at(dng.phase, i & 1, i >> 1));
    directory[33421] = Tag::numbers(TagType::u16, {2, 2});
    directory[33422] = Tag::numbers(TagType::byte, pattern);
  }
  directory[50714] = Tag::numbers(TagType::u16, std::vector<double>(dng.samples, 64));
  directory[50717] = Tag::numbers(TagType::u32, std::vector<double>(dng.samples, std::exp2(dng.bits) - 1));
}

void add_camera_tags(const DngBuilder& dng, TagDirectory& directory) {
  directory[271] = Tag::text("Test");
  directory[272] = Tag::text("Camera");
  directory[274] = one(TagType::u16, 1);
  directory[50706] = Tag::numbers(TagType::byte, {1, 4, 0, 0});
  directory[50707] = Tag::numbers(TagType::byte, {1, 1, 0, 0});
  directory[50708] = Tag::text("Test Camera");
  if (dng.monochrome) return;
  directory[50721] = Tag::numbers(TagType::srational, {0.7, -0.2, -0.07, -0.45, 1.25, 0.22, -0.08, 0.18, 0.65});
  directory[50728] = Tag::numbers(TagType::rational, {0.5, 1, 0.6});
  directory[50778] = one(TagType::u16, 21);
}

void add_preview_tags(double offset, TagDirectory& directory) {
  directory[254] = one(TagType::u32, 1);
  directory[256] = one(TagType::u32, 4);
  directory[257] = one(TagType::u32, 4);
  directory[258] = Tag::numbers(TagType::u16, {8, 8, 8});
  directory[259] = one(TagType::u16, 1);
  directory[262] = one(TagType::u16, 2);
  directory[273] = one(TagType::u32, offset);
  directory[277] = one(TagType::u16, 3);
  directory[278] = one(TagType::u32, 4);
  directory[279] = one(TagType::u32, 48);
  directory[284] = one(TagType::u16, 1);
}

}  // namespace

DngBuilder& DngBuilder::set(std::uint16_t id, Tag tag) {
  set_[id] = std::move(tag);
  removed_.erase(id);
  return *this;
}

DngBuilder& DngBuilder::remove(std::uint16_t id) {
  removed_.insert(id);
  return *this;
}

std::vector<double> DngBuilder::part_offsets(const Parts& parts, std::size_t data) const {
  std::vector<double> offsets(parts.size());
  auto next = static_cast<double>(data);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t part = parts_reversed ? parts.size() - 1 - i : i;
    offsets[part] = next;
    next += static_cast<double>(parts[part].size() + static_cast<std::size_t>(part_gap));
  }
  return offsets;
}

DngBuilder::Directories DngBuilder::directories(const Parts& parts, const Offsets& at) const {
  Directories out;
  const std::vector<double> offsets = part_offsets(parts, at.data);
  std::vector<double> sizes;
  auto next = static_cast<double>(at.data);
  for (const auto& part : parts) {
    sizes.push_back(static_cast<double>(part.size()));
    next += static_cast<double>(part.size() + static_cast<std::size_t>(part_gap));
  }
  add_image_tags(*this, offsets, sizes, raw_in_sub_ifd ? out.raw : out.main);
  add_camera_tags(*this, out.main);
  if (raw_in_sub_ifd) {
    add_preview_tags(next, out.main);
    out.main[330] = one(TagType::u32, static_cast<double>(at.raw));
  }
  for (const auto& [id, tag] : set_) {
    TagDirectory& home = belongs_to_exif(id) ? out.exif : (raw_in_sub_ifd && belongs_to_image(id) ? out.raw : out.main);
    home[id] = tag;
  }
  if (!out.exif.empty()) out.main[34665] = one(TagType::u32, static_cast<double>(at.exif));
  for (const std::uint16_t id : removed_) {
    out.main.erase(id);
    out.raw.erase(id);
  }
  return out;
}

std::vector<std::byte> DngBuilder::build() const {
  const Parts parts = image_parts(*this);
  Offsets at;
  std::vector<std::byte> main, exif, raw;
  const std::size_t header = big_tiff ? 16 : 8;
  // The first round finds the sizes of the directories, the second writes them with the offsets that follow.
  for (int round = 0; round < 2; ++round) {
    const Directories all = directories(parts, at);
    main = encode_directory(all.main, header, big_endian, big_tiff);
    at.exif = header + main.size();
    if (!all.exif.empty()) exif = encode_directory(all.exif, at.exif, big_endian, big_tiff);
    at.raw = at.exif + exif.size();
    if (raw_in_sub_ifd) raw = encode_directory(all.raw, at.raw, big_endian, big_tiff);
    at.data = at.raw + raw.size();
  }
  ByteWriter file(big_endian);
  file.append(std::vector<std::byte>(2, big_endian ? std::byte{'M'} : std::byte{'I'}));
  file.number(big_tiff ? 43 : 42, 2);
  if (big_tiff) {
    file.number(8, 2);
    file.number(0, 2);
  }
  file.number(header, static_cast<int>(header / 2));
  for (const auto* directory : {&main, &exif, &raw}) file.append(*directory);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    file.append(parts[parts_reversed ? parts.size() - 1 - i : i]);
    file.append(std::vector<std::byte>(static_cast<std::size_t>(part_gap), std::byte{0xA5}));
  }
  if (raw_in_sub_ifd) file.append(std::vector<std::byte>(48, std::byte{128}));
  return file.out;
}

std::vector<std::uint16_t> ramp(const DngBuilder& dng) {
  const std::uint32_t top = (1U << dng.bits) - 1;
  std::vector<std::uint16_t> samples(static_cast<std::size_t>(dng.width) * dng.height * dng.samples);
  std::uint32_t state = 1;
  for (auto& sample : samples) {
    state = state * 1664525U + 1013904223U;
    sample = static_cast<std::uint16_t>(state >> 8 & top);
  }
  if (samples.size() > 1) {
    samples.front() = static_cast<std::uint16_t>(top);
    samples.back() = 0;
  }
  return samples;
}

}  // namespace lowlux::test
