#include "capture/dng/dng_file.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "capture/decoder/libraw_decoder.h"
#include "capture/dng/dng_tags.h"
#include "capture/file/pass_on.h"
#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

constexpr std::size_t max_directories = 64;

bool is_full_raw(const TiffDirectory& directory) {
  const auto kind = directory.whole_or(tag::new_subfile_type, 0);
  const auto photometric = directory.whole_or(tag::photometric, 0);
  return kind && *kind == 0 && photometric &&
         (*photometric == tag::photometric_cfa || *photometric == tag::photometric_linear_raw);
}

double area_of(const TiffDirectory& directory) {
  const auto width = directory.whole_or(tag::image_width, 0), height = directory.whole_or(tag::image_length, 0);
  return width && height ? static_cast<double>(*width) * *height : 0.0;
}

/// Returns the offsets of the direct subdirectories of a directory, and of the one that follows it.
std::vector<std::uint32_t> neighbours(const TiffDirectory& directory) {
  std::vector<std::uint32_t> offsets;
  if (const auto below = directory.numbers(tag::sub_ifds, 1, max_directories); below && *below) {
    for (const double offset : **below) {
      if (offset > 0 && offset <= 4294967295.0) offsets.push_back(static_cast<std::uint32_t>(offset));
    }
  }
  if (directory.next != 0) offsets.push_back(directory.next);
  return offsets;
}

/// Returns all directories, the first one first; damaged ones that are not needed otherwise are left out.
std::vector<TiffDirectory> all_directories(const TiffFile& tiff, TiffDirectory first) {
  std::vector<TiffDirectory> found;
  std::set<std::uint32_t> seen{tiff.first_directory()};
  std::vector<std::uint32_t> pending = neighbours(first);
  found.push_back(std::move(first));
  while (!pending.empty() && found.size() < max_directories) {
    const std::uint32_t offset = pending.front();
    pending.erase(pending.begin());
    if (!seen.insert(offset).second) continue;
    auto directory = tiff.directory(offset);
    if (!directory) continue;
    const auto more = neighbours(*directory);
    pending.insert(pending.end(), more.begin(), more.end());
    found.push_back(*std::move(directory));
  }
  return found;
}

Result<std::optional<TiffDirectory>> exif_of(const TiffFile& tiff, const TiffDirectory& main) {
  const auto offset = main.whole(tag::exif_ifd);
  if (!offset) return tl::make_unexpected(offset.error());
  if (!*offset) return std::nullopt;
  auto directory = tiff.directory(**offset);
  if (directory) return *std::move(directory);
  return fail(directory.error().code, std::string("the tag ") + tag::exif_ifd.name + ": " + directory.error().message);
}

}  // namespace

std::string ignored(const Error& error) { return error.message + "; the tag is ignored"; }

Result<std::optional<DngFile>> open_dng(std::span<const std::byte> bytes) {
  const auto tiff = TiffFile::open(bytes);
  if (!tiff) return std::nullopt;
  auto first = tiff->directory(tiff->first_directory());
  if (!first) return pass_on(first);
  if (first->find(tag::dng_version) == nullptr) return std::nullopt;

  DngFile dng;
  dng.main = *first;
  for (TiffDirectory& directory : all_directories(*tiff, *std::move(first))) {
    (is_full_raw(directory) ? dng.raw_images : dng.previews).push_back(std::move(directory));
  }
  if (dng.raw_images.empty())
    return fail(ErrorCode::unsupported, "this DNG holds no raw image, only rendered pictures");
  std::stable_sort(dng.raw_images.begin(), dng.raw_images.end(),
                   [](const auto& a, const auto& b) { return area_of(a) > area_of(b); });
  dng.exif = or_ignored(exif_of(*tiff, dng.main), dng.warnings);
  return dng;
}

