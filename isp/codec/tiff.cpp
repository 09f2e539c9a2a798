#include "isp/codec/tiff.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>
#include <vector>

#include <tiffio.h>

#include "isp/codec/source_tags_output.h"
#include "isp/codec/tiff_file.h"

namespace lowlux::isp {
namespace {

constexpr tmsize_t max_one_allocation = tmsize_t{1} << 30;

struct Input {
  std::span<const std::byte> bytes;
  std::uint64_t place = 0;
  TiffMessages messages;
};

Input* input_of(thandle_t handle) { return static_cast<Input*>(handle); }

tmsize_t read_bytes(thandle_t handle, void* data, tmsize_t size) {
  Input& in = *input_of(handle);
  const std::uint64_t left = in.place < in.bytes.size() ? in.bytes.size() - in.place : 0;
  const auto count = std::min<std::uint64_t>(left, size < 0 ? 0 : static_cast<std::uint64_t>(size));
  if (count > 0) std::memcpy(data, in.bytes.data() + in.place, count);
  in.place += count;
  return static_cast<tmsize_t>(count);
}

tmsize_t refuse_to_write(thandle_t /*handle*/, void* /*data*/, tmsize_t /*size*/) { return -1; }

toff_t seek_bytes(thandle_t handle, toff_t offset, int whence) {
  Input& in = *input_of(handle);
  const std::uint64_t base = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? in.place : in.bytes.size();
  in.place = base + offset;
  return in.place;
}

toff_t size_of_bytes(thandle_t handle) { return input_of(handle)->bytes.size(); }

int keep_open(thandle_t /*handle*/) { return 0; }

int keep_error(TIFF* /*tiff*/, void* user, const char* /*module*/, const char* format, va_list arguments) {
  static_cast<Input*>(user)->messages.keep(format, arguments);
  return 1;
}

int ignore_warning(TIFF* /*tiff*/, void* /*user*/, const char* /*module*/, const char* /*format*/, va_list /*list*/) {
  return 1;
}

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using TiffHandle = std::unique_ptr<TIFF, CloseTiff>;

TiffHandle open_input(Input& input) {
  TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
  if (options == nullptr) return nullptr;
  TIFFOpenOptionsSetMaxSingleMemAlloc(options, max_one_allocation);
  TIFFOpenOptionsSetErrorHandlerExtR(options, keep_error, &input);
  TIFFOpenOptionsSetWarningHandlerExtR(options, ignore_warning, nullptr);
  TIFF* tiff = TIFFClientOpenExt("picture", "rm", &input, read_bytes, refuse_to_write, seek_bytes, keep_open,
                                 size_of_bytes, nullptr, nullptr, options);
  TIFFOpenOptionsFree(options);
  return TiffHandle(tiff);
}

struct Layout {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint16_t bits = 1;
  std::uint16_t samples = 1;
  std::uint16_t format = SAMPLEFORMAT_UINT;
  std::uint16_t photometric = 0;
  std::uint16_t planar = PLANARCONFIG_CONTIG;
  bool grey() const { return photometric != PHOTOMETRIC_RGB; }
};

Layout layout_of(TIFF* tiff) {
  Layout layout;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &layout.width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &layout.height);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &layout.bits);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &layout.samples);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &layout.format);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &layout.planar);
  if (TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &layout.photometric) == 0) {
    layout.photometric = std::numeric_limits<std::uint16_t>::max();
  }
  return layout;
}

tl::unexpected<Error> unsupported(const std::string& what) {
  return fail(ErrorCode::unsupported,
              "the TIFF has " + what + ": lowlux reads grey and RGB of 8 or 16 bits or 32-bit floats");
}

Result<void> check_layout(const Layout& layout, const DecodeLimits& limits) {
  if (auto size = check_size(layout.width, layout.height, limits); !size) return size;
  const bool integers = layout.format == SAMPLEFORMAT_UINT && (layout.bits == 8 || layout.bits == 16);
  const bool floats = layout.format == SAMPLEFORMAT_IEEEFP && layout.bits == 32;
  if (!integers && !floats) {
    return unsupported(std::to_string(layout.bits) + "-bit samples of format " + std::to_string(layout.format));
  }
  const bool known = layout.photometric == PHOTOMETRIC_RGB || layout.photometric == PHOTOMETRIC_MINISBLACK ||
                     (layout.photometric == PHOTOMETRIC_MINISWHITE && integers);
  if (!known) return unsupported("photometric interpretation " + std::to_string(layout.photometric));
  const int needed = layout.grey() ? 1 : 3;
  if (layout.samples < needed || layout.samples > 64) {
    return unsupported(std::to_string(layout.samples) + " samples per pixel");
  }
  return {};
}

