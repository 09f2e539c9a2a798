#include "isp/codec/png.h"

#include <algorithm>
#include <array>
#include <bit>
#include <csetjmp>
#include <cstdint>
#include <cstring>
#include <limits>
#include <new>
#include <vector>

#include <png.h>
#include <zlib.h>

// libpng leaves a failed call by longjmp. Every function below that calls setjmp has only trivial locals and calls
// nothing but libpng, so that no destructor is skipped; all memory is owned by their callers.

namespace lowlux::isp {
namespace {

struct Source {
  std::span<const std::byte> left;
  std::array<char, 160> message{};  // message of the last error
};

void read_bytes(png_structp png, png_bytep out, std::size_t count) {
  auto* source = static_cast<Source*>(png_get_io_ptr(png));
  if (count > source->left.size()) png_error(png, "the file ends in the middle of the image");
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

/// Reads the file up to the pixels.
bool read_header(png_structp png, png_infop info, Header* out) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);  // check_size limits the size before memory is allocated
  png_set_chunk_malloc_max(png, 64U << 20);
  png_set_chunk_cache_max(png, 64);
  png_read_info(png, info);
  png_get_IHDR(png, info, &out->width, &out->height, &out->bits, &out->colour, nullptr, nullptr, nullptr);
  out->stored_row_bytes = png_get_rowbytes(png, info);
  return true;
}

/// Requests RGB of 8 or 16 bits from libpng in the machine's byte order, and checks that a row has `row_bytes`.
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
  // Deflate shrinks at most 1032 to 1: a file too short for its dimensions is rejected without allocating memory.
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

namespace {

constexpr std::size_t stretch_bytes = std::size_t{1} << 20;

void put_u32(std::uint32_t number, std::vector<std::byte>& out) {
  for (const int shift : {24, 16, 8, 0}) out.push_back(static_cast<std::byte>(number >> shift));
}

const Bytef* as_bytef(const std::byte* bytes) { return reinterpret_cast<const Bytef*>(bytes); }
Bytef* as_bytef(std::byte* bytes) { return reinterpret_cast<Bytef*>(bytes); }

/// Writes one chunk: length, type, data, CRC over type and data (PNG 5.3).
Result<void> write_chunk(const char (&type)[5], std::span<const std::byte> data, std::FILE* file) {
  if (data.size() > 0x7FFFFFFF) return fail(ErrorCode::unsupported, "a PNG chunk cannot hold more than 2 GB");
  std::vector<std::byte> head;
  put_u32(static_cast<std::uint32_t>(data.size()), head);
  for (int i = 0; i < 4; ++i) head.push_back(static_cast<std::byte>(type[i]));
  uLong crc = crc32(0, as_bytef(head.data() + 4), 4);
  if (!data.empty()) crc = crc32_z(crc, as_bytef(data.data()), data.size());  // a null pointer would reset the CRC
  std::vector<std::byte> tail;
  put_u32(static_cast<std::uint32_t>(crc), tail);
  return write_bytes(file, head).and_then([&] { return write_bytes(file, data); }).and_then([&] {
    return write_bytes(file, tail);
  });
}

/// Writes the signature, IHDR, and the chunks that must precede the pixels.
Result<void> write_head(int width, int height, int bits, const FileMetadata& metadata, std::FILE* file) {
  constexpr std::array<unsigned char, 8> signature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  std::vector<std::byte> header;
  put_u32(static_cast<std::uint32_t>(width), header);
  put_u32(static_cast<std::uint32_t>(height), header);
  for (const int field : {bits, 2 /* RGB */, 0, 0, 0}) header.push_back(static_cast<std::byte>(field));
  auto written = write_bytes(file, std::as_bytes(std::span(signature))).and_then([&] {
    return write_chunk("IHDR", header, file);
  });
  if (written && !metadata.icc.empty()) {
    std::vector<std::byte> profile;
    for (const char c : {'I', 'C', 'C', '\0', '\0'}) profile.push_back(static_cast<std::byte>(c));  // name, method 0
    uLongf size = compressBound(metadata.icc.size());
    const std::size_t head_size = profile.size();
    profile.resize(head_size + size);
    if (compress2(as_bytef(profile.data() + head_size), &size, as_bytef(metadata.icc.data()), metadata.icc.size(), 9) !=
        Z_OK) {
      return fail(ErrorCode::too_large, "no memory to compress the ICC profile");
    }
    profile.resize(head_size + size);
    written = write_chunk("iCCP", profile, file);
  }
  if (written && !metadata.exif.empty()) written = write_chunk("eXIf", metadata.exif, file);
  return written;
}

/// Stores a row of codes as PNG does: most significant byte first.
void store_row(const std::uint8_t* codes, std::size_t count, std::uint8_t* out) { std::memcpy(out, codes, count); }
void store_row(const std::uint16_t* codes, std::size_t count, std::uint8_t* out) {
  for (std::size_t i = 0; i < count; ++i) {
    out[2 * i] = static_cast<std::uint8_t>(codes[i] >> 8);
    out[2 * i + 1] = static_cast<std::uint8_t>(codes[i]);
  }
}

/// Applies filter type 3 (PNG 9.2): each byte minus floor((left + above) / 2).
void filter_average(const std::uint8_t* row, const std::uint8_t* above, std::size_t size, std::size_t pixel_bytes,
                    std::uint8_t* out) {
  for (std::size_t i = 0; i < pixel_bytes; ++i) out[i] = static_cast<std::uint8_t>(row[i] - (above[i] >> 1));
  for (std::size_t i = pixel_bytes; i < size; ++i) {
    out[i] = static_cast<std::uint8_t>(row[i] - ((row[i - pixel_bytes] + above[i]) >> 1));
  }
}

/// Compresses one block of rows; owns all memory it needs, so that workers allocate only inside zlib.
template <class Code>
class StretchCompressor {
 public:
  StretchCompressor(const Encoded<Code>& picture, int max_rows)
      : picture_(picture),
        row_bytes_(static_cast<std::size_t>(picture.codes.width()) * sizeof(Code)),
        row_(row_bytes_),
        above_(row_bytes_),
        filtered_(max_rows * (row_bytes_ + 1)),
        deflated_(filtered_.size() + filtered_.size() / 8 + 1024) {}  // above zlib's own bound for raw deflate

