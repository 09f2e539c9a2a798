#include "capture/dng/source_tags.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "capture/dng/dng_colour.h"
#include "capture/dng/dng_file.h"
#include "capture/dng/dng_tags.h"
#include "capture/dng/tiff_directory.h"
#include "isp/base/camera_profile.h"

namespace lowlux::capture {
namespace {

/// A TIFF structure with EXIF data inside a raw file that is not a DNG.
struct ExifBlock {
  enum class First : std::uint8_t { main, exif, gps };  // what its first directory holds

  TiffFile tiff;
  First first = First::main;
};

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

/// Returns the EXIF data of a raw file, which they borrow: the file itself where it is a TIFF (CR2, NEF, ARW, PEF) or
/// one but for its mark (ORF, RW2), followed by the data of the JPEG image inside (RW2, RAF), or the boxes CMT1, CMT2
/// and CMT4 of a CR3. Where blocks have the same tag, that of the first one holds. Empty: none were found.
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

constexpr std::size_t max_bytes = std::size_t{64} << 20, max_tags = 4096;
constexpr double max_baseline_ev = 100;
constexpr TagName gps_ifd{34853, "GPSInfo"}, maker_note{37500, "MakerNote"},
    maker_note_safety{50741, "MakerNoteSafety"};
// EXIF tags that are not passed on: those of FrameInfo, which are read and written, PixelXDimension and
// PixelYDimension, and offsets of directories.
constexpr std::array<std::uint16_t, 11> own_exif_tags{33434, 33437, 34665, 34853, 34855, 36867,
                                                      37386, 37888, 40962, 40963, 40965};
constexpr std::array<TagName, 2> hue_sat_map{{{50938, "ProfileHueSatMapData1"}, {50939, "ProfileHueSatMapData2"}}};

// Caption, author, XMP, copyright, IPTC and Rating.
constexpr std::array<std::uint16_t, 6> author_tags{270, 315, 700, 18246, 33432, 33723};
// UniqueCameraModel and LocalizedCameraModel, BayerGreenSplit, BaselineSharpness, CameraSerialNumber, LensInfo,
// AntiAliasStrength, MakerNoteSafety, OriginalRawFileName, signatures, names, tables and curve of the profile,
// encodings, BaselineExposureOffset, DefaultBlackRender and DefaultUserCrop.
constexpr std::array<std::uint16_t, 26> dng_tags{50708, 50709, 50732, 50733, 50735, 50736, 50738, 50741, 50827,
                                                 50931, 50932, 50934, 50936, 50937, 50938, 50939, 50940, 50941,
                                                 50942, 50981, 50982, 51107, 51108, 51109, 51110, 51125};

/// Returns the bytes of the units whose order counts; 0 for types that are not passed on.
std::size_t unit_bytes(TiffEntry::Type type) {
  constexpr std::array<std::size_t, 13> bytes{0, 1, 1, 2, 4, 4, 1, 1, 2, 4, 4, 4, 8};
  const auto index = static_cast<std::size_t>(type);
  return index < bytes.size() ? bytes[index] : 0;
}

/// Collects tags within the limits.
class Collector {
 public:
  explicit Collector(std::vector<std::string>& warnings) : warnings_(warnings) {}

  /// Adds a tag, unless it was added before.
  /// @param kind  what a warning calls it, followed by its number
  void add(const TiffEntry& entry, std::vector<SourceTag>& to, std::string_view kind = "tag ") {
    const std::size_t unit = unit_bytes(entry.type);
    if (unit == 0 || entry.count == 0) return;
    if (std::any_of(to.begin(), to.end(), [&](const SourceTag& tag) { return tag.id == entry.id; })) return;
    if (!entry.inside_file || entry.values.size() > max_bytes - bytes_ || tags_ == max_tags) {
      if (!std::exchange(warned_, true)) {
        warnings_.push_back(std::string(kind) + std::to_string(entry.id) +
                            (entry.inside_file ? " is not copied: the tags are too many or too large"
                                               : " is not copied: its values lie beyond the end of the file"));
      }
      return;
    }
    bytes_ += entry.values.size();
    ++tags_;
    SourceTag tag{entry.id,
                  static_cast<std::uint16_t>(entry.type),
                  static_cast<std::uint32_t>(entry.count),
                  {entry.values.begin(), entry.values.end()}};
    for (std::size_t at = 0; entry.big_endian && at + unit <= tag.values.size(); at += unit) {
      const auto first = tag.values.begin() + static_cast<std::ptrdiff_t>(at);
      std::reverse(first, first + static_cast<std::ptrdiff_t>(unit));
    }
    to.push_back(std::move(tag));
  }