tl::unexpected<Error> malformed(const Input& input) {
  const std::string& why = input.messages.first_error;
  return not_readable("TIFF", why.empty() ? "the pixels do not decode" : why);
}

/// Describes `count` samples of one colour, from pixel (x, y) on.
struct Run {
  int colour = 0;
  int x = 0;
  int y = 0;
  int count = 0;
};

template <class Code>
void put(Encoded<Code>& picture, const Run& run, const Code* in, int step) {
  Code* out = picture.codes.row(run.y) + std::ptrdiff_t{3} * run.x + run.colour;
  for (std::ptrdiff_t i = 0; i < run.count; ++i) out[3 * i] = in[i * step];
}

void put(SceneLinear& picture, const Run& run, const float* in, int step) {
  float* out = picture.plane[run.colour].row(run.y) + run.x;
  for (std::ptrdiff_t i = 0; i < run.count; ++i) out[i] = in[i * step];
}

template <class Image, class Sample>
void put_pixels(Image& picture, const Layout& layout, Run run, const Sample* in) {
  for (run.colour = 0; run.colour < 3; ++run.colour) {
    put(picture, run, in + (layout.grey() ? 0 : run.colour), layout.samples);
  }
}

template <class Sample, class Image>
bool read_strips(TIFF* tiff, const Layout& layout, Image& picture) {
  const bool separate = layout.planar == PLANARCONFIG_SEPARATE;
  const std::size_t row_samples = static_cast<std::size_t>(layout.width) * (separate ? 1 : layout.samples);
  if (TIFFScanlineSize64(tiff) != row_samples * sizeof(Sample)) return false;
  std::vector<Sample> row(row_samples);
  const int planes = separate && !layout.grey() ? 3 : 1;
  for (int plane = 0; plane < planes; ++plane) {
    for (std::uint32_t y = 0; y < layout.height; ++y) {
      if (TIFFReadScanline(tiff, row.data(), y, static_cast<std::uint16_t>(plane)) != 1) return false;
      const Run run{plane, 0, static_cast<int>(y), static_cast<int>(layout.width)};
      if (!separate) {
        put_pixels(picture, layout, run, row.data());
      } else if (layout.grey()) {
        Layout single = layout;
        single.samples = 1;
        put_pixels(picture, single, run, row.data());
      } else {
        put(picture, run, row.data(), 1);
      }
    }
  }
  return true;
}

template <class Sample, class Image>
bool read_tiles(TIFF* tiff, const Layout& layout, const DecodeLimits& limits, Image& picture) {
  std::uint32_t tile_width = 0, tile_height = 0;
  TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &tile_width);
  TIFFGetField(tiff, TIFFTAG_TILELENGTH, &tile_height);
  if (!check_size(tile_width, tile_height, limits)) return false;
  const std::size_t row_samples = static_cast<std::size_t>(tile_width) * layout.samples;
  const std::size_t samples = row_samples * tile_height;
  if (TIFFTileSize64(tiff) != samples * sizeof(Sample) || samples > max_one_allocation / sizeof(Sample)) return false;
  std::vector<Sample> tile(samples);
  for (std::uint32_t y = 0; y < layout.height; y += tile_height) {
    for (std::uint32_t x = 0; x < layout.width; x += tile_width) {
      if (TIFFReadTile(tiff, tile.data(), x, y, 0, 0) < 0) return false;
      const int count = static_cast<int>(std::min(tile_width, layout.width - x));
      const std::uint32_t rows = std::min(tile_height, layout.height - y);
      for (std::uint32_t r = 0; r < rows; ++r) {
        put_pixels(picture, layout, {0, static_cast<int>(x), static_cast<int>(y + r), count},
                   tile.data() + r * row_samples);
      }
    }
  }
  return true;
}

