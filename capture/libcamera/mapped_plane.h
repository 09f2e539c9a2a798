#pragma once

#include <cstddef>
#include <span>

#include "isp/base/result.h"

namespace lowlux::capture {

/// Where a plane of a camera's buffer lies: `length` bytes from `offset` on in a dma-buf, which other planes may share.
struct PlaneLocation {
  int fd = -1;
  std::size_t offset = 0;
  std::size_t length = 0;
};

/// A plane in our address space, to be read. The descriptor stays the caller's and is open for as long as this lives.
class MappedPlane {
 public:
  /// Errors: malformed (it has no bytes, or ends behind the buffer), unreadable (the kernel refuses).
  static Result<MappedPlane> map(const PlaneLocation& plane);

  MappedPlane(MappedPlane&& other) noexcept;
  MappedPlane& operator=(MappedPlane&& other) noexcept;
  ~MappedPlane();

  std::span<const std::byte> bytes() const { return {start_ + offset_, mapped_bytes_ - offset_}; }

  /// To be called before and after reading what the device wrote (DMA_BUF_IOCTL_SYNC), so that caches agree. Nothing
  /// where the memory is no dma-buf. @return false if the kernel cannot bring the caches in step: bytes may be stale
  bool begin_reading() const;
  bool end_reading() const;

 private:
  MappedPlane() = default;

  int fd_ = -1;
  const std::byte* start_ = nullptr;  // of the mapping, which starts where the buffer does
  std::size_t mapped_bytes_ = 0;
  std::size_t offset_ = 0;
};

}  // namespace lowlux::capture
