#include "capture/dng/tiff_directory.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace lowlux::capture {
namespace {

constexpr std::array<std::uint16_t, 4> raw_marks{42, 0x4F52, 0x5352, 0x55};  // TIFF; "RO" and "RS" of ORF; RW2

constexpr std::uint16_t big_tiff_mark = 43;
constexpr std::uint64_t max_entries = 65535;  // of a directory, as in a classic TIFF

/// The sizes of the parts of a directory.
struct Layout {
  std::size_t count_bytes, entry_bytes, offset_bytes;  // an offset or short values take the last bytes of an entry
};
constexpr Layout layout_of(bool is_big_tiff) { return is_big_tiff ? Layout{8, 20, 8} : Layout{2, 12, 4}; }

/// Loads an offset, or the count of an entry's values.
std::uint64_t load_offset(const std::byte* at, bool big_endian, bool is_big_tiff) {
  return is_big_tiff ? load_u64(at, big_endian) : load_u32(at, big_endian);
}

/// Returns the size of one value, 0 for a type TIFF does not know.
std::size_t value_bytes(TiffEntry::Type type) {
  constexpr std::size_t bytes[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8};
  const auto index = static_cast<std::size_t>(type);
  return index < std::size(bytes) ? bytes[index] : 0;
}

double quotient(double numerator, double denominator) {
  if (denominator != 0) return numerator / denominator;
  return numerator == 0 ? std::numeric_limits<double>::quiet_NaN()
                        : std::copysign(std::numeric_limits<double>::infinity(), numerator);
}

std::string plural(std::uint64_t count) { return std::to_string(count) + (count == 1 ? " value" : " values"); }

/// Reads an entry. One whose values lie outside the file is kept as such: whether that matters depends on its use.
TiffEntry read_entry(std::span<const std::byte> file, const std::byte* at, bool big_endian, bool is_big_tiff) {
  const Layout layout = layout_of(is_big_tiff);
  TiffEntry entry;
  entry.id = load_u16(at, big_endian);
  entry.place = static_cast<std::size_t>(at - file.data());
  entry.type = static_cast<TiffEntry::Type>(load_u16(at + 2, big_endian));
  entry.count = load_offset(at + 4, big_endian, is_big_tiff);
  entry.big_endian = big_endian;
  const std::byte* const last = at + layout.entry_bytes - layout.offset_bytes;
  if (entry.count > file.size()) return entry;
  const std::size_t length = static_cast<std::size_t>(entry.count) * value_bytes(entry.type);
  if (length <= layout.offset_bytes) {
    entry.values = {last, length};
    entry.inside_file = true;
    return entry;
  }
  const std::uint64_t offset = load_offset(last, big_endian, is_big_tiff);
  if (length <= file.size() && offset <= file.size() - length) {
    entry.values = file.subspan(static_cast<std::size_t>(offset), length);
    entry.inside_file = true;
  }
  return entry;
}

}  // namespace

std::uint16_t load_u16(const std::byte* at, bool big_endian) {
  const auto first = std::to_integer<std::uint32_t>(at[0]), second = std::to_integer<std::uint32_t>(at[1]);
  return static_cast<std::uint16_t>(big_endian ? first << 8 | second : second << 8 | first);
}

std::uint32_t load_u32(const std::byte* at, bool big_endian) {
  const std::uint32_t first = load_u16(at, big_endian), second = load_u16(at + 2, big_endian);
  return big_endian ? first << 16 | second : second << 16 | first;
}

std::uint64_t load_u64(const std::byte* at, bool big_endian) {
  const std::uint64_t first = load_u32(at, big_endian), second = load_u32(at + 4, big_endian);
  return big_endian ? first << 32 | second : second << 32 | first;
}

float load_f32(const std::byte* at, bool big_endian) { return std::bit_cast<float>(load_u32(at, big_endian)); }

double load_f64(const std::byte* at, bool big_endian) { return std::bit_cast<double>(load_u64(at, big_endian)); }

