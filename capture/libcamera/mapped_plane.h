#pragma once

#include <cstddef>
#include <span>

#include "isp/base/result.h"

namespace lowlux::capture {

/// Location of a plane of a camera's buffer: `length` bytes from `offset` on in a dma-buf, which may hold other planes.
struct PlaneLocation {
  int fd = -1;
  std::size_t offset = 0;
  std::size_t length = 0;
};

/// A plane mapped for reading. The descriptor is owned by the caller and must stay open for the lifetime of this
/// object.
class MappedPlane {
 public:
  /// Maps a plane. Errors: malformed (it has no bytes, or ends beyond the buffer), unreadable (the kernel fails).
  static Result<MappedPlane> map(const PlaneLocation& plane);

  MappedPlane(MappedPlane&& other) noexcept;
  MappedPlane& operator=(MappedPlane&& other) noexcept;
  ~MappedPlane();

  std::span<const std::byte> bytes() const { return {start_ + offset_, mapped_bytes_ - offset_}; }

  /// Begins reading what the device wrote (DMA_BUF_IOCTL_SYNC), so that caches agree; end_reading() ends it. Does
  /// nothing if the memory is not a dma-buf. @return false if the kernel cannot synchronise the caches: bytes may be
  /// stale
  bool begin_reading() const;
  bool end_reading() const;

 private:
  MappedPlane() = default;

  int fd_ = -1;
  const std::byte* start_ = nullptr;  // start of the mapping, and of the buffer
  std::size_t mapped_bytes_ = 0;
  std::size_t offset_ = 0;
};

}  // namespace lowlux::capture
