#include "capture/dng/source_tags.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>

#include "capture/dng/dng_colour.h"
#include "capture/dng/dng_file.h"
#include "capture/dng/dng_tags.h"
#include "capture/dng/exif_blocks.h"
#include "capture/dng/opcode_reader.h"
#include "capture/dng/tiff_directory.h"

namespace lowlux::capture {
namespace {

constexpr std::size_t max_bytes = std::size_t{64} << 20, max_tags = 4096;
constexpr double max_baseline_ev = 100;
constexpr TagName gps_ifd{34853, "GPSInfo"}, maker_note{37500, "MakerNote"},
    maker_note_safety{50741, "MakerNoteSafety"};
// EXIF tags that are not passed on: those of FrameInfo, which are read and written, PixelXDimension and
// PixelYDimension, and offsets of directories.
constexpr std::array<std::uint16_t, 11> own_exif_tags{33434, 33437, 34665, 34853, 34855, 36867,
                                                      37386, 37888, 40962, 40963, 40965};
constexpr std::array<TagName, 2> hue_sat_map{{{50938, "ProfileHueSatMapData1"}, {50939, "ProfileHueSatMapData2"}}};

// Author, XMP, copyright, IPTC and Rating.
constexpr std::array<std::uint16_t, 5> author_tags{315, 700, 18246, 33432, 33723};
// UniqueCameraModel and LocalizedCameraModel, BayerGreenSplit, BaselineSharpness, CameraSerialNumber, LensInfo,
// AntiAliasStrength, MakerNoteSafety, OriginalRawFileName, signatures, names, tables and curve of the profile,
// encodings, BaselineExposureOffset and DefaultBlackRender.
constexpr std::array<std::uint16_t, 25> dng_tags{50708, 50709, 50732, 50733, 50735, 50736, 50738, 50741, 50827,
                                                 50931, 50932, 50934, 50936, 50937, 50938, 50939, 50940, 50941,
                                                 50942, 50981, 50982, 51107, 51108, 51109, 51110};

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
  void add(const TiffEntry& entry, std::vector<SourceTag>& to) {
    const std::size_t unit = unit_bytes(entry.type);
    if (unit == 0 || entry.count == 0) return;
    if (std::any_of(to.begin(), to.end(), [&](const SourceTag& tag) { return tag.id == entry.id; })) return;
    if (!entry.inside_file || entry.values.size() > max_bytes - bytes_ || tags_ == max_tags) {
      if (!std::exchange(warned_, true)) {
        warnings_.push_back("tag " + std::to_string(entry.id) +
                            (entry.inside_file ? " is not copied: the tags are too many or too large"
                                               : " is not copied: its values lie beyond the end of the file"));
      }
      return;
    }
    bytes_ += entry.values.size();
    ++tags_;
    SourceTag tag{
        entry.id, static_cast<std::uint16_t>(entry.type), entry.count, {entry.values.begin(), entry.values.end()}};
    for (std::size_t at = 0; entry.big_endian && at + unit <= tag.values.size(); at += unit) {
      const auto first = tag.values.begin() + static_cast<std::ptrdiff_t>(at);
      std::reverse(first, first + static_cast<std::ptrdiff_t>(unit));
    }
    to.push_back(std::move(tag));
  }

  void add_all(const TiffDirectory& directory, std::vector<SourceTag>& to) {
    for (const TiffEntry& entry : directory.entries) {
      const bool is_own = std::find(own_exif_tags.begin(), own_exif_tags.end(), entry.id) != own_exif_tags.end();
      if (!is_own) add(entry, to);
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

 private:
  std::vector<std::string>& warnings_;
  std::size_t bytes_ = 0, tags_ = 0;
  bool warned_ = false;
};

/// Adds the directory that a tag of the first one points to; a damaged one is left out.
void add_directory(const TiffFile& tiff, const TiffDirectory& main, TagName pointer, Collector& collector,
                   std::vector<SourceTag>& to) {
  const auto offset = main.whole(pointer);
  if (!offset || !*offset) return;
  if (const auto directory = tiff.directory(**offset)) collector.add_all(*directory, to);
}

/// Returns the opcodes of OpcodeList3 other than gains and defects, which are in RawFrame::corrections; empty if there
/// are none or the list is damaged.
std::vector<std::byte> other_opcodes(std::span<const std::byte> list) {
  constexpr std::array<std::uint32_t, 4> read{3, 4, 5, 9};
  constexpr std::size_t header = 16;
  std::vector<std::byte> out(4);
  std::size_t at = 4;
  std::uint8_t kept = 0;
  const auto good = each_opcode(list, 3, [&](std::uint32_t id, std::span<const std::byte> parameters) -> Result<void> {
    const auto opcode = list.subspan(at, header + parameters.size());
    at += opcode.size();
    if (std::find(read.begin(), read.end(), id) != read.end()) return {};
    out.insert(out.end(), opcode.begin(), opcode.end());
    ++kept;
    return {};
  });
  if (!good || kept == 0) return {};
  out[3] = std::byte{kept};  // at most 64
  return out;
}

void add_opcodes(const DngFile& dng, const TiffDirectory& raw_image, std::vector<SourceTag>& to) {
  const TagName name = tag::opcode_list[2];
  const TiffDirectory& home = raw_image.find(name) != nullptr ? raw_image : dng.main;
  const auto list = home.bytes(name);
  if (!list || list->empty()) return;
  std::vector<std::byte> kept = other_opcodes(*list);
  if (kept.empty()) return;
  const auto count = static_cast<std::uint32_t>(kept.size());
  to.push_back({name.id, static_cast<std::uint16_t>(TiffEntry::Type::undefined), count, std::move(kept)});
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
  add_opcodes(dng, raw_image, tags.main);
  follow_calibrations(dng, tags.main);
  if (dng.exif) collector.add_all(*dng.exif, tags.exif);
  add_directory(tiff, dng.main, gps_ifd, collector, tags.gps);
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
    if (block.first == ExifBlock::First::exif) collector.add_all(*first, tags.exif);
    if (block.first == ExifBlock::First::gps) collector.add_all(*first, tags.gps);
    if (block.first != ExifBlock::First::main) continue;
    collector.add_some(author_tags, *first, nullptr, tags.main);
    add_directory(block.tiff, *first, tag::exif_ifd, collector, tags.exif);
    add_directory(block.tiff, *first, gps_ifd, collector, tags.gps);
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

}  // namespace lowlux::capture
