#include "isp/codec/exr.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <limits>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfXdr.h>
#include <half.h>

namespace lowlux::isp {
namespace {

constexpr int rows_per_call = 32;  // one PIZ block
constexpr float largest_half = 65504.0f;
constexpr std::array<const char*, 3> colour_names{"R", "G", "B"};

/// Writes to the caller's stream and keeps its first failure: OpenEXR rewords exceptions passed through it, and its
/// destructor, which writes the table of rows, discards them.
class OutputStream final : public Imf::OStream {
 public:
  explicit OutputStream(std::FILE* file) : OStream("picture"), file_(file) {}

  void write(const char bytes[], int count) override {
    keep(write_bytes(file_, std::as_bytes(std::span(bytes, static_cast<std::size_t>(count)))));
  }
  std::uint64_t tellp() override { return static_cast<std::uint64_t>(ftello(file_)); }
  void seekp(std::uint64_t place) override {
    errno = 0;
    if (fseeko(file_, static_cast<off_t>(place), SEEK_SET) != 0) keep(write_failure());
  }
  const Result<void>& status() const { return status_; }

 private:
  void keep(Result<void> written) {
    if (written) return;
    if (status_) status_ = std::move(written);
    throw std::runtime_error("cannot write");
  }

  std::FILE* file_;
  Result<void> status_;
};

class InputStream final : public Imf::IStream {
 public:
  explicit InputStream(std::span<const std::byte> bytes) : IStream("picture"), bytes_(bytes) {}

  bool read(char out[], int count) override {
    const std::uint64_t left = place_ < bytes_.size() ? bytes_.size() - place_ : 0;
    if (count < 0 || static_cast<std::uint64_t>(count) > left) throw std::runtime_error("the file ends too early");
    if (count > 0) std::memcpy(out, bytes_.data() + place_, static_cast<std::size_t>(count));
    place_ += static_cast<std::uint64_t>(count);
    return place_ < bytes_.size();
  }
  std::uint64_t tellg() override { return place_; }
  void seekg(std::uint64_t place) override { place_ = place; }

