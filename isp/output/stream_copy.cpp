#include "isp/output/stream_copy.h"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <memory>
#include <string>
#include <system_error>

namespace lowlux::isp {
namespace {

Error system_error(const char* what) {
  return {ErrorCode::unwritable, std::string(what) + ": " + std::system_category().message(errno), {}};
}

Result<void> write_all(int descriptor, const char* bytes, std::size_t count) {
  while (count > 0) {
    const ssize_t written = write(descriptor, bytes, count);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return tl::make_unexpected(system_error("cannot write to the output stream"));
    bytes += written;
    count -= static_cast<std::size_t>(written);
  }
  return {};
}

}  // namespace

Result<void> write_to_stream(int descriptor, const std::function<Result<void>(std::FILE* file)>& encode) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), std::fclose);
  if (!file) return tl::make_unexpected(system_error("no temporary file"));
  if (auto encoded = encode(file.get()); !encoded) return encoded;
  if (std::fflush(file.get()) != 0 || std::fseek(file.get(), 0, SEEK_SET) != 0) {
    return tl::make_unexpected(system_error("the temporary file is not written"));
  }
  std::array<char, 65536> block{};
  for (std::size_t count = block.size(); count == block.size();) {
    count = std::fread(block.data(), 1, block.size(), file.get());
    if (std::ferror(file.get()) != 0) return tl::make_unexpected(system_error("the temporary file is not read"));
    if (auto written = write_all(descriptor, block.data(), count); !written) return written;
  }
  return {};
}

}  // namespace lowlux::isp