namespace {

constexpr std::uint32_t compression_none = 1;
constexpr std::uint32_t compression_jpeg = 7;
constexpr std::uint32_t compression_vc5 = 9;
constexpr std::size_t max_parts = std::size_t{1} << 22;  // strips or tiles
constexpr int min_size = 22;                             // LibRaw treats smaller ones as thumbnails
constexpr int max_size = 65535;                          // LibRaw keeps sizes in 16 bits

Result<std::uint32_t> required(const TiffDirectory& directory, TagName name) {
  auto found = directory.whole(name);
  if (!found) return pass_on(found);
  if (*found) return **found;
  return fail(ErrorCode::malformed, std::string("the tag ") + name.name + " is missing", name.name);
}

Result<void> check_compression(std::uint32_t compression) {
  if (compression == compression_none || compression == compression_jpeg) return {};
  std::string message = "the raw image is compressed with " + compression_name(compression) + ", which " +
                        decoder_name() + " cannot decode: ";
  message += compression == compression_vc5 ? "convert it with GoPro's or Adobe's DNG converter"
                                            : "convert it to a DNG with lossless JPEG or no compression";
  return fail(ErrorCode::unsupported, std::move(message), tag::compression.name);
}

Result<int> bits_of(const TiffDirectory& directory, std::size_t samples) {
  auto bits = directory.numbers(tag::bits_per_sample, 1, 16);
  if (!bits) return pass_on(bits);
  if (!*bits) return fail(ErrorCode::malformed, "the tag BitsPerSample is missing", tag::bits_per_sample.name);
  const std::vector<double>& values = **bits;
  const bool equal = std::all_of(values.begin(), values.end(), [&](double b) { return b == values.front(); });
  if (!equal || (values.size() != 1 && values.size() < samples)) {
    return fail(ErrorCode::malformed, "the tag BitsPerSample does not agree with the samples",
                tag::bits_per_sample.name);
  }
  auto format = directory.whole_or(tag::sample_format, 1);
  if (!format) return pass_on(format);
  if (*format == 3) {
    return fail(ErrorCode::unsupported, "floating-point raws are not supported: convert to an integer DNG",
                tag::sample_format.name);
  }
  if (!(values.front() >= 8 && values.front() <= 16 && values.front() == std::floor(values.front()))) {
    return fail(ErrorCode::unsupported,
                "raws of " + number_text(values.front()) + " bits per sample are not supported, 8 to 16 are",
                tag::bits_per_sample.name);
  }
  return static_cast<int>(values.front());
}

Result<BayerPhase> phase_of(const TiffDirectory& directory) {
  auto size = directory.numbers(tag::cfa_repeat_pattern_dim, 2, 2);
  if (!size) return pass_on(size);
  if (*size && **size != std::vector<double>{2, 2}) {
    const bool x_trans = **size == std::vector<double>{6, 6};
    return fail(ErrorCode::unsupported,
                std::string(x_trans ? "X-Trans" : "repeating") + " mosaics of " + number_text((**size)[0]) + " x " +
                    number_text((**size)[1]) + " sites are not supported: only Bayer mosaics and monochrome are",
                tag::cfa_repeat_pattern_dim.name);
  }
  auto layout = directory.whole_or(tag::cfa_layout, 1);
  if (!layout) return pass_on(layout);
  if (*layout != 1) {
    return fail(ErrorCode::unsupported, "mosaics that are not rectangular are not supported", tag::cfa_layout.name);
  }
  auto planes = directory.numbers(tag::cfa_plane_color, 1, 16);
  if (!planes) return pass_on(planes);
  if (*planes && **planes != std::vector<double>{0, 1, 2}) {
    return fail(ErrorCode::unsupported, "mosaics of colours other than R, G, B are not supported",
                tag::cfa_plane_color.name);
  }
  auto pattern = directory.numbers(tag::cfa_pattern, 4, 4);
  if (!pattern) return pass_on(pattern);
  if (!*pattern) return fail(ErrorCode::malformed, "the tag CFAPattern is missing", tag::cfa_pattern.name);
  const std::vector<double> patterns[] = {{0, 1, 1, 2}, {1, 0, 2, 1}, {1, 2, 0, 1}, {2, 1, 1, 0}};
  const auto* const at = std::find(std::begin(patterns), std::end(patterns), **pattern);
  if (at == std::end(patterns)) {
    return fail(ErrorCode::unsupported, "this mosaic is not one of the four Bayer patterns of R, G, B",
                tag::cfa_pattern.name);
  }
  return static_cast<BayerPhase>(at - std::begin(patterns));
}

/// Locations of the parts (strips or tiles) of an image.
struct Parts {
  std::vector<double> offset, bytes;
  bool tiled = false;
  std::uint32_t tile_width = 0;
};

Result<Parts> parts_of(const TiffDirectory& directory) {
  Parts parts;
  parts.tiled = directory.find(tag::tile_offsets) != nullptr;
  const TagName offset_tag = parts.tiled ? tag::tile_offsets : tag::strip_offsets;
  const TagName bytes_tag = parts.tiled ? tag::tile_byte_counts : tag::strip_byte_counts;
  auto offset = directory.numbers(offset_tag, 1, max_parts);
  if (!offset) return pass_on(offset);
  auto bytes = directory.numbers(bytes_tag, 1, max_parts);
  if (!bytes) return pass_on(bytes);
  if (!*offset || !*bytes || (*offset)->size() != (*bytes)->size()) {
    return fail(ErrorCode::malformed,
                std::string("the tags ") + offset_tag.name + " and " + bytes_tag.name + " are missing or disagree",
                offset_tag.name);
  }
  parts.offset = **std::move(offset);
  parts.bytes = **std::move(bytes);
  if (parts.tiled) {
    auto width = required(directory, tag::tile_width);
    if (!width) return pass_on(width);
    parts.tile_width = *width;
  }
  return parts;
}

/// Checks that image data lie inside the file, and where LibRaw reads it: without compression contiguously, row after
/// row; with lossless JPEG in one strip, or in tiles.
Result<void> check_storage(const TiffDirectory& directory, const DngImage& image, bool compressed,
                           std::size_t file_bytes) {
  auto parts = parts_of(directory);
  if (!parts) return pass_on(parts);
  double total = 0;
  bool in_one_piece = true;
  for (std::size_t i = 0; i < parts->offset.size(); ++i) {
    const double end = parts->offset[i] + parts->bytes[i];
    if (!(parts->offset[i] >= 8 && parts->bytes[i] >= 0 && end <= static_cast<double>(file_bytes))) {
      return fail(ErrorCode::malformed, "the image data reaches to byte " + number_text(end) + ", the file has " +
                                            std::to_string(file_bytes) + ": it is truncated or damaged");
    }
    total += parts->bytes[i];
    if (i > 0 && parts->offset[i] != parts->offset[i - 1] + parts->bytes[i - 1]) in_one_piece = false;
  }
  const bool side_by_side = parts->tiled && parts->tile_width != static_cast<std::uint32_t>(image.width);
  if (compressed ? !parts->tiled && parts->offset.size() > 1 : side_by_side || !in_one_piece) {
    return fail(ErrorCode::unsupported,
                compressed ? "lossless JPEG in more than one strip is not supported: convert to tiles or one strip"
                           : "uncompressed image data in more than one piece is not supported: convert to one strip");
  }
  const std::int64_t row_bits = std::int64_t{image.width} * image.samples * image.bits;
  const std::int64_t needed = (row_bits + 7) / 8 * image.height;
  if (!compressed && total < static_cast<double>(needed)) {
    return fail(ErrorCode::malformed, "the image data has " + number_text(total) + " bytes, " +
                                          std::to_string(image.width) + " x " + std::to_string(image.height) +
                                          " pixels of " + std::to_string(image.bits) + " bits need " +
                                          std::to_string(needed));
  }
  return {};
}

Result<void> fill_layout(const TiffDirectory& directory, DngImage& image) {
  auto photometric = required(directory, tag::photometric);
  if (!photometric) return pass_on(photometric);
  if (*photometric == tag::photometric_cfa) {
    if (image.samples != 1) {
      return fail(ErrorCode::unsupported, "mosaics with more than one sample per pixel are not supported",
                  tag::samples_per_pixel.name);
    }
    auto phase = phase_of(directory);
    if (!phase) return pass_on(phase);
    image.phase = *phase;
    return {};
  }
  if (image.samples != 1 && image.samples != 3) {
    return fail(ErrorCode::unsupported,
                "LinearRaw images of " + std::to_string(image.samples) + " samples are not supported, 1 and 3 are",
                tag::samples_per_pixel.name);
  }
  auto planar = directory.whole_or(tag::planar_configuration, 1);
  if (!planar) return pass_on(planar);
  if (image.samples == 3 && *planar != 1) {
    return fail(ErrorCode::unsupported, "images stored colour after colour are not supported",
                tag::planar_configuration.name);
  }
  image.layout = image.samples == 1 ? SensorLayout::monochrome : SensorLayout::linear_rgb;
  return {};
}

}  // namespace

