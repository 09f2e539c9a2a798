#include "capture/libcamera/mapped_plane.h"

#include <cerrno>
#include <cstdint>
#include <string>
#include <system_error>
#include <utility>

#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace lowlux::capture {
namespace {

constexpr std::size_t max_plane_bytes = std::size_t{2} << 30;
constexpr int max_tries = 100;

bool synchronise(int fd, std::uint64_t flags) {
  dma_buf_sync sync{.flags = flags};
  int result = -1;
  for (int tries = 0; tries < max_tries && result != 0; ++tries) {
    result = ioctl(fd, DMA_BUF_IOCTL_SYNC, &sync);
    if (result != 0 && errno != EINTR && errno != EAGAIN) break;
  }
  return result == 0 || errno == ENOTTY;
}

}  // namespace

Result<MappedPlane> MappedPlane::map(const PlaneLocation& plane) {
  if (plane.length == 0 || plane.length > max_plane_bytes || plane.offset > max_plane_bytes) {
    return fail(ErrorCode::malformed, "a buffer of the camera has " + std::to_string(plane.length) + " bytes at " +
                                          std::to_string(plane.offset) + ", which is not within 2 GiB");
  }
  const std::size_t end = plane.offset + plane.length;
  // Access beyond the end of a file is fatal. Dma-bufs report their size in this way, too.
  const off_t size = lseek(plane.fd, 0, SEEK_END);
  if (size >= 0 && static_cast<std::size_t>(size) < end) {
    return fail(ErrorCode::malformed, "a buffer of the camera holds " + std::to_string(size) +
                                          " bytes, fewer than the " + std::to_string(end) + " it states");
  }
  // Map from the buffer's start: not every exporter maps from an offset.
  void* start = mmap(nullptr, end, PROT_READ, MAP_SHARED, plane.fd, 0);
  if (start == MAP_FAILED) {
    return fail(ErrorCode::unreadable, "cannot map a buffer of the camera: " + std::generic_category().message(errno));
  }
  MappedPlane mapped;
  mapped.fd_ = plane.fd;
  mapped.start_ = static_cast<const std::byte*>(start);
  mapped.mapped_bytes_ = end;
  mapped.offset_ = plane.offset;
  return mapped;
}

MappedPlane::MappedPlane(MappedPlane&& other) noexcept { *this = std::move(other); }

MappedPlane& MappedPlane::operator=(MappedPlane&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(start_, other.start_);
  std::swap(mapped_bytes_, other.mapped_bytes_);
  std::swap(offset_, other.offset_);
  return *this;
}

MappedPlane::~MappedPlane() {
  if (start_ != nullptr) munmap(const_cast<std::byte*>(start_), mapped_bytes_);
}

bool MappedPlane::begin_reading() const { return synchronise(fd_, DMA_BUF_SYNC_START | DMA_BUF_SYNC_READ); }

bool MappedPlane::end_reading() const { return synchronise(fd_, DMA_BUF_SYNC_END | DMA_BUF_SYNC_READ); }

}  // namespace lowlux::capture