 private:
  std::span<const std::byte> bytes_;
  std::uint64_t place_ = 0;
};

Imath::V2f to_v2f(const Chromaticities::Xy& xy) { return {static_cast<float>(xy.x), static_cast<float>(xy.y)}; }
Chromaticities::Xy to_xy(const Imath::V2f& v) { return {v.x, v.y}; }

bool usable(const std::optional<double>& number) { return number && std::isfinite(*number) && *number > 0; }

void set_text(Imf::Header& header, const char* name, const std::string& text) {
  if (!text.empty()) header.insert(name, Imf::StringAttribute(text));
}

/// Returns the sum of the unsigned fractions of a tag, each divided by 60 once more: degrees, minutes and seconds, of
/// which the last ones may be unknown; nullopt if it is above `largest`.
std::optional<double> degrees_of(const std::vector<SourceTag>& tags, std::uint16_t id, double largest) {
  const SourceTag* tag = find_tag(tags, id);
  if (tag == nullptr || tag->type != 5 || tag->values.size() % 8 != 0 || tag->values.empty()) return std::nullopt;
  double sum = 0, unit = 1;
  for (std::size_t at = 0; at < std::min<std::size_t>(tag->values.size(), 24); at += 8, unit /= 60) {
    std::array<std::uint32_t, 2> terms{};  // little-endian, as this machine is
    std::memcpy(terms.data(), tag->values.data() + at, 8);
    if (at == 0 || terms[1] != 0) sum += unit * terms[0] / terms[1];
  }
  return sum <= largest ? std::optional(sum) : std::nullopt;
}

void add_source_tags(const SourceTags& tags, Imf::Header& header) {
  set_text(header, "comments", text_of(tags.main, 270));
  set_text(header, "owner", text_of(tags.main, 315));
  set_text(header, "copyright", text_of(tags.main, 33432));
  set_text(header, "cameraSerialNumber", text_of(tags.exif, 42033));
  set_text(header, "lensMake", text_of(tags.exif, 42035));
  set_text(header, "lensModel", text_of(tags.exif, 42036));
  set_text(header, "lensSerialNumber", text_of(tags.exif, 42037));
  const auto north = degrees_of(tags.gps, 2, 90), east = degrees_of(tags.gps, 4, 180);
  const auto height_m = degrees_of(tags.gps, 6, 1e6);
  if (north) Imf::addLatitude(header, static_cast<float>(text_of(tags.gps, 1) == "S" ? -*north : *north));
  if (east) Imf::addLongitude(header, static_cast<float>(text_of(tags.gps, 3) == "W" ? -*east : *east));
  const SourceTag* below = find_tag(tags.gps, 5);
  const bool is_below = below != nullptr && !below->values.empty() && below->values[0] == std::byte{1};
  if (height_m) Imf::addAltitude(header, static_cast<float>(is_below ? -*height_m : *height_m));
}

Imf::Header header_of(const SceneLinear& picture, const FileMetadata& metadata, const ExrOptions& options) {
  Imf::Header header(picture.width(), picture.height());
  const bool piz = options.compression == ExrOptions::Compression::piz;
  header.compression() = piz ? Imf::PIZ_COMPRESSION : Imf::NO_COMPRESSION;
  const Imf::PixelType type = options.depth == ExrOptions::Depth::full ? Imf::FLOAT : Imf::HALF;
  for (const char* name : colour_names) header.channels().insert(name, Imf::Channel(type));
  if (const auto& c = metadata.chromaticities) {
    Imf::addChromaticities(header, {to_v2f(c->red), to_v2f(c->green), to_v2f(c->blue), to_v2f(c->white)});
  }
  if (usable(metadata.white_luminance_cd_m2)) {
    Imf::addWhiteLuminance(header, static_cast<float>(*metadata.white_luminance_cd_m2));
  }
  const FrameInfo& info = metadata.info;
  if (usable(info.exposure_s)) Imf::addExpTime(header, static_cast<float>(*info.exposure_s));
  if (usable(info.f_number)) Imf::addAperture(header, static_cast<float>(*info.f_number));
  if (usable(info.iso)) Imf::addIsoSpeed(header, static_cast<float>(*info.iso));
  if (info.date_time.size() == 19) Imf::addCapDate(header, info.date_time);
  set_text(header, "cameraMake", info.make);
  set_text(header, "cameraModel", info.model);
  set_text(header, "software", info.software);
  if (usable(info.focal_length_mm)) {
    header.insert("nominalFocalLength", Imf::FloatAttribute(static_cast<float>(*info.focal_length_mm)));
  }
  if (metadata.source_tags) add_source_tags(*metadata.source_tags, header);
  return header;
}

void write_full(Imf::OutputFile& file, const SceneLinear& picture) {
  Imf::FrameBuffer buffer;
  for (int c = 0; c < 3; ++c) {
    buffer.insert(colour_names[c], Imf::Slice::Make(Imf::FLOAT, picture.plane[c].data(), Imath::V2i(0, 0),
                                                    picture.width(), picture.height()));
  }
  file.setFrameBuffer(buffer);
  file.writePixels(picture.height());
}

void write_half(Imf::OutputFile& file, const SceneLinear& picture) {
  const std::size_t width = picture.width();
  std::array<std::vector<half>, 3> rows;
  for (auto& plane : rows) plane.resize(width * rows_per_call);
  for (int y = 0; y < picture.height(); y += rows_per_call) {
    const int count = std::min(rows_per_call, picture.height() - y);
    Imf::FrameBuffer buffer;
    for (int c = 0; c < 3; ++c) {
      const float* in = picture.plane[c].row(y);
      std::transform(in, in + width * count, rows[c].begin(), [](float value) {
        return half(std::isnan(value) ? value : std::clamp(value, -largest_half, largest_half));
      });
      buffer.insert(colour_names[c],
                    Imf::Slice::Make(Imf::HALF, rows[c].data(), Imath::V2i(0, y), picture.width(), count));
    }
    file.setFrameBuffer(buffer);
    file.writePixels(count);
  }
}

/// Reads only the header, and rejects files that would make OpenEXR allocate without bound.
Result<Imath::Box2i> check_window(std::span<const std::byte> bytes, const DecodeLimits& limits) {
  if (auto sound = check_exr_header(bytes); !sound) return tl::make_unexpected(sound.error());
  InputStream stream(bytes);
  int magic = 0;
  int version = 0;
  Imf::Xdr::read<Imf::StreamIO>(stream, magic);
  Imf::Xdr::read<Imf::StreamIO>(stream, version);
  Imf::Header header;
  header.readFrom(stream, version);
  const Imath::Box2i& window = header.dataWindow();
  const auto side = [](int first, int last) { return std::int64_t{last} - first + 1; };
  auto fits = check_size(side(window.min.x, window.max.x), side(window.min.y, window.max.y), limits);
  if (fits && header.hasTileDescription()) {
    fits = check_size(header.tileDescription().xSize, header.tileDescription().ySize, limits);
  }
  if (!fits) return tl::make_unexpected(fits.error());
  return window;
}

FileMetadata metadata_of(const Imf::Header& header) {
  FileMetadata metadata;
  FrameInfo& info = metadata.info;
  if (Imf::hasChromaticities(header)) {
    const auto& c = Imf::chromaticities(header);
    metadata.chromaticities = Chromaticities{to_xy(c.red), to_xy(c.green), to_xy(c.blue), to_xy(c.white)};
  }
  if (Imf::hasWhiteLuminance(header)) metadata.white_luminance_cd_m2 = Imf::whiteLuminance(header);
  if (Imf::hasExpTime(header)) info.exposure_s = Imf::expTime(header);
  if (Imf::hasAperture(header)) info.f_number = Imf::aperture(header);
  if (Imf::hasIsoSpeed(header)) info.iso = Imf::isoSpeed(header);
  if (Imf::hasCapDate(header)) info.date_time = Imf::capDate(header);
  const auto text = [&](const char* name) {
    const auto* attribute = header.findTypedAttribute<Imf::StringAttribute>(name);
    return attribute == nullptr ? std::string() : attribute->value();
  };
  info.make = text("cameraMake");
  info.model = text("cameraModel");
  info.software = text("software");
  return metadata;
}

/// Returns the channel each colour is read from; an error if there are none or they are subsampled.
Result<std::array<const char*, 3>> colour_channels(const Imf::ChannelList& channels) {
  const bool rgb = std::all_of(colour_names.begin(), colour_names.end(),
                               [&](const char* name) { return channels.findChannel(name) != nullptr; });
  if (!rgb && channels.findChannel("Y") == nullptr) {
    return fail(ErrorCode::unsupported, "the OpenEXR file has neither R, G, B nor Y channels");
  }
  if (!rgb && channels.findChannel("RY") != nullptr) {
    return fail(ErrorCode::unsupported, "luminance-chroma OpenEXR files are not supported: convert to RGB first");
  }
  const std::array<const char*, 3> names = rgb ? colour_names : std::array<const char*, 3>{"Y", "Y", "Y"};
  for (const char* name : names) {
    const Imf::Channel& channel = channels[name];
    if (channel.xSampling != 1 || channel.ySampling != 1) {
      return fail(ErrorCode::unsupported, "subsampled OpenEXR channels are not supported");
    }
  }
  return names;
}

Result<DecodedPicture> read_picture(Imf::InputFile& file, const Imath::Box2i& window) {
  const auto names = colour_channels(file.header().channels());
  if (!names) return tl::make_unexpected(names.error());
  const int width = window.max.x - window.min.x + 1;
  const int height = window.max.y - window.min.y + 1;
  SceneLinear picture(width, height);
  Imf::FrameBuffer buffer;
  const bool grey = (*names)[0] == (*names)[1];
  for (int c = 0; c < (grey ? 1 : 3); ++c) {
    buffer.insert((*names)[c], Imf::Slice::Make(Imf::FLOAT, picture.plane[c].data(), window));
  }
  file.setFrameBuffer(buffer);
  file.readPixels(window.min.y, window.max.y);
  if (grey) {
    picture.plane[1] = picture.plane[0].clone();
    picture.plane[2] = picture.plane[0].clone();
  }
  return DecodedPicture{std::move(picture), metadata_of(file.header())};
}

}  // namespace

Result<void> encode_exr(const SceneLinear& picture, const FileMetadata& metadata, const ExrOptions& options,
                        std::FILE* file) {
  constexpr DecodeLimits any_number{std::numeric_limits<std::int64_t>::max()};
  if (auto size = check_size(picture.width(), picture.height(), any_number); !size) return size;
  OutputStream stream(file);
  try {
    Imf::OutputFile out(stream, header_of(picture, metadata, options), 0);
    if (options.depth == ExrOptions::Depth::full) {
      write_full(out, picture);
    } else {
      write_half(out, picture);
    }
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::too_large, "no memory to write the OpenEXR file");
  } catch (const std::exception& error) {
    if (stream.status()) return fail(ErrorCode::unwritable, std::string("OpenEXR: ") + error.what());
  }
  return stream.status();
}