bool TiffEntry::is_numeric() const { return inside_file && value_bytes(type) > 0 && type != Type::ascii; }

double TiffEntry::number(std::size_t i) const {
  const std::byte* at = values.data() + i * value_bytes(type);
  switch (type) {
    case Type::byte:
    case Type::ascii:
    case Type::undefined:
      return std::to_integer<int>(*at);
    case Type::sbyte:
      return std::to_integer<std::int8_t>(*at);
    case Type::u16:
      return load_u16(at, big_endian);
    case Type::s16:
      return static_cast<std::int16_t>(load_u16(at, big_endian));
    case Type::u32:
    case Type::ifd:
      return load_u32(at, big_endian);
    case Type::s32:
      return static_cast<std::int32_t>(load_u32(at, big_endian));
    case Type::rational:
      return quotient(load_u32(at, big_endian), load_u32(at + 4, big_endian));
    case Type::srational:
      return quotient(static_cast<std::int32_t>(load_u32(at, big_endian)),
                      static_cast<std::int32_t>(load_u32(at + 4, big_endian)));
    case Type::f32:
      return load_f32(at, big_endian);
    case Type::f64:
      return load_f64(at, big_endian);
    case Type::u64:
    case Type::ifd64:
      return static_cast<double>(load_u64(at, big_endian));
    case Type::s64:
      return static_cast<double>(static_cast<std::int64_t>(load_u64(at, big_endian)));
  }
  return std::numeric_limits<double>::quiet_NaN();
}

std::string TiffEntry::text() const {
  std::string out;
  for (const std::byte b : values) {
    const char c = std::to_integer<char>(b);
    if (c == '\0') break;
    if (c >= ' ' && c <= '~') out.push_back(c);
  }
  const std::size_t first = out.find_first_not_of(' ');
  if (first == std::string::npos) return {};
  return out.substr(first, out.find_last_not_of(' ') - first + 1);
}

const TiffEntry* TiffDirectory::find(TagName tag) const {
  const auto at = std::find_if(entries.begin(), entries.end(), [tag](const TiffEntry& e) { return e.id == tag.id; });
  return at == entries.end() ? nullptr : &*at;
}

Result<std::optional<std::vector<double>>> TiffDirectory::numbers(TagName tag, std::size_t min_count,
                                                                  std::size_t max_count) const {
  const TiffEntry* entry = find(tag);
  if (entry == nullptr) return std::nullopt;
  if (value_bytes(entry->type) == 0 || entry->type == TiffEntry::Type::ascii) {
    return fail(ErrorCode::malformed, std::string("the tag ") + tag.name + " does not hold numbers", tag.name);
  }
  if (entry->count < min_count || entry->count > max_count) {
    std::string expected = plural(min_count);
    if (min_count != max_count) expected = std::to_string(min_count) + " to " + plural(max_count);
    return fail(ErrorCode::malformed,
                std::string("the tag ") + tag.name + " has " + plural(entry->count) + ", expected " + expected,
                tag.name);
  }
  if (!entry->inside_file) {
    return fail(ErrorCode::malformed,
                std::string("the values of the tag ") + tag.name +
                    " lie beyond the end of the file: it is truncated or damaged",
                tag.name);
  }
  std::vector<double> values(entry->count);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = entry->number(i);
  return values;
}

Result<std::optional<std::uint32_t>> TiffDirectory::whole(TagName tag) const {
  const TiffEntry* entry = find(tag);
  if (entry == nullptr) return std::nullopt;
  if (entry->count > 0 && entry->is_numeric()) {
    const double value = entry->number(0);
    if (value >= 0 && value <= 4294967295.0 && value == std::floor(value)) return static_cast<std::uint32_t>(value);
  }
  return fail(ErrorCode::malformed, std::string("the tag ") + tag.name + " does not hold a whole number", tag.name);
}

Result<std::uint32_t> TiffDirectory::whole_or(TagName tag, std::uint32_t otherwise) const {
  return whole(tag).map([otherwise](auto found) { return found.value_or(otherwise); });
}

