#include "capture/dng/dng_rows.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "capture/dng/dng_tags.h"
#include "capture/file/pass_on.h"
#include "isp/codec/code_rows.h"
#include "isp/codec/float_rows.h"
#include "isp/codec/lossless_jpeg_rows.h"

namespace lowlux::capture {
namespace {

struct RowParts {
  DngGrid grid;
  isp::RowStorage storage;
  int pixel_samples = 1;        // of a pixel, in a part
  std::size_t row_samples = 0;  // in a row of a part
  std::size_t row_bytes = 0;    // of a row of a part; in lossless JPEG at least
  bool is_jpeg = false;         // lossless, of integers
};

/// Returns the rows of the image in part i.
int rows_in(const RowParts& parts, const DngImage& image, std::size_t i) {
  return std::min(parts.grid.height, image.height - parts.grid.top(i));
}

tl::unexpected<Error> unsupported(const std::string& what, TagName name) {
  return fail(ErrorCode::unsupported, what, name.name);
}

/// Returns the factor of the samples per pixel by which a predictor looks back; 0 without a predictor (TIFF 6.0,
/// section 14; TIFF Technical Note 3; DNG 1.4, chapter 4, Predictor).
Result<int> predictor_factor(const TiffDirectory& directory, const DngImage& image) {
  auto predictor = directory.whole_or(tag::predictor, 1);
  if (!predictor) return pass_on(predictor);
  if (*predictor == 1) return 0;
  const std::uint32_t of_floats[] = {3, 34894, 34895}, of_codes[] = {2, 34892, 34893};
  const auto& known = image.is_float ? of_floats : of_codes;
  const auto* const at = std::find(std::begin(known), std::end(known), *predictor);
  if (at == std::end(known)) {
    return unsupported("predictor " + std::to_string(*predictor) + " of " +
                           (image.is_float ? "floating-point samples is not supported, 1, 3, 34894 and 34895 are"
                                           : "integers is not supported, 1, 2, 34892 and 34893 are"),
                       tag::predictor);
  }
  if (!image.is_float && image.bits % 8 != 0) {
    return unsupported("predictors of integers of " + std::to_string(image.bits) +
                           " bits are not supported, those of 8 and 16 bits are",
                       tag::predictor);
  }
  return 1 << (at - std::begin(known));
}

bool is_jpeg(const TiffDirectory& directory, const DngImage& image) {
  const auto compression = directory.whole_or(tag::compression, tag::compression_none);
  return compression && *compression == tag::compression_jpeg && !image.is_float;
}

/// @param pixel_samples  of a pixel, in a part
Result<isp::RowStorage> storage_of(const TiffDirectory& directory, const DngImage& image, int pixel_samples) {
  auto compression = directory.whole_or(tag::compression, tag::compression_none);
  if (!compression) return pass_on(compression);
  isp::RowStorage storage{
      .bits = image.bits, .big_endian = directory.big_endian, .has_bits_of_category_16 = image.is_dng_1_0};
  if (*compression == tag::compression_none || is_jpeg(directory, image)) return storage;
  if (!is_deflate(*compression)) {
    return unsupported("the floating-point image is compressed with " + compression_name(*compression) +
                           ", which is not supported: convert it to a DNG with Deflate or no compression",
                       tag::compression);
  }
  storage.deflated = true;
  auto factor = predictor_factor(directory, image);
  if (!factor) return pass_on(factor);
  storage.predictor_step = *factor * pixel_samples;
  return storage;
}

/// Checks that each part can hold its rows.
Result<void> check_lengths(const RowParts& parts, const DngImage& image) {
  for (std::size_t i = 0; i < parts.grid.count; ++i) {
    const auto bytes = static_cast<std::size_t>(parts.grid.at.bytes[i]);
    const int rows = rows_in(parts, image, i);
    const std::size_t needed = static_cast<std::size_t>(rows) * parts.row_bytes;
    if (needed <= (parts.storage.deflated ? isp::max_inflated_bytes(bytes) : bytes)) continue;
    return fail(ErrorCode::malformed, "a strip or tile of " + std::to_string(parts.grid.width) + " x " +
                                          std::to_string(rows) + " pixels has " + std::to_string(bytes) +
                                          " bytes, too few for " + std::to_string(needed) +
                                          " bytes of samples: the file is truncated or damaged");
  }
  return {};
}

Result<RowParts> row_parts(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  RowParts parts;
  parts.pixel_samples = image.is_planar ? 1 : image.samples;
  auto storage = storage_of(directory, image, parts.pixel_samples);
  if (!storage) return pass_on(storage);
  auto grid = dng_grid(directory, image, file_bytes);
  if (!grid) return pass_on(grid);
  parts.storage = *storage;
  parts.grid = *std::move(grid);
  parts.row_samples = static_cast<std::size_t>(parts.grid.width) * static_cast<std::size_t>(parts.pixel_samples);
  parts.is_jpeg = is_jpeg(directory, image);
  constexpr int min_jpeg_bits = 1;  // of a sample
  parts.row_bytes = image.is_float
                        ? isp::FloatRows::row_bytes(image.bits, parts.row_samples)
                        : isp::CodeRows::row_bytes(parts.is_jpeg ? min_jpeg_bits : image.bits, parts.row_samples);
  if (auto lengths = check_lengths(parts, image); !lengths) return pass_on(lengths);
  return parts;
}

/// Returns whether the parts follow each other without a gap.
bool are_adjacent(const DngParts& parts) {
  for (std::size_t i = 1; i < parts.offset.size(); ++i) {
    if (parts.offset[i] != parts.offset[i - 1] + parts.bytes[i - 1]) return false;
  }
  return true;
}

/// Returns whether no part but the last one has bytes after its rows.
bool are_full(const RowParts& parts) {
  const double bytes = static_cast<double>(parts.row_bytes) * parts.grid.height;
  const auto& stored = parts.grid.at.bytes;
  return std::all_of(stored.begin(), stored.end() - 1, [bytes](double of_part) { return of_part == bytes; });
}

/// Returns whether LibRaw decodes lossless JPEG in these parts: one strip, or tiles that are not wider than the image,
/// whose rows it would shift, nor of a monochrome image, of which it takes one component only.
bool is_jpeg_for_libraw(const TiffDirectory& directory, const DngImage& image, const DngParts& parts) {
  if (!parts.tiled) return parts.offset.size() == 1;
  const auto image_width = static_cast<std::uint32_t>(image.width);
  const auto width = directory.whole_or(tag::tile_width, image_width);  // as LibRaw takes it
  return image.layout != SensorLayout::monochrome && (!width || *width <= image_width);
}

/// Returns whether a part begins as JPEG does. LibRaw leaves others black, and reads more forms than LosslessJpegRows.
bool begins_jpeg(std::span<const std::byte> part) {
  return part.size() > 2 && part[0] == std::byte{0xFF} && part[1] == std::byte{0xD8} && part[2] == std::byte{0xFF};
}

/// Returns the error of part i, which is damaged.
tl::unexpected<Error> undecodable(const DngGrid& grid, std::size_t i) {
  return fail(ErrorCode::malformed, "the samples from column " + std::to_string(grid.left(i)) + ", row " +
                                        std::to_string(grid.top(i)) +
                                        " on do not decode: the file is truncated or damaged");
}

template <class Rows, class Sample>
Result<Plane<Sample>> decode(std::span<const std::byte> file, const TiffDirectory& directory, const DngImage& image) {
  auto parts = row_parts(directory, image, file.size());
  if (!parts) return pass_on(parts);
  const DngGrid& grid = parts->grid;
  Plane<Sample> out(image.width * image.samples, image.height);
  Rows rows(parts->storage, parts->row_samples);
  std::vector<Sample> row(parts->row_samples);
  for (std::size_t i = 0; i < grid.count; ++i) {
    const int x = grid.left(i), y = grid.top(i), used = std::min(grid.width, image.width - x);
    rows.open(grid.at.part(file, i));
    bool good = true;
    for (int r = 0; r < rows_in(*parts, image, i) && good; ++r) {
      good = rows.next(row);
      Sample* const to = out.row(y + r) + std::ptrdiff_t{x} * image.samples + grid.plane(i);
      if (!image.is_planar) {
        std::copy_n(row.begin(), std::ptrdiff_t{used} * image.samples, to);
      } else {
        for (int c = 0; c < used; ++c) to[std::ptrdiff_t{c} * image.samples] = row[static_cast<std::size_t>(c)];
      }
    }
    if (good && rows.ends_within(grid.height - rows_in(*parts, image, i))) continue;
    return undecodable(grid, i);
  }
  return out;
}

}  // namespace

Result<void> check_row_image(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  return row_parts(directory, image, file_bytes).map([](const RowParts& /*parts*/) {});
}

Result<void> check_jpeg_samples(std::span<const std::byte> file, const TiffDirectory& directory,
                                const DngImage& image) {
  if (!is_jpeg(directory, image)) return {};
  const auto parts = row_parts(directory, image, file.size());
  if (!parts) return {};  // tiles that share bytes, which LibRaw reads
  isp::LosslessJpegRows rows(parts->storage, parts->row_samples);
  for (std::size_t i = 0; i < parts->grid.count; ++i) {
    const auto part = parts->grid.at.part(file, i);
    rows.open(part);
    const std::size_t needed = static_cast<std::size_t>(rows_in(*parts, image, i)) * parts->row_samples;
    const bool is_other_jpeg = rows.samples() == 0 && begins_jpeg(part);
    if (!is_other_jpeg && rows.samples() < needed) return undecodable(parts->grid, i);
  }
  return {};
}

bool is_for_libraw(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  if (directory.is_big_tiff || image.is_planar || !is_libraw_size(image)) return false;
  const auto strips = dng_parts(directory, file_bytes);
  if (is_jpeg(directory, image)) return !strips || is_jpeg_for_libraw(directory, image, *strips);
  if (!strips || strips->tiled || !are_adjacent(*strips)) return false;
  const std::size_t row_samples = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.samples);
  const double needed = static_cast<double>(isp::CodeRows::row_bytes(image.bits, row_samples)) * image.height;
  if (std::accumulate(strips->bytes.begin(), strips->bytes.end(), 0.0) < needed) return false;
  const auto parts = row_parts(directory, image, file_bytes);
  return !parts || are_full(*parts);  // a wrong RowsPerStrip does not matter to LibRaw
}

Result<Plane<std::uint16_t>> decode_code_image(std::span<const std::byte> file, const TiffDirectory& directory,
                                               const DngImage& image) {
  if (is_jpeg(directory, image)) return decode<isp::LosslessJpegRows, std::uint16_t>(file, directory, image);
  return decode<isp::CodeRows, std::uint16_t>(file, directory, image);
}

Result<Plane<float>> decode_float_image(std::span<const std::byte> file, const TiffDirectory& directory,
                                        const DngImage& image) {
  return decode<isp::FloatRows, float>(file, directory, image);
}

}  // namespace lowlux::capture
