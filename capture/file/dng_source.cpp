#include "capture/file/dng_source.h"

#include <algorithm>
#include <new>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "capture/decoder/decoder_name.h"
#include "capture/decoder/decoder_process.h"
#include "capture/dng/dng_colour.h"
#include "capture/dng/dng_file.h"
#include "capture/dng/dng_frame.h"
#include "capture/dng/dng_jpeg_xl.h"
#include "capture/dng/dng_levels.h"
#include "capture/dng/dng_lossy.h"
#include "capture/dng/dng_rows.h"
#include "capture/dng/dng_tags.h"
#include "capture/dng/source_tags.h"
#include "capture/dng/tiff_directory.h"
#include "capture/file/decoder_frame.h"
#include "capture/file/file_bytes.h"
#include "capture/file/pass_on.h"

namespace lowlux::capture {
namespace {

constexpr std::size_t text_sample_bytes = std::size_t{1} << 20;

/// Returns the number of bytes of the UTF-8 character at the front of `text`; 0 if there is no printable one.
std::size_t printable_bytes(std::string_view text) {
  const auto first = static_cast<unsigned char>(text[0]);
  if (first < 0x80) return (first >= ' ' && first != 127) || first == '\n' || first == '\r' || first == '\t' ? 1 : 0;
  if (first < 0xC2 || first > 0xF4) return 0;
  const std::size_t size = first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  if (size > text.size()) return 0;
  const auto follows = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80; };
  return std::all_of(text.begin() + 1, text.begin() + static_cast<std::ptrdiff_t>(size), follows) ? size : 0;
}

/// Returns whether all of the first megabyte of the file is printable UTF-8. Less is not sufficient: the samples of a
/// raw without a header can be printable for some rows.
bool is_printable(std::string_view file) {
  constexpr std::size_t longest_character = 4;
  const std::size_t end = std::min(file.size(), text_sample_bytes);
  for (std::size_t at = 0; at < end;) {
    const std::size_t size = printable_bytes(file.substr(at, longest_character));
    if (size == 0) return false;
    at += size;
  }
  return true;
}

/// Returns whether the file is text: printable, in lines. The samples of an evenly lit 8-bit raw without a header can
/// be printable for a megabyte, but then none of them is the end of a line.
bool is_text(std::string_view file) {
  constexpr std::size_t longest_line = 65536;
  for (std::size_t at = 0; at < std::min(file.size(), text_sample_bytes);) {
    const std::size_t end = std::min(file.find('\n', at), file.size());
    if (end - at > longest_line) return false;
    at = end + 1;
  }
  return is_printable(file);
}

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

struct Kind {
  std::string_view magic;
  const char* what;
};

/// Returns the kind of a file that cannot be a raw, by its first bytes; empty if that is unknown. It is called before
/// the decoder, which accepts anything of certain sizes as a headerless dump.
std::string other_kind(std::span<const std::byte> bytes) {
  using std::string_view_literals::operator""sv;
  const std::string_view file = text_of(bytes);
  constexpr Kind kinds[] = {{"\x89PNG"sv, "a PNG image"},
                            {"GIF8"sv, "a GIF image"},
                            {"%PDF"sv, "a PDF document"},
                            {"\x76\x2F\x31\x01"sv, "an OpenEXR image"}};
  for (const Kind& kind : kinds) {
    if (file.starts_with(kind.magic)) return kind.what;
  }
  return is_text(file) ? "text" : "";
}

bool is_jpeg(std::span<const std::byte> bytes) {
  return bytes.size() > 2 && bytes[0] == std::byte{0xFF} && bytes[1] == std::byte{0xD8} && bytes[2] == std::byte{0xFF};
}

/// Returns the error of a file that is not a DNG and that the decoder rejected. JPEG files can hold a raw after the
/// image, and most raws begin as TIFF: only now is it known that they are ordinary images.
Error not_decoded(std::span<const std::byte> bytes, Error error) {
  if (is_jpeg(bytes)) return {ErrorCode::unsupported, "this is a JPEG image, not a raw file", {}};
  if (is_printable(text_of(bytes))) return {ErrorCode::unsupported, "this is text, not a raw file", {}};
  if (error.code == ErrorCode::unsupported && TiffFile::open(bytes)) {
    error.message = "this is a TIFF image, or a raw file that is damaged or unknown to " + decoder_name();
  }
  return error;
}

/// Returns the tags that the decoder is not to see: LinearizationTable, which opcodes of OpcodeList1 precede, and
/// damaged tags that make it reject the file, although the samples do not need them.
std::vector<const TiffEntry*> hidden_tags(const DngFile& dng) {
  std::vector<const TiffEntry*> found;
  for (const TiffDirectory& directory : dng.raw_images) {
    if (const TiffEntry* table = directory.find(tag::linearization_table)) found.push_back(table);
  }
  for (const auto* directories : {&dng.raw_images, &dng.previews}) {
    for (const TiffDirectory& directory : *directories) {
      if (!read_scale(directory)) found.push_back(directory.find(tag::default_scale));
    }
  }
  if (!dng.exif && dng.main.find(tag::exif_ifd) != nullptr) found.push_back(dng.main.find(tag::exif_ifd));
  return found;
}

/// Decodes a copy of the file in which hidden tags have the number 0.
Result<DecodedRaw> decode_dng(const DngFile& dng, std::span<const std::byte> bytes, const ReadLimits& limits) {
  const auto hidden = hidden_tags(dng);
  if (hidden.empty()) return decode_contained(bytes, limits);
  std::vector<std::byte> changed(bytes.begin(), bytes.end());
  for (const TiffEntry* entry : hidden) std::fill_n(changed.begin() + entry->place, 2, std::byte{0});
  return decode_contained(changed, limits);
}

/// Returns the error of a file with far too few bytes for its samples, which decoders leave black. Lossless JPEG needs
/// at least an eighth of a byte for each sample.
Result<void> check_bytes(std::size_t bytes, const DecodedRaw& decoded) {
  constexpr std::size_t max_samples_per_byte = 128;
  if (decoded.samples.size() / max_samples_per_byte <= bytes) return {};
  return fail(ErrorCode::malformed, "the file has " + std::to_string(bytes) + " bytes, too few for " +
                                        std::to_string(decoded.header.raw_width) + " x " +
                                        std::to_string(decoded.header.raw_height) +
                                        " pixels: it is truncated or holds no image");
}

Result<RawFrame> read_dng(const DngFile& dng, std::span<const std::byte> bytes, const ReadLimits& limits,
                          const XTransUse& use) {
  auto described = describe_dng(dng, dng.raw_images.front(), bytes.size());
  if (!described) return pass_on(described);
  const DngImage& image = described->image;
  if (std::int64_t{image.width} * image.height > limits.max_pixels) {
    return fail(ErrorCode::too_large, "the raw image of " + std::to_string(image.width) + " x " +
                                          std::to_string(image.height) + " pixels is over the limit of " +
                                          std::to_string(limits.max_pixels) + " pixels");
  }
  const TiffDirectory& raw_image = *described->directory;
  switch (image.decoder) {
    case DngDecoder::lossy_jpeg: {
      auto codes = decode_lossy_image(bytes, raw_image, image);
      if (!codes) return pass_on(codes);
      return complete_dng(dng, *std::move(described), *std::move(codes), use);
    }
    case DngDecoder::jpeg_xl: {
      auto codes = decode_jpeg_xl_image(bytes, raw_image, image, limits);
      if (!codes) return pass_on(codes);
      return complete_dng(dng, *std::move(described), *std::move(codes), use);
    }
    case DngDecoder::rows: {
      if (image.is_float) {
        auto samples = decode_float_image(bytes, raw_image, image);
        if (!samples) return pass_on(samples);
        return complete_dng(dng, *std::move(described), *std::move(samples), use);
      }
      auto codes = decode_code_image(bytes, raw_image, image);
      if (!codes) return pass_on(codes);
      return complete_dng(dng, *std::move(described), *std::move(codes), use);
    }
    case DngDecoder::libraw:
      break;
  }
  if (auto enough = check_jpeg_samples(bytes, raw_image, image); !enough) return pass_on(enough);
  auto decoded = decode_dng(dng, bytes, limits);
  if (!decoded) return pass_on(decoded);
  return complete_dng(dng, *std::move(described), bytes.size(), *std::move(decoded), use);
}

Result<RawFrame> read_bytes(std::span<const std::byte> bytes, const ReadLimits& limits, const XTransUse& use) {
  if (bytes.empty()) return fail(ErrorCode::malformed, "the file is empty");
  if (bytes.size() > limits.max_file_bytes) return too_many_bytes(bytes.size(), limits.max_file_bytes);
  auto dng = open_dng(bytes);
  if (!dng) return pass_on(dng);
  if (*dng) {
    auto frame = read_dng(**dng, bytes, limits, use);
    if (frame) frame->source_tags = dng_source_tags(bytes, **dng, frame->warnings);
    return frame;
  }
  if (const std::string kind = other_kind(bytes); !kind.empty()) {
    return fail(ErrorCode::unsupported, "this is " + kind + ", not a raw file");
  }
  auto decoded = decode_contained(bytes, limits);
  if (!decoded) return tl::make_unexpected(not_decoded(bytes, std::move(decoded.error())));
  if (auto enough = check_bytes(bytes.size(), *decoded); !enough) return pass_on(enough);
  auto frame = frame_of_decoder(*std::move(decoded), use);
  if (!frame) return frame;
  ignore_impossible_white(frame->colour, frame->warnings);
  frame->source_tags = raw_source_tags(bytes, frame->warnings);
  name_camera_as_file(bytes, *frame);
  return frame;
}

}  // namespace

Result<RawFrame> read_raw(const std::filesystem::path& file, const ReadLimits& limits, const XTransUse& use) {
  auto bytes = read_file_bytes(file, limits.max_file_bytes);
  if (!bytes) return pass_on(bytes);
  return read_raw(*bytes, file.string(), limits, use);
}

Result<RawFrame> read_raw(std::span<const std::byte> bytes, const std::string& name, const ReadLimits& limits,
                          const XTransUse& use) {
  try {
    auto frame = read_bytes(bytes, limits, use);
    if (!frame) frame.error().where = name;
    return frame;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::too_large, "there is not enough memory for this file", name);
  }
}

}  // namespace lowlux::capture
