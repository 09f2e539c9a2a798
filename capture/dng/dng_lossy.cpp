#include "capture/dng/dng_lossy.h"

#include <algorithm>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "capture/dng/dng_tags.h"
#include "capture/file/pass_on.h"
#include "isp/codec/jpeg.h"

namespace lowlux::capture {
namespace {

Result<DngGrid> lossy_grid(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  if (image.layout == SensorLayout::bayer || image.bits != 8) {
    return fail(ErrorCode::unsupported,
                "lossy JPEG is supported for LinearRaw images of 8 bits only: convert it to a DNG with lossless JPEG",
                tag::compression.name);
  }
  return dng_grid(directory, image, file_bytes);
}

/// Returns the codes of one part, interleaved R G B; grey has three equal samples.
Result<Plane<std::uint8_t>> decode_part(std::span<const std::byte> bytes, int width, int rows, int height) {
  auto decoded = isp::decode_jpeg(bytes, {.max_pixels = std::int64_t{width} * height});
  if (!decoded) return tl::make_unexpected(std::move(decoded.error()));
  auto& picture = std::get<Encoded8>(decoded->picture);
  if (picture.width() == width && (picture.height() == height || picture.height() == rows)) {
    return std::move(picture.codes);
  }
  return fail(ErrorCode::malformed, "it has " + std::to_string(picture.width()) + " x " +
                                        std::to_string(picture.height()) + " pixels, expected " +
                                        std::to_string(width) + " x " + std::to_string(height));
}

}  // namespace

Result<void> check_lossy_image(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  return lossy_grid(directory, image, file_bytes).map([](const DngGrid& /*grid*/) {});
}

Result<Plane<std::uint16_t>> decode_lossy_image(std::span<const std::byte> file, const TiffDirectory& directory,
                                                const DngImage& image) {
  auto grid = lossy_grid(directory, image, file.size());
  if (!grid) return pass_on(grid);
  Plane<std::uint16_t> out(image.width * image.samples, image.height);
  for (std::size_t i = 0; i < grid->count; ++i) {
    const int left = grid->left(i), top = grid->top(i);
    const int rows = std::min(grid->height, image.height - top), columns = std::min(grid->width, image.width - left);
    auto part = decode_part(grid->at.part(file, i), grid->width, rows, grid->height);
    if (!part) {
      return fail(ErrorCode::malformed, "the lossy JPEG from column " + std::to_string(left) + ", row " +
                                            std::to_string(top) + " on does not decode: " + part.error().message);
    }
    const int step = image.samples == 1 ? 3 : 1;
    for (int y = 0; y < rows; ++y) {
      std::uint16_t* to = out.row(top + y) + static_cast<std::ptrdiff_t>(left) * image.samples;
      const std::uint8_t* from = part->row(y);
      for (int x = 0; x < columns * image.samples; ++x) to[x] = from[static_cast<std::ptrdiff_t>(x) * step];
    }
  }
  return out;
}

}  // namespace lowlux::capture
