#include "capture/dng/dng_jpeg_xl.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "capture/decoder/decoder_process.h"
#include "capture/decoder/jpeg_xl_decoder.h"
#include "capture/file/pass_on.h"

namespace lowlux::capture {
namespace {

void append(std::vector<std::byte>& out, std::span<const std::byte> bytes) {
  out.insert(out.end(), bytes.begin(), bytes.end());
}

/// Returns the job of the decoder: the parts of the image, one after another.
std::vector<std::byte> job_of(std::span<const std::byte> file, const DngImage& image, const DngGrid& grid) {
  const JpegXlJob job{.width = image.width,
                      .height = image.height,
                      .samples = image.samples,
                      .bits = image.bits,
                      .part_width = grid.width,
                      .part_height = grid.height,
                      .parts = grid.count};
  std::vector<std::byte> out;
  append(out, std::as_bytes(std::span(&job, 1)));
  for (std::size_t i = 0; i < grid.count; ++i) {
    const std::uint64_t size = grid.at.part(file, i).size();
    append(out, std::as_bytes(std::span(&size, 1)));
  }
  for (std::size_t i = 0; i < grid.count; ++i) append(out, grid.at.part(file, i));
  return out;
}

/// Returns the place of each stored row or column.
std::vector<int> places(int count, int factor) {
  std::vector<int> out;
  for (int first = 0; first < factor; ++first) {
    for (int at = first; at < count; at += factor) out.push_back(at);
  }
  return out;
}

/// Puts rows and columns that are stored apart in their places. DNG stores every `factor`-th row of an image, then the
/// rows after these, and so on (RowInterleaveFactor, ColumnInterleaveFactor): of a mosaic, each of four colours as an
/// image of its own.
Plane<std::uint16_t> without_interleave(const Plane<std::uint16_t>& stored, const DngImage& image) {
  const std::vector<int> rows = places(image.height, image.row_interleave);
  const std::vector<int> columns = places(image.width, image.column_interleave);
  Plane<std::uint16_t> out(stored.width(), stored.height());
  for (int y = 0; y < image.height; ++y) {
    const std::uint16_t* from = stored.row(y);
    std::uint16_t* to = out.row(rows[static_cast<std::size_t>(y)]);
    for (int x = 0; x < image.width; ++x) {
      const std::ptrdiff_t place = columns[static_cast<std::size_t>(x)];
      std::copy_n(from + std::ptrdiff_t{x} * image.samples, image.samples, to + place * image.samples);
    }
  }
  return out;
}

}  // namespace

Result<void> check_jpeg_xl_image(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  return dng_grid(directory, image, file_bytes).map([](const DngGrid& /*grid*/) {});
}

Result<Plane<std::uint16_t>> decode_jpeg_xl_image(std::span<const std::byte> file, const TiffDirectory& directory,
                                                  const DngImage& image, const ReadLimits& limits) {
  auto grid = dng_grid(directory, image, file.size());
  if (!grid) return pass_on(grid);
  auto decoded = decode_contained(job_of(file, image, *grid), limits, DecoderProgram::libjxl);
  if (!decoded) return pass_on(decoded);
  if (decoded->samples.width() != image.width * image.samples || decoded->samples.height() != image.height) {
    return fail(ErrorCode::malformed, "the decoder of JPEG XL delivers another size than the image has");
  }
  if (image.row_interleave == 1 && image.column_interleave == 1) return std::move(decoded->samples);
  return without_interleave(decoded->samples, image);
}

}  // namespace lowlux::capture