  /// Compresses rows first..last - 1 as raw deflate blocks that end on a byte; the last block closes the stream.
  void compress(int first, int last) noexcept {
    filter(first, last);
    const std::size_t size = (last - first) * (row_bytes_ + 1);
    adler_ = adler32_z(1, filtered_.data(), size);
    filtered_size_ = size;
    deflated_size_ = 0;
    z_stream stream{};
    if (deflateInit2(&stream, 1, Z_DEFLATED, -15, 9, Z_RLE) != Z_OK) return;
    stream.next_in = filtered_.data();
    stream.avail_in = static_cast<uInt>(size);
    stream.next_out = deflated_.data();
    stream.avail_out = static_cast<uInt>(deflated_.size());
    const bool at_end = last == picture_.height();
    const int status = deflate(&stream, at_end ? Z_FINISH : Z_SYNC_FLUSH);
    if (stream.avail_in == 0 && stream.avail_out > 0 && status == (at_end ? Z_STREAM_END : Z_OK)) {
      deflated_size_ = stream.total_out;
    }
    deflateEnd(&stream);
  }

  /// Returns the result of compress(); empty if zlib had no memory.
  std::span<const std::uint8_t> deflated() const { return {deflated_.data(), deflated_size_}; }
  uLong adler() const { return adler_; }
  std::size_t filtered_size() const { return filtered_size_; }

 private:
  void filter(int first, int last) noexcept {
    std::fill(above_.begin(), above_.end(), std::uint8_t{0});
    const std::size_t count = picture_.codes.width();
    if (first > 0) store_row(picture_.codes.row(first - 1), count, above_.data());
    std::uint8_t* out = filtered_.data();
    for (int y = first; y < last; ++y, out += row_bytes_ + 1) {
      store_row(picture_.codes.row(y), count, row_.data());
      out[0] = 3;
      filter_average(row_.data(), above_.data(), row_bytes_, 3 * sizeof(Code), out + 1);
      row_.swap(above_);
    }
  }

  const Encoded<Code>& picture_;
  std::size_t row_bytes_;
  std::vector<std::uint8_t> row_, above_, filtered_, deflated_;
  std::size_t filtered_size_ = 0;
  std::size_t deflated_size_ = 0;
  uLong adler_ = 1;
};

/// Writes one zlib stream (RFC 1950) in IDAT chunks, one for each block of rows.
template <class Code>
Result<void> write_pixels(const Encoded<Code>& picture, Executor& executor, std::FILE* file) {
  const std::size_t row_bytes = static_cast<std::size_t>(picture.codes.width()) * sizeof(Code);
  const int rows = static_cast<int>(std::clamp<std::size_t>(stretch_bytes / row_bytes, 1, picture.height()));
  const int stretches = (picture.height() + rows - 1) / rows;
  const int parallel = std::min(executor.width(), stretches);
  std::vector<StretchCompressor<Code>> compressor(parallel, StretchCompressor<Code>(picture, rows));
  std::vector<std::byte> chunk{std::byte{0x78}, std::byte{0x01}};  // deflate, 32 kB window, fastest
  uLong adler = 1;
  for (int done = 0; done < stretches; done += parallel) {
    const int count = std::min(parallel, stretches - done);
    for_each_index(executor, count, [&](int i) {
      compressor[i].compress((done + i) * rows, std::min((done + i + 1) * rows, picture.height()));
    });
    for (int i = 0; i < count; ++i) {
      const auto deflated = std::as_bytes(compressor[i].deflated());
      if (deflated.empty()) return fail(ErrorCode::too_large, "no memory to compress the image");
      adler = adler32_combine(adler, compressor[i].adler(), static_cast<z_off_t>(compressor[i].filtered_size()));
      chunk.insert(chunk.end(), deflated.begin(), deflated.end());
      if (done + i + 1 == stretches) put_u32(static_cast<std::uint32_t>(adler), chunk);
      if (auto written = write_chunk("IDAT", chunk, file); !written) return written;
      chunk.clear();
    }
  }
  return {};
}

template <class Code>
Result<void> encode(const Encoded<Code>& picture, const FileMetadata& metadata, Executor& executor, std::FILE* file) {
  constexpr DecodeLimits any_number{std::numeric_limits<std::int64_t>::max()};
  if (auto size = check_size(picture.width(), picture.height(), any_number); !size) return size;
  try {
    return write_head(picture.width(), picture.height(), 8 * sizeof(Code), metadata, file)
        .and_then([&] { return write_pixels(picture, executor, file); })
        .and_then([&] { return write_chunk("IEND", {}, file); });
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::too_large, "no memory to compress the image");
  }
}

}  // namespace

Result<void> encode_png(const Encoded8& picture, const FileMetadata& metadata, Executor& executor, std::FILE* file) {
  return encode(picture, metadata, executor, file);
}

Result<void> encode_png(const Encoded16& picture, const FileMetadata& metadata, Executor& executor, std::FILE* file) {
  return encode(picture, metadata, executor, file);
}

}  // namespace lowlux::isp