std::string TiffDirectory::text(TagName tag) const {
  const TiffEntry* entry = find(tag);
  return entry != nullptr && entry->type == TiffEntry::Type::ascii ? entry->text() : std::string();
}

Result<std::span<const std::byte>> TiffDirectory::bytes(TagName tag) const {
  const TiffEntry* entry = find(tag);
  if (entry == nullptr) return std::span<const std::byte>{};
  if (value_bytes(entry->type) == 0) {
    return fail(ErrorCode::malformed, std::string("the tag ") + tag.name + " has a type that TIFF does not know",
                tag.name);
  }
  if (!entry->inside_file) {
    return fail(
        ErrorCode::malformed,
        std::string("the bytes of the tag ") + tag.name + " lie beyond the end of the file: it is truncated or damaged",
        tag.name);
  }
  return entry->values;
}

std::optional<TiffFile> TiffFile::open(std::span<const std::byte> bytes) {
  return open_marked(bytes, std::span(raw_marks).first(1));
}

std::optional<TiffFile> TiffFile::open_raw(std::span<const std::byte> bytes) { return open_marked(bytes, raw_marks); }

std::optional<TiffFile> TiffFile::open_marked(std::span<const std::byte> bytes, std::span<const std::uint16_t> marks) {
  if (bytes.size() < 8) return std::nullopt;
  const char first = std::to_integer<char>(bytes[0]), second = std::to_integer<char>(bytes[1]);
  if (first != second || (first != 'I' && first != 'M')) return std::nullopt;
  const bool big_endian = first == 'M';
  const std::uint16_t mark = load_u16(bytes.data() + 2, big_endian);
  if (mark == big_tiff_mark) {  // then the size of offsets, a zero, and the first offset
    const bool is_good = bytes.size() >= 16 && load_u32(bytes.data() + 4, big_endian) == (big_endian ? 8U << 16U : 8U);
    if (!is_good) return std::nullopt;
    return TiffFile(bytes, big_endian, true, load_u64(bytes.data() + 8, big_endian));
  }
  if (std::find(marks.begin(), marks.end(), mark) == marks.end()) return std::nullopt;
  return TiffFile(bytes, big_endian, false, load_u32(bytes.data() + 4, big_endian));
}

Result<TiffDirectory> TiffFile::directory(std::uint64_t offset) const {
  const auto outside = [offset] {
    return fail(ErrorCode::malformed, "the tag directory at byte " + std::to_string(offset) +
                                          " lies beyond the end of the file: it is truncated or damaged");
  };
  const Layout layout = layout_of(is_big_tiff_);
  if (offset > bytes_.size() || bytes_.size() - offset < layout.count_bytes) return outside();
  const std::byte* const start = bytes_.data() + offset;
  const std::uint64_t count = is_big_tiff_ ? load_u64(start, big_endian_) : load_u16(start, big_endian_);
  const std::size_t first = static_cast<std::size_t>(offset) + layout.count_bytes;
  if (count > (bytes_.size() - first) / layout.entry_bytes) return outside();
  if (count > max_entries) {
    return fail(ErrorCode::malformed, "the tag directory at byte " + std::to_string(offset) + " has " +
                                          std::to_string(count) + " tags: the file is damaged");
  }
  TiffDirectory directory;
  directory.big_endian = big_endian_;
  directory.is_big_tiff = is_big_tiff_;
  directory.entries.reserve(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < count; ++i) {
    const std::byte* const at = bytes_.data() + first + i * layout.entry_bytes;
    directory.entries.push_back(read_entry(bytes_, at, big_endian_, is_big_tiff_));
  }
  const std::size_t end = first + static_cast<std::size_t>(count) * layout.entry_bytes;
  if (bytes_.size() - end >= layout.offset_bytes) {
    directory.next = load_offset(bytes_.data() + end, big_endian_, is_big_tiff_);
  }
  return directory;
}

}  // namespace lowlux::capture