Result<DecodedPicture> decode_exr(std::span<const std::byte> bytes, const DecodeLimits& limits) try {
  const auto window = check_window(bytes, limits);
  if (!window) return tl::make_unexpected(window.error());
  InputStream stream(bytes);
  Imf::InputFile file(stream, 0);
  return read_picture(file, *window);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "no memory for the pixels of the OpenEXR file");
} catch (const std::exception& error) {
  return not_readable("OpenEXR file", error.what());
}

namespace {

constexpr std::uint32_t magic = 20000630;
constexpr std::uint32_t not_image_flag = 0x800;  // deep data
constexpr std::uint32_t multi_part_flag = 0x1000;
constexpr std::size_t longest_name = 255;

/// Reads values from the front of a run of bytes; nullopt once there are too few bytes.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : left_(bytes) {}

  bool at_end() const { return left_.empty(); }

  std::optional<std::uint32_t> u32() {  // little-endian
    const auto four = take(4);
    if (!four) return std::nullopt;
    std::uint32_t number = 0;
    for (int i = 3; i >= 0; --i) number = number << 8 | std::to_integer<std::uint32_t>((*four)[i]);
    return number;
  }

  std::optional<std::span<const std::byte>> take(std::size_t size) {
    if (size > left_.size()) return std::nullopt;
    const auto piece = left_.first(size);
    left_ = left_.subspan(size);
    return piece;
  }

