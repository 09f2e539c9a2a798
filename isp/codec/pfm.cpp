#include "isp/codec/pfm.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <limits>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/text.h"

namespace lowlux::isp {
namespace {

constexpr std::size_t longest_word = 32;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

std::uint32_t swapped(std::uint32_t word) {
  return word >> 24 | (word >> 8 & 0xFF00U) | (word << 8 & 0xFF0000U) | word << 24;
}

/// Removes and returns the next word of the header and the one blank that ends it; nullopt if no word of valid length
/// follows.
std::optional<std::string_view> take_word(std::string_view& text) {
  const auto begin = static_cast<std::size_t>(std::find_if_not(text.begin(), text.end(), is_blank) - text.begin());
  text.remove_prefix(begin);
  const auto size = static_cast<std::size_t>(std::find_if(text.begin(), text.end(), is_blank) - text.begin());
  if (size == 0 || size > longest_word || size == text.size()) return std::nullopt;
  const std::string_view word = text.substr(0, size);
  text.remove_prefix(size + 1);
  return word;
}

template <class Number>
std::optional<Number> take_number(std::string_view& text) {
  const auto word = take_word(text);
  Number number{};
  if (!word) return std::nullopt;
  const auto [end, error] = std::from_chars(word->data(), word->data() + word->size(), number);
  if (error != std::errc() || end != word->data() + word->size()) return std::nullopt;
  return number;
}

struct Header {
  int samples = 3;
  std::int64_t width = 0;
  std::int64_t height = 0;
  double scale = 0;
};

tl::unexpected<Error> malformed(const std::string& why) {
  return fail(ErrorCode::malformed, "not a readable PFM: " + why);
}

/// Removes the header from the front of `text` and returns it.
Result<Header> take_header(std::string_view& text) {
  Header header;
  const auto kind = take_word(text);
  if (kind != "PF" && kind != "Pf") return malformed("it begins with neither PF nor Pf");
  header.samples = kind == "PF" ? 3 : 1;
  const auto width = take_number<std::int64_t>(text);
  const auto height = width ? take_number<std::int64_t>(text) : std::nullopt;
  const auto scale = height ? take_number<double>(text) : std::nullopt;
  if (!scale) return malformed("its header is not a width, a height and a scale");
  header.width = *width;
  header.height = *height;
  header.scale = *scale;
  if (header.scale != 1 && header.scale != -1) {
    return fail(ErrorCode::unsupported, "the PFM has a scale of " + number_text(header.scale) +
                                            ", lowlux reads 1 and -1: multiply it into the values");
  }
  return header;
}

void put_row(const std::vector<std::uint32_t>& row, int samples, int y, SceneLinear& picture) {
  for (int c = 0; c < 3; ++c) {
    float* out = picture.plane[c].row(y);
    const std::uint32_t* in = row.data() + (samples == 3 ? c : 0);
    for (int x = 0; x < picture.width(); ++x) out[x] = std::bit_cast<float>(in[std::ptrdiff_t{samples} * x]);
  }
}

}  // namespace

namespace {

/// Writes a file from samples.
/// @param sample_at  value of sample i of row y
template <class SampleAt>
Result<void> encode(const char* kind, int samples, int width, int height, const SampleAt& sample_at,
                    std::FILE* file) try {
  constexpr DecodeLimits any_number{std::numeric_limits<std::int64_t>::max()};
  if (auto size = check_size(width, height, any_number); !size) return size;
  const std::string header =
      std::string(kind) + "\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1.0\n";
  if (auto written = write_bytes(file, std::as_bytes(std::span(header))); !written) return written;
  std::vector<std::uint32_t> row(static_cast<std::size_t>(samples) * width);
  for (int y = height - 1; y >= 0; --y) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const auto word = std::bit_cast<std::uint32_t>(sample_at(y, i));
      row[i] = std::endian::native == std::endian::little ? word : swapped(word);
    }
    if (auto written = write_bytes(file, std::as_bytes(std::span(row))); !written) return written;
  }
  return {};
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "no memory to write the PFM");
}

}  // namespace

Result<void> encode_pfm(const SceneLinear& picture, std::FILE* file) {
  return encode(
      "PF", 3, picture.width(), picture.height(),
      [&](int y, std::size_t i) { return picture.plane[i % 3].row(y)[i / 3]; }, file);
}

Result<void> encode_pfm(PlaneView<const float> plane, std::FILE* file) {
  return encode(
      "Pf", 1, plane.width, plane.height, [&](int y, std::size_t i) { return plane.row(y)[i]; }, file);
}

Result<DecodedPicture> decode_pfm(std::span<const std::byte> bytes, const DecodeLimits& limits) try {
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto header = take_header(text);
  if (!header) return tl::make_unexpected(header.error());
  if (auto size = check_size(header->width, header->height, limits); !size) return tl::make_unexpected(size.error());
  const auto row_bytes = 4 * static_cast<std::size_t>(header->width) * header->samples;
  if (text.size() / row_bytes < static_cast<std::size_t>(header->height)) {
    return malformed("it ends before its " + std::to_string(header->width) + " x " + std::to_string(header->height) +
                     " pixels do");
  }
  const bool stored_little = header->scale < 0;
  const bool swap = stored_little != (std::endian::native == std::endian::little);
  SceneLinear picture(static_cast<int>(header->width), static_cast<int>(header->height));
  std::vector<std::uint32_t> row(row_bytes / 4);
  for (int y = picture.height() - 1; y >= 0; --y) {
    std::memcpy(row.data(), text.data(), row_bytes);
    text.remove_prefix(row_bytes);
    if (swap) std::transform(row.begin(), row.end(), row.begin(), swapped);
    put_row(row, header->samples, y, picture);
  }
  return DecodedPicture{std::move(picture), {}};
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "no memory for the pixels of the PFM");
}

}  // namespace lowlux::isp
