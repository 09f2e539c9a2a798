#include "isp/codec/source_tags_output.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <limits>
#include <map>
#include <span>
#include <vector>

#include "isp/codec/picture_file.h"

namespace lowlux::isp {
namespace {

constexpr std::uint16_t caption = 270, artist = 315, copyright = 33432, exif_pointer = 34665, gps_pointer = 34853,
                        maker_note = 37500, unique_camera_model = 50708;
constexpr std::uint16_t type_long = 4;
constexpr std::size_t entry_bytes = 12, longest_in_picture = 4096;
constexpr std::size_t most_in_picture = 48 * 1024;  // in all: a JPEG holds 64 KiB of EXIF

using Entry = std::array<std::byte, entry_bytes>;
using Directory = std::map<std::uint16_t, Entry>;  // by tag, which is the order that TIFF requires

std::uint32_t load(const std::byte* at, int bytes) {
  std::uint32_t value = 0;
  for (int i = bytes - 1; i >= 0; --i) value = value << 8 | std::to_integer<std::uint32_t>(at[i]);
  return value;
}

void store(std::byte* at, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) at[i] = static_cast<std::byte>(value >> (8 * i) & 255);
}

Entry entry_of(std::uint16_t id, std::uint16_t type, std::uint32_t count) {
  Entry entry{};
  store(entry.data(), id, 2);
  store(entry.data() + 2, type, 2);
  store(entry.data() + 4, count, 4);
  return entry;
}

/// Reads and extends a TIFF. After the first failure nothing else is done.
class Extender {
 public:
  explicit Extender(std::FILE* file) : file_(file) {
    good_ = std::fseek(file_, 0, SEEK_END) == 0;
    const long end = std::ftell(file_);
    good_ = good_ && end >= 0;
    end_ = static_cast<std::uint32_t>(end);
  }

  bool good() const { return good_; }

  void read(std::uint32_t offset, std::span<std::byte> to) {
    good_ = good_ && std::fseek(file_, static_cast<long>(offset), SEEK_SET) == 0 &&
            std::fread(to.data(), 1, to.size(), file_) == to.size();
  }
  void write(std::uint32_t offset, std::span<const std::byte> bytes) {
    good_ = good_ && std::fseek(file_, static_cast<long>(offset), SEEK_SET) == 0 &&
            std::fwrite(bytes.data(), 1, bytes.size(), file_) == bytes.size();
  }

  /// Appends bytes at an even offset, as TIFF requires, and returns it.
  std::uint32_t append(std::span<const std::byte> bytes) {
    constexpr std::array<std::byte, 1> zero{};
    if (end_ % 2 != 0) write(end_++, zero);
    const std::uint32_t at = end_;
    write(at, bytes);
    end_ += static_cast<std::uint32_t>(bytes.size());
    return at;
  }

  Directory directory(std::uint32_t offset) {
    std::array<std::byte, 2> count{};
    read(offset, count);
    std::vector<std::byte> bytes(good_ ? entry_bytes * load(count.data(), 2) : 0);
    read(offset + 2, bytes);
    Directory out;
    for (std::size_t at = 0; good_ && at < bytes.size(); at += entry_bytes) {
      Entry entry{};
      std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), entry_bytes, entry.begin());
      out.emplace(static_cast<std::uint16_t>(load(entry.data(), 2)), entry);
    }
    return out;
  }

  std::uint32_t append(const Directory& directory) {
    std::vector<std::byte> bytes(2 + entry_bytes * directory.size() + 4);
    store(bytes.data(), static_cast<std::uint32_t>(directory.size()), 2);
    std::size_t at = 2;
    for (const auto& [id, entry] : directory) {
      std::copy(entry.begin(), entry.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
      at += entry_bytes;
    }
    return append(bytes);
  }

  void add(Directory& directory, const std::vector<SourceTag>& tags) {
    for (const SourceTag& tag : tags) {
      if (tag.id != unique_camera_model && directory.contains(tag.id)) continue;
      Entry entry = entry_of(tag.id, tag.type, tag.count);
      if (tag.values.size() <= 4) {
        std::copy(tag.values.begin(), tag.values.end(), entry.begin() + 8);
      } else {
        store(entry.data() + 8, append(tag.values), 4);
      }
      directory[tag.id] = entry;
    }
  }

  /// Sets the offset of a directory of its own in the main directory.
  void point(Directory& main, std::uint16_t id, const Directory& directory) {
    if (directory.empty()) return;
    Entry entry = entry_of(id, type_long, 1);
    store(entry.data() + 8, append(directory), 4);
    main[id] = entry;
  }

 private:
  std::FILE* file_;
  bool good_ = true;
  std::uint32_t end_ = 0;
};

/// Returns whether a file and what is added to it stay below the 4 GiB that offsets of 32 bits reach.
bool has_room(std::FILE* file, const SourceTags& tags) {
  constexpr std::uint64_t reach = std::numeric_limits<std::uint32_t>::max(), directories = 1 << 20;
  if (std::fseek(file, 0, SEEK_END) != 0) return false;
  const long end = std::ftell(file);
  std::uint64_t bytes = directories;
  for (const auto* list : {&tags.main, &tags.exif, &tags.gps}) {
    for (const SourceTag& tag : *list) bytes += tag.values.size() + 1;
  }
  return end >= 0 && static_cast<std::uint64_t>(end) + bytes <= reach;
}

}  // namespace

Result<void> add_source_tags(std::FILE* file, const SourceTags& tags) {
  if (!has_room(file, tags)) return {};
  constexpr std::array<std::byte, 4> classic{std::byte{'I'}, std::byte{'I'}, std::byte{42}, std::byte{0}};
  Extender out(file);
  std::array<std::byte, 8> header{};
  out.read(0, header);
  if (out.good() && !std::equal(classic.begin(), classic.end(), header.begin())) return {};
  Directory main = out.directory(load(header.data() + 4, 4));
  Directory exif;
  if (const auto at = main.find(exif_pointer); at != main.end()) exif = out.directory(load(at->second.data() + 8, 4));
  out.add(main, tags.main);
  out.add(exif, tags.exif);
  Directory gps;
  out.add(gps, tags.gps);
  out.point(main, exif_pointer, exif);
  out.point(main, gps_pointer, gps);
  store(header.data() + 4, out.append(main), 4);
  out.write(0, header);
  return out.good() ? Result<void>{} : write_failure();
}

SourceTags picture_tags(const SourceTags& tags) {
  SourceTags out;
  std::size_t bytes = 0;
  const auto keep = [&](const std::vector<SourceTag>& from, std::vector<SourceTag>& to, const auto& is_wanted) {
    for (const SourceTag& tag : from) {
      const std::size_t more = entry_bytes + tag.values.size();
      if (!is_wanted(tag) || bytes + more > most_in_picture) continue;
      bytes += more;
      to.push_back(tag);
    }
  };
  const auto is_short = [](const SourceTag& tag) { return tag.values.size() <= longest_in_picture; };
  keep(tags.main, out.main, [&](const SourceTag& tag) {
    return is_short(tag) && (tag.id == caption || tag.id == artist || tag.id == copyright);
  });
  keep(tags.gps, out.gps, is_short);
  keep(tags.exif, out.exif, [&](const SourceTag& tag) { return is_short(tag) && tag.id != maker_note; });
  return out;
}

}  // namespace lowlux::isp
