#include "isp/codec/exr_header.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

namespace lowlux::isp {
namespace {

constexpr std::uint32_t magic = 20000630;
constexpr std::uint32_t not_image_flag = 0x800;  // deep data
constexpr std::uint32_t multi_part_flag = 0x1000;
constexpr std::size_t longest_name = 255;

/// Takes pieces off the front of a run of bytes; nullopt once they are not there.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : left_(bytes) {}

  bool at_end() const { return left_.empty(); }

  std::optional<std::uint32_t> u32() {  // little-endian
    const auto four = take(4);
    if (!four) return std::nullopt;
    std::uint32_t number = 0;
    for (int i = 3; i >= 0; --i) number = number << 8 | std::to_integer<std::uint32_t>((*four)[i]);
    return number;
  }

  std::optional<std::span<const std::byte>> take(std::size_t size) {
    if (size > left_.size()) return std::nullopt;
    const auto piece = left_.first(size);
    left_ = left_.subspan(size);
    return piece;
  }

  /// Characters up to a zero byte, which is taken too.
  std::optional<std::string> name() {
    const auto end = std::find(left_.begin(), left_.end(), std::byte{0});
    const auto size = static_cast<std::size_t>(end - left_.begin());
    if (end == left_.end() || size > longest_name) return std::nullopt;
    const auto piece = *take(size + 1);
    return std::string(reinterpret_cast<const char*>(piece.data()), size);
  }

 private:
  std::span<const std::byte> left_;
};

/// Whether the sizes an attribute of `type` holds inside agree with its own.
bool is_consistent(const std::string& type, std::span<const std::byte> value) {
  ByteReader reader(value);
  if (type == "preview") {
    const auto width = reader.u32(), height = reader.u32();
    return width && height && std::uint64_t{*width} * *height == (value.size() - 8) / 4;
  }
  if (type == "stringvector") {
    while (!reader.at_end()) {
      const auto size = reader.u32();
      if (!size || !reader.take(*size)) return false;
    }
  }
  return true;
}

}  // namespace

Result<void> check_exr_header(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  if (reader.u32() != magic) return fail(ErrorCode::malformed, "not an OpenEXR file: its first bytes are wrong");
  const std::uint32_t version = reader.u32().value_or(0);
  if ((version & (not_image_flag | multi_part_flag)) != 0) {
    return fail(ErrorCode::unsupported, "deep OpenEXR files and those of several parts are not read");
  }
  while (true) {
    const auto name = reader.name();
    if (name && name->empty()) return {};
    const auto type = name ? reader.name() : std::nullopt;
    const auto size = type ? reader.u32() : std::nullopt;
    const auto value = size ? reader.take(*size) : std::nullopt;
    if (!value) return fail(ErrorCode::malformed, "not a readable OpenEXR file: it ends inside its header");
    if (!is_consistent(*type, *value)) {
      return fail(ErrorCode::malformed, "not a readable OpenEXR file: its " + type.value() + " contradicts its size");
    }
  }
}

}  // namespace lowlux::isp
