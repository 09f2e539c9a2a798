#include "isp/codec/ppm.h"

#include <cstdint>
#include <limits>
#include <new>
#include <optional>
#include <string>
#include <utility>

namespace lowlux::isp {
namespace {

constexpr int max_digits = 10;

tl::unexpected<Error> malformed(const std::string& why) {
  return fail(ErrorCode::malformed, "not a readable PPM: " + why);
}

bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Reads the header, byte by byte.
class HeaderReader {
 public:
  explicit HeaderReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  /// Returns the next number, after blanks and comments; nullopt if something else follows.
  std::optional<std::int64_t> number() {
    while (at_ < bytes_.size() && (is_blank(here()) || here() == '#')) {
      const bool comment = here() == '#';
      while (comment && at_ < bytes_.size() && here() != '\n') ++at_;
      if (at_ < bytes_.size()) ++at_;
    }
    std::int64_t value = 0;
    int digits = 0;
    for (; at_ < bytes_.size() && here() >= '0' && here() <= '9' && digits <= max_digits; ++at_, ++digits) {
      value = 10 * value + (here() - '0');
    }
    if (digits == 0 || digits > max_digits) return std::nullopt;
    return value;
  }

  /// Skips bytes; false if there are fewer.
  bool skip(std::size_t count) {
    if (bytes_.size() - at_ < count) return false;
    at_ += count;
    return true;
  }
  bool at_blank() const { return at_ < bytes_.size() && is_blank(here()); }
  std::span<const std::byte> rest() const { return bytes_.subspan(at_); }

 private:
  char here() const { return static_cast<char>(bytes_[at_]); }
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

struct Header {
  int channels = 3;
  std::int64_t width = 0;
  std::int64_t height = 0;
  std::uint32_t maximum = 0;
  std::span<const std::byte> samples;
};

Result<Header> header_of(std::span<const std::byte> bytes) {
  HeaderReader reader(bytes);
  if (!reader.skip(2) || bytes[0] != std::byte{'P'} || (bytes[1] != std::byte{'5'} && bytes[1] != std::byte{'6'})) {
    return malformed("it begins with neither P5 nor P6");
  }
  Header header;
  header.channels = bytes[1] == std::byte{'6'} ? 3 : 1;
  const auto width = reader.number();
  const auto height = width ? reader.number() : std::nullopt;
  const auto maximum = height ? reader.number() : std::nullopt;
  if (!maximum || !reader.at_blank()) return malformed("its header is not a width, a height and a maximum");
  if (*maximum < 1 || *maximum > 65535) {
    return malformed("its maximum is " + std::to_string(*maximum) + ", expected 1 to 65535");
  }
  reader.skip(1);
  header.width = *width;
  header.height = *height;
  header.maximum = static_cast<std::uint32_t>(*maximum);
  header.samples = reader.rest();
  return header;
}

template <class Code>
std::uint32_t sample_at(const Header& header, std::size_t i) {
  if constexpr (sizeof(Code) == 1) return static_cast<std::uint32_t>(header.samples[i]);
  return static_cast<std::uint32_t>(header.samples[2 * i]) << 8 | static_cast<std::uint32_t>(header.samples[2 * i + 1]);
}

template <class Code>
Result<DecodedPicture> decode(const Header& header) {
  constexpr std::uint32_t full = std::numeric_limits<Code>::max();
  const auto width = static_cast<std::size_t>(header.width), height = static_cast<std::size_t>(header.height);
  const auto channels = static_cast<std::size_t>(header.channels);
  if (header.samples.size() / (sizeof(Code) * channels * width) < height) {
    return malformed("it ends before its " + std::to_string(width) + " x " + std::to_string(height) + " pixels do");
  }
  Encoded<Code> out{Plane<Code>(static_cast<int>(3 * width), static_cast<int>(height))};
  for (std::size_t i = 0; i < out.codes.size(); ++i) {
    const std::uint32_t sample = sample_at<Code>(header, channels == 3 ? i : i / 3);
    if (sample > header.maximum) {
      return malformed("a sample of " + std::to_string(sample) + " is above its maximum of " +
                       std::to_string(header.maximum));
    }
    out.codes.data()[i] = static_cast<Code>((sample * full + header.maximum / 2) / header.maximum);
  }
  return DecodedPicture{std::move(out), {}};
}

}  // namespace

Result<DecodedPicture> decode_ppm(std::span<const std::byte> bytes, const DecodeLimits& limits) try {
  const auto header = header_of(bytes);
  if (!header) return tl::make_unexpected(header.error());
  if (auto size = check_size(header->width, header->height, limits); !size) return tl::make_unexpected(size.error());
  return header->maximum > 255 ? decode<std::uint16_t>(*header) : decode<std::uint8_t>(*header);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "no memory for the pixels of the PPM");
}

}  // namespace lowlux::isp
