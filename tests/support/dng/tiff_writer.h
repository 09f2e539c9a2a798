#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace lowlux::test {

/// Lists the types of tag values, TIFF 6.0 section 2.
enum class TagType : std::uint16_t {
  byte = 1,
  ascii,
  u16,
  u32,
  rational,
  sbyte,
  undefined,
  s16,
  s32,
  srational,
  f32,
  f64,
  u64 = 16  // of BigTIFF
};

/// Holds one tag: its values as whole numbers (or n/d pairs, or floating point). Whatever the type states is written,
/// so that a test can state the impossible.
struct Tag {
  TagType type = TagType::u16;
  std::vector<std::pair<double, double>> values;  // the second number is used by the rational types
  std::vector<std::byte> bytes;                   // used instead of `values` if not empty

  static Tag numbers(TagType type, const std::vector<double>& values);  // rationals get the denominator 10000
  static Tag rationals(TagType type, std::vector<std::pair<double, double>> values);
  static Tag text(const char* text);
  static Tag opaque(std::vector<std::byte> bytes);  // type undefined
};

using TagDirectory = std::map<std::uint16_t, Tag>;

/// Writes bytes in a stated order.
class ByteWriter {
 public:
  explicit ByteWriter(bool big_endian) : big_endian_(big_endian) {}

  void number(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) {
      const int shift = 8 * (big_endian_ ? bytes - 1 - i : i);
      out.push_back(static_cast<std::byte>(value >> shift & 255));
    }
  }
  void append(const std::vector<std::byte>& bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); }

  std::vector<std::byte> out;

 private:
  bool big_endian_;
};

/// Writes a directory that begins at byte `offset`, with its longer values behind it. Offsets and counts have 32 bits,
/// in a BigTIFF 64.
std::vector<std::byte> encode_directory(const TagDirectory& directory, std::size_t offset, bool big_endian,
                                        bool big_tiff = false);

/// Appends a big-endian number, for opcode lists.
void append_u32(std::vector<std::byte>& out, std::uint32_t value);
void append_f32(std::vector<std::byte>& out, float value);
void append_f64(std::vector<std::byte>& out, double value);

}  // namespace lowlux::test
