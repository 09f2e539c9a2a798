#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isp/base/result.h"

namespace lowlux::capture {

/// A tag: number, and name in its specification (TIFF 6.0, DNG 1.4, EXIF 2.31).
struct TagName {
  std::uint16_t id;
  const char* name;
};

/// One entry of a TIFF directory. Its values are not copied from the bytes of the file.
class TiffEntry {
 public:
  enum class Type : std::uint16_t {
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
    ifd,
    u64 = 16,  // this and the next two: of BigTIFF
    s64,
    ifd64
  };

  std::uint16_t id = 0;
  std::size_t place = 0;  // offset of the entry in the file
  Type type = Type::byte;
  std::uint64_t count = 0;
  bool big_endian = false;
  bool inside_file = false;  // false: `values` is empty because they lie outside the file
  std::span<const std::byte> values;

  /// Returns whether the values are numbers that can be read.
  bool is_numeric() const;
  /// Returns value i, for any numeric type; a rational n/0 is infinite, and 0/0 is NaN.
  /// Precondition: i < count, is_numeric().
  double number(std::size_t i) const;
  /// Returns the text up to the first NUL, without unprintable characters and without blanks at both ends.
  std::string text() const;
};

/// A directory of a TIFF file.
class TiffDirectory {
 public:
  std::vector<TiffEntry> entries;
  bool big_endian = false;   // of the file
  bool is_big_tiff = false;  // of a file with offsets of 64 bits
  std::uint64_t next = 0;    // offset of the next directory; 0: none

  /// Returns the entry of a tag; nullptr if there is none.
  const TiffEntry* find(TagName tag) const;

  /// Returns the values of a tag; nullopt if there is no such tag. Fails if they lie outside the file, or are not
  /// numbers, or if their count is not within the limits, which are checked before memory is allocated.
  Result<std::optional<std::vector<double>>> numbers(TagName tag, std::size_t min_count, std::size_t max_count) const;
  /// Returns the first value of a tag that must be an integer from 0 to 2^32 - 1; nullopt if there is no such tag.
  Result<std::optional<std::uint32_t>> whole(TagName tag) const;
  /// Returns the value of whole(), or `otherwise` without the tag.
  Result<std::uint32_t> whole_or(TagName tag, std::uint32_t otherwise) const;
  /// Returns the text of a tag; empty if there is no such tag.
  std::string text(TagName tag) const;
  /// Returns the bytes of a tag of any type; empty if there is no such tag. Fails if they lie outside the file.
  Result<std::span<const std::byte>> bytes(TagName tag) const;
};

/// A TIFF file held in memory, with its directories. Nothing is copied: `bytes` must outlive it and all it returns.
class TiffFile {
 public:
  /// Opens a TIFF; nullopt if the bytes begin neither as a classic (32-bit) TIFF nor as a BigTIFF (64-bit).
  static std::optional<TiffFile> open(std::span<const std::byte> bytes);
  /// Opens a TIFF, or a raw file that is one but for its mark: ORF and RW2.
  static std::optional<TiffFile> open_raw(std::span<const std::byte> bytes);

  std::uint64_t first_directory() const { return first_directory_; }
  /// Returns the directory at an offset; fails if it does not lie inside the file.
  Result<TiffDirectory> directory(std::uint64_t offset) const;

 private:
  static std::optional<TiffFile> open_marked(std::span<const std::byte> bytes, std::span<const std::uint16_t> marks);
  TiffFile(std::span<const std::byte> bytes, bool big_endian, bool is_big_tiff, std::uint64_t first)
      : bytes_(bytes), big_endian_(big_endian), is_big_tiff_(is_big_tiff), first_directory_(first) {}

  std::span<const std::byte> bytes_;
  bool big_endian_, is_big_tiff_;
  std::uint64_t first_directory_;
};

/// Each loads an unsigned or floating-point number in a stated byte order. Precondition: enough bytes.
std::uint16_t load_u16(const std::byte* at, bool big_endian);
std::uint32_t load_u32(const std::byte* at, bool big_endian);
std::uint64_t load_u64(const std::byte* at, bool big_endian);
float load_f32(const std::byte* at, bool big_endian);
double load_f64(const std::byte* at, bool big_endian);

}  // namespace lowlux::capture