  void add_all(const TiffDirectory& directory, std::vector<SourceTag>& to, std::string_view kind) {
    for (const TiffEntry& entry : directory.entries) {
      const bool is_own = std::find(own_exif_tags.begin(), own_exif_tags.end(), entry.id) != own_exif_tags.end();
      if (!is_own) add(entry, to, kind);
    }
  }

  template <class Ids>
  void add_some(const Ids& ids, const TiffDirectory& main, const TiffDirectory* raw_image, std::vector<SourceTag>& to) {
    for (const std::uint16_t id : ids) {
      const TiffEntry* entry = main.find({id, ""});
      if (entry == nullptr && raw_image != nullptr) entry = raw_image->find({id, ""});
      if (entry != nullptr) add(*entry, to);
    }
  }

  void warn(std::string text) { warnings_.push_back(std::move(text)); }

 private:
  std::vector<std::string>& warnings_;
  std::size_t bytes_ = 0, tags_ = 0;
  bool warned_ = false;
};

constexpr std::string_view exif_kind = "EXIF tag ", gps_kind = "GPS tag ";

/// Adds the EXIF or GPS directory that a tag of the first directory points to, with a warning if it is damaged.
/// @param kind  of its tags in warnings
void add_directory(const TiffFile& tiff, const TiffDirectory& main, TagName pointer, std::string_view kind,
                   Collector& collector, std::vector<SourceTag>& to) {
  const auto found = main.whole(pointer).and_then([&](auto offset) -> Result<void> {
    if (offset.value_or(0) == 0) return {};  // no directory begins at the header
    return tiff.directory(*offset).map([&](const TiffDirectory& directory) { collector.add_all(directory, to, kind); });
  });
  if (found) return;
  collector.warn("the tags of " + std::string(pointer.name) + " (tag " + std::to_string(pointer.id) +
                 ") are not copied: " + found.error().message);
}

/// Exchanges the tables of the two calibrations if these were sorted (read_colour).
void follow_calibrations(const DngFile& dng, std::vector<SourceTag>& tags) {
  std::array<double, 2> cct_k{};
  for (std::size_t i = 0; i < cct_k.size(); ++i) {
    const auto light = dng.main.whole_or(tag::calibration_illuminant[i], 0);
    cct_k[i] = light ? illuminant_cct_k(*light) : 0;
  }
  if (dng.main.find(tag::color_matrix[1]) == nullptr || cct_k[0] <= cct_k[1]) return;
  for (SourceTag& tag : tags) {
    if (tag.id == hue_sat_map[0].id) {
      tag.id = hue_sat_map[1].id;
    } else if (tag.id == hue_sat_map[1].id) {
      tag.id = hue_sat_map[0].id;
    }
  }
}

bool is_of_lowlux(std::span<const std::byte> bytes) {
  constexpr std::string_view maker{"lowlux\0", 7};
  return bytes.size() >= maker.size() &&
         std::string_view(reinterpret_cast<const char*>(bytes.data()), maker.size()) == maker;
}

/// Removes a maker note that may not be kept: only a DNG can state that it may (MakerNoteSafety, DNG 1.4, 0 by
/// default). Others refer to places in their file, or hold the preview of an image that has changed.
void remove_unsafe_note(const TiffDirectory* dng, SourceTags& tags) {
  const auto safety = dng != nullptr ? dng->whole_or(maker_note_safety, 0) : 0;
  if (safety && *safety == 1) return;
  std::erase_if(tags.exif, [](const SourceTag& tag) { return tag.id == maker_note.id; });
}

SourceTags tags_of_dng(const TiffFile& tiff, const DngFile& dng, Collector& collector) {
  SourceTags tags;
  const TiffDirectory& raw_image = dng.raw_images.front();
  collector.add_some(author_tags, dng.main, nullptr, tags.main);
  collector.add_some(dng_tags, dng.main, &raw_image, tags.main);
  const TiffEntry* maker = dng.main.find(tag::dng_private_data);
  if (maker != nullptr && !is_of_lowlux(maker->values)) collector.add(*maker, tags.main);
  follow_calibrations(dng, tags.main);
  if (dng.exif) collector.add_all(*dng.exif, tags.exif, exif_kind);
  add_directory(tiff, dng.main, gps_ifd, gps_kind, collector, tags.gps);
  remove_unsafe_note(&dng.main, tags);
  const auto baseline = dng.main.numbers(tag::baseline_exposure, 1, 1);
  if (baseline && *baseline && std::fabs((**baseline)[0]) <= max_baseline_ev) {
    tags.baseline_exposure_ev = (**baseline)[0];
  }
  return tags;
}

SourceTags tags_of_blocks(const std::vector<ExifBlock>& blocks, Collector& collector) {
  SourceTags tags;
  for (const ExifBlock& block : blocks) {
    const auto first = block.tiff.directory(block.tiff.first_directory());
    if (!first) continue;
    if (block.first == ExifBlock::First::exif) collector.add_all(*first, tags.exif, exif_kind);
    if (block.first == ExifBlock::First::gps) collector.add_all(*first, tags.gps, gps_kind);
    if (block.first != ExifBlock::First::main) continue;
    collector.add_some(author_tags, *first, nullptr, tags.main);
    add_directory(block.tiff, *first, tag::exif_ifd, exif_kind, collector, tags.exif);
    add_directory(block.tiff, *first, gps_ifd, gps_kind, collector, tags.gps);
  }
  remove_unsafe_note(nullptr, tags);
  return tags;
}

}  // namespace

std::shared_ptr<const SourceTags> dng_source_tags(std::span<const std::byte> file, const DngFile& dng,
                                                  std::vector<std::string>& warnings) {
  const auto tiff = TiffFile::open(file);
  if (!tiff) return nullptr;
  Collector collector(warnings);
  return std::make_shared<const SourceTags>(tags_of_dng(*tiff, dng, collector));
}

std::shared_ptr<const SourceTags> raw_source_tags(std::span<const std::byte> file, std::vector<std::string>& warnings) {
  const std::vector<ExifBlock> blocks = find_exif(file);
  if (blocks.empty()) return nullptr;
  Collector collector(warnings);
  return std::make_shared<const SourceTags>(tags_of_blocks(blocks, collector));
}

void name_camera_as_file(std::span<const std::byte> file, RawFrame& frame) {
  FrameInfo& info = frame.raw.info;
  for (const ExifBlock& block : find_exif(file)) {
    if (block.first != ExifBlock::First::main) continue;
    const auto main = block.tiff.directory(block.tiff.first_directory());
    if (!main) continue;
    std::string make = main->text(tag::make), model = main->text(tag::model);
    if (make.empty() || model.empty()) continue;
    const std::string name = camera_name(info.make, info.model);
    info.make = std::move(make);
    info.model = std::move(model);
    if (name.empty()) return;
    SourceTags tags = frame.source_tags ? *frame.source_tags : SourceTags{};
    const auto* const text = reinterpret_cast<const std::byte*>(name.c_str());
    const std::size_t bytes = name.size() + 1;
    tags.main.push_back({tag::unique_camera_model.id,
                         static_cast<std::uint16_t>(TiffEntry::Type::ascii),
                         static_cast<std::uint32_t>(bytes),
                         {text, text + bytes}});
    frame.source_tags = std::make_shared<const SourceTags>(std::move(tags));
    return;
  }
}

}  // namespace lowlux::capture
