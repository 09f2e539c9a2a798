#include "isp/output/picture/metadata.h"

#include <libexif/exif-data.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>

namespace lowlux::isp {
namespace {

constexpr ExifByteOrder order = EXIF_BYTE_ORDER_INTEL;
constexpr std::size_t longest_text = 255;
constexpr std::size_t prefix_size = 6;  // "Exif\0\0", which belongs to JPEG's segment

struct Unref {
  void operator()(ExifData* data) const { exif_data_unref(data); }
  void operator()(ExifEntry* entry) const { exif_entry_unref(entry); }
  void operator()(ExifMem* memory) const { exif_mem_unref(memory); }
};

/// Returns the nearest fraction with 32-bit terms to 1e-9 of the number, by continued fraction: 1/30 s gives 1/30.
std::optional<ExifRational> rational(double number) {
  if (!(number > 1e-9) || !(number < 4e9)) return std::nullopt;
  double p0 = 0, q0 = 1, p1 = 1, q1 = 0;
  double rest = number;
  constexpr double limit = std::numeric_limits<ExifLong>::max();
  for (int i = 0; i < 40; ++i) {
    const double whole = std::floor(rest);
    const double p2 = whole * p1 + p0, q2 = whole * q1 + q0;
    if (p2 > limit || q2 > limit) break;
    p0 = p1, q0 = q1, p1 = p2, q1 = q2;
    if (std::fabs(p1 / q1 - number) <= 1e-9 * number || rest == whole) break;
    rest = 1 / (rest - whole);
  }
  return ExifRational{static_cast<ExifLong>(p1), static_cast<ExifLong>(q1)};
}

class Block {
 public:
  Block() : memory_(exif_mem_new_default()), data_(exif_data_new()) { exif_data_set_byte_order(data_.get(), order); }

  void add_text(ExifIfd ifd, int tag, const std::string& text) {
    if (!text.empty()) add(ifd, tag, EXIF_FORMAT_ASCII, text.size() + 1, text.c_str(), text.size() + 1);
  }
  void add_undefined(int tag, std::string_view bytes) {
    add(EXIF_IFD_EXIF, tag, EXIF_FORMAT_UNDEFINED, bytes.size(), bytes.data(), bytes.size());
  }
  void add_short(ExifIfd ifd, int tag, ExifShort number) {
    unsigned char bytes[2];
    exif_set_short(bytes, order, number);
    add(ifd, tag, EXIF_FORMAT_SHORT, 1, bytes, sizeof bytes);
  }
  void add_long(int tag, ExifLong number) {
    unsigned char bytes[4];
    exif_set_long(bytes, order, number);
    add(EXIF_IFD_EXIF, tag, EXIF_FORMAT_LONG, 1, bytes, sizeof bytes);
  }
  void add_rational(int tag, const std::optional<double>& number) {
    const auto fraction = number ? rational(*number) : std::nullopt;
    if (!fraction) return;
    unsigned char bytes[8];
    exif_set_rational(bytes, order, *fraction);
    add(EXIF_IFD_EXIF, tag, EXIF_FORMAT_RATIONAL, 1, bytes, sizeof bytes);
  }

  /// Adds tags of the raw file; those that the block has stay as they are.
  void add_source(ExifIfd ifd, const std::vector<SourceTag>& tags) {
    for (const SourceTag& tag : tags) {
      if (exif_content_get_entry(data_->ifd[ifd], static_cast<ExifTag>(tag.id)) != nullptr) continue;
      add(ifd, tag.id, static_cast<ExifFormat>(tag.type), tag.count, tag.values.data(), tag.values.size());
    }
  }

  std::vector<std::byte> bytes() const {
    unsigned char* saved = nullptr;
    unsigned size = 0;
    exif_data_save_data(data_.get(), &saved, &size);
    std::vector<std::byte> out;
    if (saved != nullptr && size > prefix_size) {
      const auto* first = reinterpret_cast<const std::byte*>(saved);
      out.assign(first + prefix_size, first + size);
    }
    std::free(saved);
    return out;
  }

 private:
  void add(ExifIfd ifd, int tag, ExifFormat format, std::size_t components, const void* bytes, std::size_t size) {
    const std::unique_ptr<ExifEntry, Unref> entry(exif_entry_new_mem(memory_.get()));
    entry->tag = static_cast<ExifTag>(tag);
    entry->format = format;
    entry->components = components;
    entry->data = static_cast<unsigned char*>(exif_mem_alloc(memory_.get(), static_cast<ExifLong>(size)));
    if (entry->data == nullptr) return;
    entry->size = static_cast<unsigned>(size);
    std::memcpy(entry->data, bytes, size);
    exif_content_add_entry(data_->ifd[ifd], entry.get());
  }