template <class Code>
void invert(Encoded<Code>& picture) {
  Code* codes = picture.codes.data();
  for (std::size_t i = 0; i < picture.codes.size(); ++i) codes[i] = static_cast<Code>(~codes[i]);
}

void invert(SceneLinear& /*picture*/) {}  // check_layout rejects floats where 0 is white

/// Returns the metadata of the file. Leaves the file at its EXIF directory if it has one: call it last.
FileMetadata metadata_of(TIFF* tiff) {
  FileMetadata metadata;
  std::uint32_t size = 0;
  const void* profile = nullptr;
  if (TIFFGetField(tiff, TIFFTAG_ICCPROFILE, &size, &profile) != 0 && profile != nullptr) {
    const auto* first = static_cast<const std::byte*>(profile);
    metadata.icc.assign(first, first + size);
  }
  metadata.info = read_tiff_info(tiff);
  return metadata;
}

template <class Sample, class Image>
Result<DecodedPicture> read_picture(TIFF* tiff, const Layout& layout, const DecodeLimits& limits, const Input& input,
                                    Image picture) {
  const bool tiled = TIFFIsTiled(tiff) != 0;
  if (tiled && layout.planar == PLANARCONFIG_SEPARATE) return unsupported("tiles with separate planes");
  const bool read =
      tiled ? read_tiles<Sample>(tiff, layout, limits, picture) : read_strips<Sample>(tiff, layout, picture);
  if (!read) return malformed(input);
  if (layout.photometric == PHOTOMETRIC_MINISWHITE) invert(picture);
  return DecodedPicture{std::move(picture), metadata_of(tiff)};
}

}  // namespace

Result<DecodedPicture> decode_tiff(std::span<const std::byte> bytes, const DecodeLimits& limits) try {
  Input input{bytes, 0, {}};
  const TiffHandle tiff = open_input(input);
  if (tiff == nullptr) return malformed(input);
  const Layout layout = layout_of(tiff.get());
  if (auto possible = check_layout(layout, limits); !possible) return tl::make_unexpected(possible.error());
  const int width = static_cast<int>(layout.width), height = static_cast<int>(layout.height);
  if (layout.bits == 8) {
    return read_picture<std::uint8_t>(tiff.get(), layout, limits, input,
                                      Encoded8{Plane<std::uint8_t>(3 * width, height)});
  }
  if (layout.bits == 16) {
    return read_picture<std::uint16_t>(tiff.get(), layout, limits, input,
                                       Encoded16{Plane<std::uint16_t>(3 * width, height)});
  }
  return read_picture<float>(tiff.get(), layout, limits, input, SceneLinear(width, height));
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "no memory for the pixels of the TIFF");
}

namespace {

struct OutputLayout {
  int width = 0;
  int height = 0;
  int bits = 0;
  int rows_per_strip = 0;
};

void set_tags(TIFF* tiff, const OutputLayout& layout, const FileMetadata& metadata, const TiffOptions& options) {
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
    TIFFSetField(tiff, TIFFTAG_ZIPQUALITY, 1);  // matches are rare in noise: higher levels cost time and save little
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
bool write_strips(TIFF* tiff, const Image& picture, const OutputLayout& layout) {
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
  const OutputLayout layout{picture.width(), picture.height(), 8 * static_cast<int>(sample_bytes), rows};
  TiffOutput output(file, row_bytes * picture.height() > tiff_classic_limit);
  TIFF* tiff = output.handle();
  if (tiff == nullptr) return output.finish(false);
  const std::uint64_t exif = write_tiff_exif(tiff, metadata.info);
  set_tags(tiff, layout, metadata, options);
  if (exif != 0) TIFFSetField(tiff, TIFFTAG_EXIFIFD, exif);
  return output.finish(write_strips(tiff, picture, layout) && TIFFWriteDirectory(tiff) != 0).and_then([&] {
    return metadata.source_tags ? add_source_tags(file, *metadata.source_tags) : Result<void>{};
  });
}

}  // namespace

Result<void> encode_tiff(const Picture& picture, const FileMetadata& metadata, const TiffOptions& options,
                         std::FILE* file) try {
  return std::visit([&](const auto& image) { return encode(image, metadata, options, file); }, picture);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "no memory to write the TIFF");
}

}  // namespace lowlux::isp
