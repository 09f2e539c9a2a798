#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <span>

namespace lowlux::capture {

/// Repeats pread or pwrite, system calls that move bytes at an offset of a file, until all bytes are moved.
/// @return false if it fails or reaches the end of the file
template <class Byte, class Call>
bool move_all(Call call, int fd, std::span<Byte> bytes, std::uint64_t offset) {
  while (!bytes.empty()) {
    const ssize_t moved = call(fd, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (moved < 0 && errno == EINTR) continue;
    if (moved <= 0) return false;
    offset += static_cast<std::uint64_t>(moved);
    bytes = bytes.subspan(static_cast<std::size_t>(moved));
  }
  return true;
}

inline bool read_all(int fd, std::span<std::byte> bytes, std::uint64_t offset) {
  return move_all(pread, fd, bytes, offset);
}

inline bool write_all(int fd, std::span<const std::byte> bytes, std::uint64_t offset) {
  return move_all(pwrite, fd, bytes, offset);
}

}  // namespace lowlux::capture
