#include "isp/codec/picture_file.h"

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace lowlux::isp {

Result<void> check_size(std::int64_t width, std::int64_t height, const DecodeLimits& limits) {
  constexpr std::int64_t max_side = (std::int64_t{1} << 30) / 3;  // 3 samples per pixel fit an int
  const std::string size = std::to_string(width) + " x " + std::to_string(height);
  if (width < 1 || height < 1) return fail(ErrorCode::malformed, "an image of " + size + " pixels has no content");
  if (width > max_side || height > max_side || width > limits.max_pixels / height) {
    return fail(ErrorCode::too_large,
                "the file says " + size + " pixels, the limit is " + std::to_string(limits.max_pixels));
  }
  return {};
}

Result<void> write_bytes(std::FILE* file, std::span<const std::byte> bytes) {
  if (bytes.empty()) return {};  // fwrite accepts no null pointer, even for 0 bytes
  errno = 0;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file) != bytes.size()) return write_failure();
  return {};
}

tl::unexpected<Error> not_readable(const std::string& what, std::string said) {
  std::replace_if(
      said.begin(), said.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return fail(ErrorCode::malformed, "not a readable " + what + ": " + said);
}

tl::unexpected<Error> write_failure() {
  const int cause = errno == 0 ? EIO : errno;
  if (cause == ENOSPC) return fail(ErrorCode::unwritable, "the disk is full");
  return fail(ErrorCode::unwritable, "cannot write: " + std::generic_category().message(cause));
}

}  // namespace lowlux::isp
