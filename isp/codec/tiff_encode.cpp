#include <tiffio.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>
#include <vector>

#include "isp/codec/tiff.h"
#include "isp/codec/tiff_client.h"
#include "isp/codec/tiff_info.h"

namespace lowlux::isp {
namespace {

constexpr std::size_t strip_bytes = std::size_t{1} << 20;
constexpr std::uint64_t classic_limit = 3'900'000'000;  // offsets of 32 bits, with room for directories

/// The caller's stream as libtiff sees it. C wants a seek between reading and writing.
struct Output {
  std::FILE* file;
  int write_errno = 0;
  TiffMessages messages;
};

Output* output_of(thandle_t handle) { return static_cast<Output*>(handle); }

tmsize_t read_file(thandle_t handle, void* data, tmsize_t size) {
  std::FILE* file = output_of(handle)->file;
  if (fseeko(file, 0, SEEK_CUR) != 0) return -1;
  const auto count = std::fread(data, 1, static_cast<std::size_t>(size), file);
  return fseeko(file, 0, SEEK_CUR) == 0 ? static_cast<tmsize_t>(count) : -1;
}

void keep_errno(Output& output) {
  if (output.write_errno == 0) output.write_errno = errno == 0 ? EIO : errno;
}

tmsize_t write_file(thandle_t handle, void* data, tmsize_t size) {
  errno = 0;
  const auto count = std::fwrite(data, 1, static_cast<std::size_t>(size), output_of(handle)->file);
  if (count != static_cast<std::size_t>(size)) keep_errno(*output_of(handle));
  return static_cast<tmsize_t>(count);
}

toff_t seek_file(thandle_t handle, toff_t offset, int whence) {
  errno = 0;
  std::FILE* file = output_of(handle)->file;
  if (fseeko(file, static_cast<off_t>(offset), whence) != 0) {  // it flushes first, and so may find the disk full
    keep_errno(*output_of(handle));
    return static_cast<toff_t>(-1);
  }
  return static_cast<toff_t>(ftello(file));
}

toff_t size_of_file(thandle_t handle) {
  std::FILE* file = output_of(handle)->file;
  const off_t here = ftello(file);
  if (fseeko(file, 0, SEEK_END) != 0) return 0;
  const off_t size = ftello(file);
  return fseeko(file, here, SEEK_SET) == 0 ? static_cast<toff_t>(size) : 0;
}

int keep_open(thandle_t /*handle*/) { return 0; }

int keep_error(TIFF* /*tiff*/, void* user, const char* /*module*/, const char* format, va_list arguments) {
  static_cast<Output*>(user)->messages.keep(format, arguments);
  return 1;
}

int ignore_warning(TIFF* /*tiff*/, void* /*user*/, const char* /*module*/, const char* /*format*/, va_list /*list*/) {
  return 1;
}

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using TiffHandle = std::unique_ptr<TIFF, CloseTiff>;

TiffHandle open_output(Output& output, bool big) {
  TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
  if (options == nullptr) return nullptr;
  TIFFOpenOptionsSetErrorHandlerExtR(options, keep_error, &output);
  TIFFOpenOptionsSetWarningHandlerExtR(options, ignore_warning, nullptr);
  TIFF* tiff = TIFFClientOpenExt("picture", big ? "w8" : "w", &output, read_file, write_file, seek_file, keep_open,
                                 size_of_file, nullptr, nullptr, options);
  TIFFOpenOptionsFree(options);
  return TiffHandle(tiff);
}

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
  const int rows = static_cast<int>(std::clamp<std::size_t>(strip_bytes / row_bytes, 1, picture.height()));
  const Layout layout{picture.width(), picture.height(), 8 * static_cast<int>(sample_bytes), rows};
  Output output{file, 0, {}};
  TiffHandle tiff = open_output(output, row_bytes * picture.height() > classic_limit);
  bool written = tiff != nullptr;
  if (written) {
    const std::uint64_t exif = write_tiff_exif(tiff.get(), metadata.info);
    set_tags(tiff.get(), layout, metadata, options);
    if (exif != 0) TIFFSetField(tiff.get(), TIFFTAG_EXIFIFD, exif);
    written = write_strips(tiff.get(), picture, layout) && TIFFWriteDirectory(tiff.get()) != 0;
  }
  tiff.reset();  // libtiff writes its last bytes here
  if (written && output.write_errno == 0 && output.messages.first_error.empty()) return {};
  errno = output.write_errno;
  if (errno != 0) return write_failure();
  return fail(ErrorCode::unwritable, "libtiff: " + output.messages.first_error);
}

}  // namespace

Result<void> encode_tiff(const Picture& picture, const FileMetadata& metadata, const TiffOptions& options,
                         std::FILE* file) try {
  return std::visit([&](const auto& image) { return encode(image, metadata, options, file); }, picture);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "no memory to write the TIFF");
}

}  // namespace lowlux::isp
