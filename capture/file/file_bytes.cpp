#include "capture/file/file_bytes.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "isp/base/memory.h"

namespace lowlux::capture {
namespace {

std::string size_text(std::uint64_t bytes) {
  return bytes < std::uint64_t{1} << 20 ? std::to_string(bytes >> 10) + " KiB" : std::to_string(bytes >> 20) + " MiB";
}

Error system_error(ErrorCode code, const char* what) {
  return {code, std::string(what) + ": " + std::system_category().message(errno), {}};
}

Result<std::vector<std::byte>> load(int fd, std::uint64_t max_bytes) {
  struct stat status {};
  if (fstat(fd, &status) != 0) return tl::make_unexpected(system_error(ErrorCode::unreadable, "cannot be read"));
  if (S_ISDIR(status.st_mode)) return fail(ErrorCode::unreadable, "is a directory, not a file");
  if (!S_ISREG(status.st_mode)) return fail(ErrorCode::unreadable, "is not a regular file");
  const auto size = static_cast<std::uint64_t>(status.st_size);
  if (size > max_bytes) return too_many_bytes(size, max_bytes);
  std::vector<std::byte> bytes;
  bytes.reserve(size);
  prefer_huge_pages(bytes.data(), size);
  bytes.resize(size);
  std::size_t have = 0;
  while (have < bytes.size()) {
    const ssize_t got = read(fd, bytes.data() + have, bytes.size() - have);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return tl::make_unexpected(system_error(ErrorCode::unreadable, "cannot be read"));
    if (got == 0) break;
    have += static_cast<std::size_t>(got);
  }
  bytes.resize(have);
  return bytes;
}

constexpr std::size_t stream_block = std::size_t{1} << 20;

}  // namespace

Result<std::vector<std::byte>> read_stream_bytes(int descriptor, std::uint64_t max_bytes) {
  std::vector<std::byte> bytes;
  for (std::size_t have = 0;;) {
    bytes.resize(have + stream_block);
    const ssize_t got = read(descriptor, bytes.data() + have, stream_block);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return tl::make_unexpected(system_error(ErrorCode::unreadable, "cannot be read"));
    have += static_cast<std::size_t>(got);
    if (have > max_bytes) return too_many_bytes(have, max_bytes);
    if (got > 0) continue;
    bytes.resize(have);
    return bytes;
  }
}

tl::unexpected<Error> too_many_bytes(std::uint64_t bytes, std::uint64_t max_bytes) {
  return fail(ErrorCode::too_large, "the file has " + size_text(bytes) + ", over the limit of " + size_text(max_bytes));
}

Result<std::vector<std::byte>> read_file_bytes(const std::filesystem::path& file, std::uint64_t max_bytes) {
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) {
    const bool missing = errno == ENOENT || errno == ENOTDIR;
    Error error = missing ? Error{ErrorCode::not_found, "no such file", {}}
                          : system_error(ErrorCode::unreadable, "cannot be opened");
    error.where = file.string();
    return tl::make_unexpected(std::move(error));
  }
  auto bytes = load(fd, max_bytes);
  close(fd);
  if (!bytes) bytes.error().where = file.string();
  return bytes;
}

}  // namespace lowlux::capture
