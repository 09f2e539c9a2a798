#include <png.h>

#include <algorithm>
#include <array>
#include <bit>
#include <csetjmp>
#include <cstdint>
#include <cstring>
#include <new>
#include <vector>

#include "isp/codec/png.h"

// libpng leaves a failed call by longjmp. Every function below that calls setjmp has only trivial locals and calls
// nothing but libpng, so that no destructor is skipped; all memory is owned by their callers.

namespace lowlux::isp {
namespace {

struct Source {
  std::span<const std::byte> left;
  std::array<char, 160> message{};  // of the last error
};

void read_bytes(png_structp png, png_bytep out, std::size_t count) {
  auto* source = static_cast<Source*>(png_get_io_ptr(png));
  if (count > source->left.size()) png_error(png, "the file ends in the middle of the picture");
  std::memcpy(out, source->left.data(), count);
  source->left = source->left.subspan(count);
}

[[noreturn]] void keep_message(png_structp png, png_const_charp message) {
  auto* source = static_cast<Source*>(png_get_error_ptr(png));
  std::strncpy(source->message.data(), message, source->message.size() - 1);
  png_longjmp(png, 1);
}

void ignore_warning(png_structp /*png*/, png_const_charp /*message*/) {}

struct Reader {
  png_structp png = nullptr;
  png_infop info = nullptr;

  explicit Reader(Source* source) {
    png = png_create_read_struct(PNG_LIBPNG_VER_STRING, source, keep_message, ignore_warning);
    if (png == nullptr) return;
    info = png_create_info_struct(png);
    png_set_read_fn(png, source, read_bytes);
  }
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
};

struct Header {
  png_uint_32 width = 0;
  png_uint_32 height = 0;
  int bits = 0;
  int colour = 0;
  std::size_t stored_row_bytes = 0;
};

/// Reads up to the pixels.
bool read_header(png_structp png, png_infop info, Header* out) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);  // ours come before memory is taken
  png_set_chunk_malloc_max(png, 64U << 20);
  png_set_chunk_cache_max(png, 64);
  png_read_info(png, info);
  png_get_IHDR(png, info, &out->width, &out->height, &out->bits, &out->colour, nullptr, nullptr, nullptr);
  out->stored_row_bytes = png_get_rowbytes(png, info);
  return true;
}

/// Asks libpng for RGB of 8 or 16 bits in the machine's byte order, and checks that a row has `row_bytes`.
bool ask_for_rgb(png_structp png, png_infop info, std::size_t row_bytes) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_expand(png);
  png_set_gray_to_rgb(png);
  png_set_strip_alpha(png);
  if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  if (png_get_rowbytes(png, info) != row_bytes) png_error(png, "the rows have an unexpected size");
  return true;
}

bool read_rows(png_structp png, png_infop info, png_bytepp rows) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_read_image(png, rows);
  png_read_end(png, info);
  return true;
}

FileMetadata metadata_of(png_structp png, png_infop info) {
  FileMetadata metadata;
  png_charp name = nullptr;
  int compression = 0;
  png_bytep bytes = nullptr;
  png_uint_32 size = 0;
  if (png_get_iCCP(png, info, &name, &compression, &bytes, &size) != 0) {
    const auto* first = reinterpret_cast<const std::byte*>(bytes);
    metadata.icc.assign(first, first + size);
  }
  if (png_get_eXIf_1(png, info, &size, &bytes) != 0) {
    const auto* first = reinterpret_cast<const std::byte*>(bytes);
    metadata.exif.assign(first, first + size);
  }
  return metadata;
}

tl::unexpected<Error> malformed(const Source& source) { return not_readable("PNG", source.message.data()); }

template <class Code>
Result<DecodedPicture> read_picture(Reader& reader, const Source& source, const Header& header) {
  Encoded<Code> picture{Plane<Code>(static_cast<int>(3 * header.width), static_cast<int>(header.height))};
  if (!ask_for_rgb(reader.png, reader.info, 3 * sizeof(Code) * header.width)) return malformed(source);
  std::vector<png_bytep> rows(header.height);
  for (png_uint_32 y = 0; y < header.height; ++y) {
    rows[y] = reinterpret_cast<png_bytep>(picture.codes.row(static_cast<int>(y)));
  }
  if (!read_rows(reader.png, reader.info, rows.data())) return malformed(source);
  return DecodedPicture{std::move(picture), metadata_of(reader.png, reader.info)};
}

}  // namespace

Result<DecodedPicture> decode_png(std::span<const std::byte> bytes, const DecodeLimits& limits) try {
  Source source{bytes};
  Reader reader(&source);
  if (reader.info == nullptr) return fail(ErrorCode::too_large, "no memory to read the PNG");
  Header header;
  if (!read_header(reader.png, reader.info, &header)) return malformed(source);
  if (auto size = check_size(header.width, header.height, limits); !size) return tl::make_unexpected(size.error());
  // Deflate shrinks at most 1032 to 1: a file shorter than that for its dimensions needs no memory to be refused.
  if (header.stored_row_bytes > 1032 * bytes.size() / header.height) {
    return fail(ErrorCode::malformed, "not a readable PNG: the file is too short for its " +
                                          std::to_string(header.width) + " x " + std::to_string(header.height) +
                                          " pixels");
  }
  return header.bits == 16 ? read_picture<std::uint16_t>(reader, source, header)
                           : read_picture<std::uint8_t>(reader, source, header);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "no memory for the pixels of the PNG");
}

}  // namespace lowlux::isp