std::string compression_name(std::uint32_t compression) {
  constexpr std::pair<std::uint32_t, const char*> names[] = {
      {1, "none"},        {5, "LZW"},           {6, "old JPEG"},      {7, "lossless JPEG"},
      {8, "Deflate"},     {9, "VC-5 (GPR)"},    {32773, "PackBits"},  {34892, "lossy JPEG"},
      {52546, "JPEG XL"}, {34713, "Nikon NEF"}, {65535, "Pentax PEF"}};
  for (const auto& [number, name] : names) {
    if (number == compression) return std::string(name) + ", compression " + std::to_string(compression);
  }
  return "an unknown method, compression " + std::to_string(compression);
}

Result<DngImage> dng_image(const TiffDirectory& directory, std::size_t file_bytes) {
  auto width = required(directory, tag::image_width);
  if (!width) return pass_on(width);
  auto height = required(directory, tag::image_length);
  if (!height) return pass_on(height);
  auto samples = directory.whole_or(tag::samples_per_pixel, 1);
  if (!samples) return pass_on(samples);
  auto compression = directory.whole_or(tag::compression, compression_none);
  if (!compression) return pass_on(compression);
  if (*width < min_size || *height < min_size || *width > max_size || *height > max_size) {
    return fail(ErrorCode::malformed, "a raw image of " + std::to_string(*width) + " x " + std::to_string(*height) +
                                          " pixels cannot be decoded, 22 to 65535 each way can");
  }
  if (auto known = check_compression(*compression); !known) return pass_on(known);
  DngImage image;
  image.width = static_cast<int>(*width);
  image.height = static_cast<int>(*height);
  image.samples = static_cast<int>(std::min<std::uint32_t>(*samples, 65535));
  auto bits = bits_of(directory, image.samples);
  if (!bits) return pass_on(bits);
  image.bits = *bits;
  if (auto layout = fill_layout(directory, image); !layout) return pass_on(layout);
  if (auto stored = check_storage(directory, image, *compression == compression_jpeg, file_bytes); !stored) {
    return pass_on(stored);
  }
  return image;
}

}  // namespace lowlux::capture
