#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <new>
#include <vector>

#include "isp/codec/png.h"

namespace lowlux::isp {
namespace {

constexpr std::size_t stretch_bytes = std::size_t{1} << 20;

void put_u32(std::uint32_t number, std::vector<std::byte>& out) {
  for (const int shift : {24, 16, 8, 0}) out.push_back(static_cast<std::byte>(number >> shift));
}

const Bytef* as_bytef(const std::byte* bytes) { return reinterpret_cast<const Bytef*>(bytes); }
Bytef* as_bytef(std::byte* bytes) { return reinterpret_cast<Bytef*>(bytes); }

/// One chunk: length, type, data, CRC over type and data (PNG 5.3).
Result<void> write_chunk(const char (&type)[5], std::span<const std::byte> data, std::FILE* file) {
  if (data.size() > 0x7FFFFFFF) return fail(ErrorCode::unsupported, "a PNG chunk cannot hold more than 2 GB");
  std::vector<std::byte> head;
  put_u32(static_cast<std::uint32_t>(data.size()), head);
  for (int i = 0; i < 4; ++i) head.push_back(static_cast<std::byte>(type[i]));
  uLong crc = crc32(0, as_bytef(head.data() + 4), 4);
  if (!data.empty()) crc = crc32_z(crc, as_bytef(data.data()), data.size());  // a null pointer would reset it
  std::vector<std::byte> tail;
  put_u32(static_cast<std::uint32_t>(crc), tail);
  return write_bytes(file, head).and_then([&] { return write_bytes(file, data); }).and_then([&] {
    return write_bytes(file, tail);
  });
}

/// Signature, IHDR, and the chunks that must come before the pixels.
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

/// A row of codes as PNG stores it: most significant byte first.
void store_row(const std::uint8_t* codes, std::size_t count, std::uint8_t* out) { std::memcpy(out, codes, count); }
void store_row(const std::uint16_t* codes, std::size_t count, std::uint8_t* out) {
  for (std::size_t i = 0; i < count; ++i) {
    out[2 * i] = static_cast<std::uint8_t>(codes[i] >> 8);
    out[2 * i + 1] = static_cast<std::uint8_t>(codes[i]);
  }
}

/// Filter type 3 (PNG 9.2): each byte less floor((left + above) / 2).
void filter_average(const std::uint8_t* row, const std::uint8_t* above, std::size_t size, std::size_t pixel_bytes,
                    std::uint8_t* out) {
  for (std::size_t i = 0; i < pixel_bytes; ++i) out[i] = static_cast<std::uint8_t>(row[i] - (above[i] >> 1));
  for (std::size_t i = pixel_bytes; i < size; ++i) {
    out[i] = static_cast<std::uint8_t>(row[i] - ((row[i - pixel_bytes] + above[i]) >> 1));
  }
}

/// Compresses one stretch of rows; owns all memory that takes, so that workers allocate only inside zlib.
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

  /// Rows first..last - 1, as raw deflate blocks that end on a byte; the last stretch closes the stream.
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

  /// What compress() made; empty if zlib had no memory.
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

/// One zlib stream (RFC 1950) in IDAT chunks, one for each stretch of rows.
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
      if (deflated.empty()) return fail(ErrorCode::too_large, "no memory to compress the picture");
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
    return fail(ErrorCode::too_large, "no memory to compress the picture");
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