  /// Returns the characters up to a zero byte, and consumes the zero byte too.
  std::optional<std::string> name() {
    const auto end = std::find(left_.begin(), left_.end(), std::byte{0});
    const auto size = static_cast<std::size_t>(end - left_.begin());
    if (end == left_.end() || size > longest_name) return std::nullopt;
    const auto piece = *take(size + 1);
    return std::string(reinterpret_cast<const char*>(piece.data()), size);
  }

 private:
  std::span<const std::byte> left_;
};

/// An attribute type whose values all have one size. OpenEXR reads so many bytes of it, whatever size the file states,
/// and takes what follows for the next attribute.
struct FixedSize {
  std::string_view type;
  std::size_t bytes;
};
constexpr std::array fixed_sizes{
    FixedSize{"box2f", 16},         FixedSize{"box2i", 16},    FixedSize{"chromaticities", 32},
    FixedSize{"compression", 1},    FixedSize{"double", 8},    FixedSize{"envmap", 1},
    FixedSize{"deepImageState", 1}, FixedSize{"float", 4},     FixedSize{"int", 4},
    FixedSize{"keycode", 28},       FixedSize{"lineOrder", 1}, FixedSize{"m33d", 72},
    FixedSize{"m33f", 36},          FixedSize{"m44d", 128},    FixedSize{"m44f", 64},
    FixedSize{"rational", 8},       FixedSize{"tiledesc", 9},  FixedSize{"timecode", 8},
    FixedSize{"v2d", 16},           FixedSize{"v2f", 8},       FixedSize{"v2i", 8},
    FixedSize{"v3d", 24},           FixedSize{"v3f", 12},      FixedSize{"v3i", 12}};

/// Returns whether a list of channels ends where its size says: each has a name, its type, a flag with three bytes that
/// are reserved, and two sampling rates; an empty name ends the list.
bool is_channel_list(ByteReader reader) {
  constexpr std::size_t bytes_after_name = 16;
  while (const auto name = reader.name()) {
    if (name->empty()) return reader.at_end();
    if (!reader.take(bytes_after_name)) return false;
  }
  return false;
}

/// Returns whether OpenEXR reads as many bytes of an attribute of `type` as its size states.
bool is_consistent(const std::string& type, std::span<const std::byte> value) {
  const auto* const fixed = std::ranges::find(fixed_sizes, type, &FixedSize::type);
  if (fixed != fixed_sizes.end()) return value.size() == fixed->bytes;
  ByteReader reader(value);
  if (type == "chlist") return is_channel_list(reader);
  if (type == "floatvector") return value.size() % sizeof(float) == 0;
  if (type == "preview") {
    const auto width = reader.u32(), height = reader.u32();
    return width && height && value.size() % 4 == 0 && std::uint64_t{*width} * *height == (value.size() - 8) / 4;
  }
  if (type == "stringvector") {
    while (!reader.at_end()) {
      const auto size = reader.u32();
      if (!size || !reader.take(*size)) return false;
    }
  }
  return true;
}

}  // namespace

Result<void> check_exr_header(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  if (reader.u32() != magic) return fail(ErrorCode::malformed, "not an OpenEXR file: its first bytes are wrong");
  const std::uint32_t version = reader.u32().value_or(0);
  if ((version & (not_image_flag | multi_part_flag)) != 0) {
    return fail(ErrorCode::unsupported, "deep and multi-part OpenEXR files are not supported");
  }
  while (true) {
    const auto name = reader.name();
    if (name && name->empty()) return {};
    const auto type = name ? reader.name() : std::nullopt;
    const auto size = type ? reader.u32() : std::nullopt;
    const auto value = size ? reader.take(*size) : std::nullopt;
    if (!value) return fail(ErrorCode::malformed, "not a readable OpenEXR file: it ends inside its header");
    if (!is_consistent(*type, *value)) {
      return fail(ErrorCode::malformed, "not a readable OpenEXR file: its " + type.value() + " contradicts its size");
    }
  }
}

}  // namespace lowlux::isp
