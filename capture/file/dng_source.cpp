#include "capture/file/dng_source.h"

#include <algorithm>
#include <new>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "capture/file/decoder_frame.h"
#include "capture/file/decoder_process.h"
#include "capture/file/dng_file.h"
#include "capture/file/dng_frame.h"
#include "capture/file/file_bytes.h"
#include "capture/file/libraw_decoder.h"
#include "capture/file/pass_on.h"
#include "capture/file/tiff_directory.h"

namespace lowlux::capture {
namespace {

/// Whether the first bytes are text: no raw format begins with 64 characters that can be printed. Bytes from 128 on
/// are taken for UTF-8, which has none from 0xF5 on.
bool looks_like_text(std::string_view head) {
  return std::all_of(head.begin(), head.end(), [](char c) {
    const auto code = static_cast<unsigned char>(c);
    return (code >= ' ' && code < 0xF5 && code != 127) || c == '\n' || c == '\r' || c == '\t';
  });
}

struct Kind {
  std::string_view magic;
  const char* what;
};

/// What a file that can be no raw is, judged by its first bytes; empty if that is unknown. It is asked before the
/// decoder, which takes anything of certain sizes for a headerless dump.
std::string other_kind(std::span<const std::byte> bytes) {
  using std::string_view_literals::operator""sv;
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()), std::min<std::size_t>(bytes.size(), 64));
  constexpr Kind kinds[] = {{"\x89PNG"sv, "a PNG picture"},
                            {"GIF8"sv, "a GIF picture"},
                            {"%PDF"sv, "a PDF document"},
                            {"\x76\x2F\x31\x01"sv, "an OpenEXR picture"}};
  for (const Kind& kind : kinds) {
    if (head.starts_with(kind.magic)) return kind.what;
  }
  return looks_like_text(head) ? "text" : "";
}

bool is_jpeg(std::span<const std::byte> bytes) {
  return bytes.size() > 2 && bytes[0] == std::byte{0xFF} && bytes[1] == std::byte{0xD8} && bytes[2] == std::byte{0xFF};
}

/// The error of a file that is not a DNG and that the decoder did not take. JPEG files can hold a raw behind the
/// picture, and most raws begin as TIFF: they are known for pictures only now.
Error not_decoded(std::span<const std::byte> bytes, Error error) {
  if (is_jpeg(bytes)) return {ErrorCode::unsupported, "this is a JPEG picture, not a raw file", {}};
  if (error.code == ErrorCode::unsupported && TiffFile::open(bytes)) {
    error.message = "this is a TIFF picture, or a raw file that is damaged or unknown to " + decoder_name();
  }
  return error;
}

Result<RawFrame> read_dng(const DngFile& dng, std::span<const std::byte> bytes, const ReadLimits& limits) {
  auto described = describe_dng(dng, dng.raw_images.front(), bytes.size());
  if (!described) return pass_on(described);
  const DngImage& image = described->image;
  if (std::int64_t{image.width} * image.height > limits.max_pixels) {
    return fail(ErrorCode::too_large, "the raw image of " + std::to_string(image.width) + " x " +
                                          std::to_string(image.height) + " pixels is over the limit of " +
                                          std::to_string(limits.max_pixels) + " pixels");
  }
  auto decoded = decode_contained(bytes, limits, decode_with_libraw);
  if (!decoded) return pass_on(decoded);
  return complete_dng(dng, *std::move(described), bytes.size(), *std::move(decoded));
}

Result<RawFrame> read_bytes(std::span<const std::byte> bytes, const ReadLimits& limits) {
  if (bytes.empty()) return fail(ErrorCode::malformed, "the file is empty");
  if (bytes.size() > limits.max_file_bytes) return too_many_bytes(bytes.size(), limits.max_file_bytes);
  auto dng = open_dng(bytes);
  if (!dng) return pass_on(dng);
  if (*dng) return read_dng(**dng, bytes, limits);
  if (const std::string kind = other_kind(bytes); !kind.empty()) {
    return fail(ErrorCode::unsupported, "this is " + kind + ", not a raw file");
  }
  auto decoded = decode_contained(bytes, limits, decode_with_libraw);
  if (!decoded) return tl::make_unexpected(not_decoded(bytes, std::move(decoded.error())));
  return frame_of_decoder(*std::move(decoded));
}

}  // namespace

Result<RawFrame> read_raw(const std::filesystem::path& file, const ReadLimits& limits) {
  auto bytes = read_file_bytes(file, limits.max_file_bytes);
  if (!bytes) return pass_on(bytes);
  return read_raw(*bytes, file.string(), limits);
}

Result<RawFrame> read_raw(std::span<const std::byte> bytes, const std::string& name, const ReadLimits& limits) {
  try {
    auto frame = read_bytes(bytes, limits);
    if (!frame) frame.error().where = name;
    return frame;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::too_large, "there is not enough memory for this file", name);
  }
}

}  // namespace lowlux::capture