  std::unique_ptr<ExifMem, Unref> memory_;
  std::unique_ptr<ExifData, Unref> data_;
};

/// Returns whether a text has the form "YYYY:MM:DD hh:mm:ss".
bool is_time(const std::string& text) {
  constexpr std::string_view shape = "dddd:dd:dd dd:dd:dd";
  if (text.size() != shape.size()) return false;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const bool digit = text[i] >= '0' && text[i] <= '9';
    if (shape[i] == 'd' ? !digit : text[i] != shape[i]) return false;
  }
  return true;
}

/// Adds PhotographicSensitivity, which holds 16 bits; for larger figures EXIF 2.32 (4.6.6.7) requires 65535 and the
/// figure in another tag.
void add_sensitivity(Block& block, const std::optional<double>& iso) {
  if (!iso || !(*iso >= 1 && *iso < 4e9)) return;
  const auto exact = static_cast<ExifLong>(std::lround(*iso));
  const bool fits = exact < 65535;
  block.add_short(EXIF_IFD_EXIF, EXIF_TAG_ISO_SPEED_RATINGS, fits ? static_cast<ExifShort>(exact) : 65535);
  if (fits) return;
  block.add_short(EXIF_IFD_EXIF, EXIF_TAG_SENSITIVITY_TYPE, 2);  // recommended exposure index
  block.add_long(EXIF_TAG_RECOMMENDED_EXPOSURE_INDEX, exact);
}

}  // namespace

std::string printable_ascii(const std::string& text, std::size_t limit) {
  std::string out;
  for (const char c : text) {
    if (c >= ' ' && c <= '~' && out.size() < limit) out.push_back(c);
  }
  return out;
}

FrameInfo written_info(const FrameInfo& info, const std::string& software) {
  FrameInfo out = info;
  out.make = printable_ascii(info.make, longest_text);
  out.model = printable_ascii(info.model, longest_text);
  out.software = printable_ascii(software, longest_text);
  out.date_time = is_time(info.date_time) ? info.date_time : "";
  out.orientation = Orientation::normal;
  return out;
}

std::vector<std::byte> exif_block(const FrameInfo& info, const ExifPicture& picture) {
  const FrameInfo clean = written_info(info, picture.software);
  Block block;
  block.add_text(EXIF_IFD_0, EXIF_TAG_MAKE, clean.make);
  block.add_text(EXIF_IFD_0, EXIF_TAG_MODEL, clean.model);
  block.add_text(EXIF_IFD_0, EXIF_TAG_SOFTWARE, clean.software);
  block.add_text(EXIF_IFD_0, EXIF_TAG_DATE_TIME, clean.date_time);
  block.add_short(EXIF_IFD_0, EXIF_TAG_ORIENTATION, 1);
  block.add_rational(EXIF_TAG_EXPOSURE_TIME, clean.exposure_s);
  block.add_rational(EXIF_TAG_FNUMBER, clean.f_number);
  add_sensitivity(block, clean.iso);
  block.add_undefined(EXIF_TAG_EXIF_VERSION, "0232");
  block.add_text(EXIF_IFD_EXIF, EXIF_TAG_DATE_TIME_ORIGINAL, clean.date_time);
  block.add_rational(EXIF_TAG_FOCAL_LENGTH, clean.focal_length_mm);
  block.add_short(EXIF_IFD_EXIF, EXIF_TAG_COLOR_SPACE, picture.space == OutputSpace::srgb ? 1 : 0xFFFF);
  block.add_long(EXIF_TAG_PIXEL_X_DIMENSION, static_cast<ExifLong>(picture.width));
  block.add_long(EXIF_TAG_PIXEL_Y_DIMENSION, static_cast<ExifLong>(picture.height));
  if (picture.source_tags != nullptr) {
    block.add_source(EXIF_IFD_0, picture.source_tags->main);
    block.add_source(EXIF_IFD_EXIF, picture.source_tags->exif);
    block.add_source(EXIF_IFD_GPS, picture.source_tags->gps);
  }
  return block.bytes();
}

}  // namespace lowlux::isp
