#include "tests/support/dng/tiff_writer.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>

namespace lowlux::test {
namespace {

std::uint64_t whole(double value) {
  return value < 0 ? static_cast<std::uint64_t>(static_cast<std::int64_t>(value)) : static_cast<std::uint64_t>(value);
}

std::vector<std::byte> encoded(const Tag& tag, bool big_endian) {
  if (!tag.bytes.empty()) return tag.bytes;
  ByteWriter writer(big_endian);
  for (const auto& [value, denominator] : tag.values) {
    switch (tag.type) {
      case TagType::u16:
      case TagType::s16:
        writer.number(whole(value), 2);
        break;
      case TagType::u32:
      case TagType::s32:
        writer.number(whole(value), 4);
        break;
      case TagType::rational:
      case TagType::srational:
        writer.number(whole(value), 4);
        writer.number(whole(denominator), 4);
        break;
      case TagType::f32:
        writer.number(std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4);
        break;
      case TagType::u64:
        writer.number(whole(value), 8);
        break;
      case TagType::f64:
        writer.number(std::bit_cast<std::uint64_t>(value), 8);
        break;
      default:
        writer.number(whole(value), 1);
    }
  }
  return writer.out;
}

}  // namespace

Tag Tag::numbers(TagType type, const std::vector<double>& values) {
  const bool rational = type == TagType::rational || type == TagType::srational;
  Tag tag{type, {}, {}};
  for (const double value : values) {
    tag.values.emplace_back(rational ? std::round(value * 10000) : value, rational ? 10000.0 : 1.0);
  }
  return tag;
}

Tag Tag::rationals(TagType type, std::vector<std::pair<double, double>> values) {
  return {type, std::move(values), {}};
}

Tag Tag::text(const char* text) {
  Tag tag{TagType::ascii, {}, {}};
  for (const char c : std::string_view(text, std::strlen(text) + 1)) tag.values.emplace_back(c, 1);
  return tag;
}

Tag Tag::opaque(std::vector<std::byte> bytes) { return {TagType::undefined, {}, std::move(bytes)}; }

std::vector<std::byte> encode_directory(const TagDirectory& directory, std::size_t offset, bool big_endian,
                                        bool big_tiff) {
  ByteWriter entries(big_endian), values(big_endian);
  const int word = big_tiff ? 8 : 4;  // bytes of a count or an offset
  const std::size_t count_bytes = big_tiff ? 8 : 2;
  const std::size_t values_offset = offset + count_bytes + directory.size() * (4 + 2 * word) + word;
  entries.number(directory.size(), static_cast<int>(count_bytes));
  for (const auto& [id, tag] : directory) {
    std::vector<std::byte> bytes = encoded(tag, big_endian);
    entries.number(id, 2);
    entries.number(static_cast<std::uint16_t>(tag.type), 2);
    entries.number(tag.bytes.empty() ? tag.values.size() : bytes.size(), word);
    if (bytes.size() <= static_cast<std::size_t>(word)) {
      bytes.resize(word);
      entries.append(bytes);
    } else {
      entries.number(values_offset + values.out.size(), word);
      values.append(bytes);
      if (values.out.size() % 2 != 0) values.out.push_back(std::byte{0});
    }
  }
  entries.number(0, word);
  entries.append(values.out);
  if (entries.out.size() % 2 != 0) entries.out.push_back(std::byte{0});
  return entries.out;
}

void append_u32(std::vector<std::byte>& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::byte>(value >> shift & 255));
}

void append_f32(std::vector<std::byte>& out, float value) { append_u32(out, std::bit_cast<std::uint32_t>(value)); }

void append_f64(std::vector<std::byte>& out, double value) {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  append_u32(out, static_cast<std::uint32_t>(bits >> 32));
  append_u32(out, static_cast<std::uint32_t>(bits));
}

}  // namespace lowlux::test
