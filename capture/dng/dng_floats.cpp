#include "capture/dng/dng_floats.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "capture/dng/dng_tags.h"
#include "capture/file/pass_on.h"
#include "isp/codec/float_rows.h"

namespace lowlux::capture {
namespace {

struct FloatParts {
  DngGrid grid;
  isp::FloatStorage storage;
  std::size_t row_samples = 0;  // in a row of a part

  std::size_t row_bytes() const { return row_samples * static_cast<std::size_t>(storage.bits / 8); }
};

/// Returns the rows of the image in part i.
int rows_in(const FloatParts& parts, const DngImage& image, std::size_t i) {
  return std::min(parts.grid.height, image.height - parts.grid.top(i));
}

tl::unexpected<Error> unsupported(const std::string& what, TagName name) {
  return fail(ErrorCode::unsupported, what, name.name);
}

/// Returns the factor of the samples per pixel by which a predictor looks back; 0 without a predictor (TIFF Technical
/// Note 3; DNG 1.4, chapter 4, Predictor).
Result<int> predictor_factor(const TiffDirectory& directory) {
  auto predictor = directory.whole_or(tag::predictor, 1);
  if (!predictor) return pass_on(predictor);
  switch (*predictor) {
    case 1:
      return 0;
    case 3:
      return 1;
    case 34894:
      return 2;
    case 34895:
      return 4;
    default:
      return unsupported("predictor " + std::to_string(*predictor) +
                             " of floating-point samples is not supported, 1, "
                             "3, 34894 and 34895 are",
                         tag::predictor);
  }
}

Result<isp::FloatStorage> storage_of(const TiffDirectory& directory, const DngImage& image) {
  auto compression = directory.whole_or(tag::compression, tag::compression_none);
  if (!compression) return pass_on(compression);
  isp::FloatStorage storage{.bits = image.bits, .big_endian = directory.big_endian};
  if (*compression == tag::compression_none) return storage;
  if (*compression != tag::compression_deflate && *compression != tag::compression_old_deflate) {
    return unsupported("the floating-point image is compressed with " + compression_name(*compression) +
                           ", which is not supported: convert it to a DNG with Deflate or no compression",
                       tag::compression);
  }
  storage.deflated = true;
  auto factor = predictor_factor(directory);
  if (!factor) return pass_on(factor);
  storage.predictor_step = *factor * image.samples;
  return storage;
}

/// Checks that each part can hold its rows.
Result<void> check_lengths(const FloatParts& parts, const DngImage& image) {
  for (std::size_t i = 0; i < parts.grid.count; ++i) {
    const auto bytes = static_cast<std::size_t>(parts.grid.at.bytes[i]);
    const std::size_t needed = static_cast<std::size_t>(rows_in(parts, image, i)) * parts.row_bytes();
    if (needed <= (parts.storage.deflated ? isp::max_inflated_bytes(bytes) : bytes)) continue;
    return fail(ErrorCode::malformed, "a strip or tile of the image has " + std::to_string(bytes) +
                                          " bytes, too few "
                                          "for " +
                                          std::to_string(needed) +
                                          " bytes of floating-point samples: the file "
                                          "is truncated or damaged");
  }
  return {};
}

Result<FloatParts> float_parts(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  auto storage = storage_of(directory, image);
  if (!storage) return pass_on(storage);
  auto grid = dng_grid(directory, image, file_bytes);
  if (!grid) return pass_on(grid);
  const std::size_t row_samples = static_cast<std::size_t>(grid->width) * static_cast<std::size_t>(image.samples);
  const FloatParts parts{.grid = *std::move(grid), .storage = *storage, .row_samples = row_samples};
  if (auto lengths = check_lengths(parts, image); !lengths) return pass_on(lengths);
  return parts;
}

}  // namespace

Result<void> check_float_image(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  return float_parts(directory, image, file_bytes).map([](const FloatParts& /*parts*/) {});
}

Result<Plane<float>> decode_float_image(std::span<const std::byte> file, const TiffDirectory& directory,
                                        const DngImage& image) {
  auto parts = float_parts(directory, image, file.size());
  if (!parts) return pass_on(parts);
  Plane<float> out(image.width * image.samples, image.height);
  isp::FloatRows rows(parts->storage, parts->row_samples);
  std::vector<float> row(parts->row_samples);
  for (std::size_t i = 0; i < parts->grid.count; ++i) {
    const int x = parts->grid.left(i), y = parts->grid.top(i);
    const int used = std::min(parts->grid.width, image.width - x) * image.samples;
    rows.open(parts->grid.at.part(file, i));
    bool good = true;
    for (int r = 0; r < rows_in(*parts, image, i) && good; ++r) {
      good = rows.next(row);
      std::copy_n(row.begin(), used, out.row(y + r) + x * image.samples);
    }
    if (good && rows.ends_within(parts->grid.height - rows_in(*parts, image, i))) continue;
    return fail(ErrorCode::malformed, "the floating-point samples from column " + std::to_string(x) + ", row " +
                                          std::to_string(y) + " on do not decode: the file is truncated or damaged");
  }
  return out;
}

}  // namespace lowlux::capture
