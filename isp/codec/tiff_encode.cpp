#include <tiffio.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <new>
#include <type_traits>
#include <vector>

#include "isp/codec/tiff.h"
#include "isp/codec/tiff_info.h"
#include "isp/codec/tiff_output.h"

namespace lowlux::isp {
namespace {

struct Layout {
  int width = 0;
  int height = 0;
  int bits = 0;
  int rows_per_strip = 0;
};

void set_tags(TIFF* tiff, const Layout& layout, const FileMetadata& metadata, const TiffOptions& options) {
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, layout.width);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, layout.height);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, layout.bits);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 3);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, layout.bits == 32 ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, layout.rows_per_strip);
  if (options.compression == TiffOptions::Compression::deflate) {
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
    TIFFSetField(tiff, TIFFTAG_PREDICTOR, layout.bits == 32 ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL);
    TIFFSetField(tiff, TIFFTAG_ZIPQUALITY, 1);  // matches are rare in noise: higher levels cost time and gain little
  } else {
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  }
  if (!metadata.icc.empty()) {
    TIFFSetField(tiff, TIFFTAG_ICCPROFILE, static_cast<std::uint32_t>(metadata.icc.size()), metadata.icc.data());
  }
  set_tiff_info(tiff, metadata.info);
}

template <class Code>
void interleave_row(const Encoded<Code>& picture, int y, Code* out) {
  std::memcpy(out, picture.codes.row(y), picture.codes.width() * sizeof(Code));
}

void interleave_row(const SceneLinear& picture, int y, float* out) {
  for (int c = 0; c < 3; ++c) {
    const float* in = picture.plane[c].row(y);
    for (int x = 0; x < picture.width(); ++x) out[3 * x + c] = in[x];
  }
}

template <class Image>
struct SampleOf {
  using Type = float;
};
template <class Code>
struct SampleOf<Encoded<Code>> {
  using Type = Code;
};

template <class Image>
bool write_strips(TIFF* tiff, const Image& picture, const Layout& layout) {
  using Sample = typename SampleOf<Image>::Type;
  const std::size_t row_samples = 3 * static_cast<std::size_t>(layout.width);
  std::vector<Sample> strip(row_samples * layout.rows_per_strip);
  std::uint32_t index = 0;
  for (int y = 0; y < layout.height; y += layout.rows_per_strip, ++index) {
    const int rows = std::min(layout.rows_per_strip, layout.height - y);
    for (int r = 0; r < rows; ++r) interleave_row(picture, y + r, strip.data() + r * row_samples);
    const auto size = static_cast<tmsize_t>(rows * row_samples * sizeof(Sample));
    if (TIFFWriteEncodedStrip(tiff, index, strip.data(), size) != size) return false;
  }
  return true;
}

template <class Image>
Result<void> encode(const Image& picture, const FileMetadata& metadata, const TiffOptions& options, std::FILE* file) {
  constexpr DecodeLimits any_number{std::numeric_limits<std::int64_t>::max()};
  if (auto size = check_size(picture.width(), picture.height(), any_number); !size) return size;
  constexpr std::size_t sample_bytes = sizeof(typename SampleOf<Image>::Type);
  const std::size_t row_bytes = 3 * sample_bytes * picture.width();
  const int rows = static_cast<int>(std::clamp<std::size_t>(tiff_strip_bytes / row_bytes, 1, picture.height()));
  const Layout layout{picture.width(), picture.height(), 8 * static_cast<int>(sample_bytes), rows};
  TiffOutput output(file, row_bytes * picture.height() > tiff_classic_limit);
  TIFF* tiff = output.handle();
  if (tiff == nullptr) return output.finish(false);
  const std::uint64_t exif = write_tiff_exif(tiff, metadata.info);
  set_tags(tiff, layout, metadata, options);
  if (exif != 0) TIFFSetField(tiff, TIFFTAG_EXIFIFD, exif);
  return output.finish(write_strips(tiff, picture, layout) && TIFFWriteDirectory(tiff) != 0);
}

}  // namespace

Result<void> encode_tiff(const Picture& picture, const FileMetadata& metadata, const TiffOptions& options,
                         std::FILE* file) try {
  return std::visit([&](const auto& image) { return encode(image, metadata, options, file); }, picture);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "no memory to write the TIFF");
}

}  // namespace lowlux::isp
