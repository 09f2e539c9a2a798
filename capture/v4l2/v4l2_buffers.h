#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "capture/v4l2/v4l2_device.h"

namespace lowlux::capture {

/// Description of a buffer by the driver that hands it over; not checked.
struct V4l2Taken {
  std::uint32_t index = 0;
  std::uint32_t flags = 0;
  std::uint32_t sequence = 0;
  std::uint32_t bytes_used = 0;
  std::uint32_t data_offset = 0;  // data offset of the frame in the buffer; 0 with one plane of memory
  std::int64_t seconds = 0;
  std::int64_t microseconds = 0;
};

/// The driver's buffers, mapped. The destructor ends streaming, and unmaps, closes and returns all.
class V4l2Buffers {
 public:
  /// Requests `count` buffers (the driver may give fewer or more), each of at least `frame_bytes`, all of them at most
  /// max_buffer_bytes. None is queued.
  static Result<std::unique_ptr<V4l2Buffers>> request(V4l2Device& device, V4l2Memory memory, int count,
                                                      std::size_t frame_bytes);
  ~V4l2Buffers();
  V4l2Buffers(const V4l2Buffers&) = delete;
  V4l2Buffers& operator=(const V4l2Buffers&) = delete;

  /// Queues all buffers and starts streaming.
  Result<void> start_streaming();
  /// Hands a buffer to the driver and returns 0, else errno. `index` is that of a buffer that is not queued.
  int queue(std::size_t index);
  /// Takes the next filled buffer, without waiting, and returns 0, else errno. EBADMSG if the driver hands over one
  /// that it does not have.
  int take(V4l2Taken& taken);
  /// Called before and after this process reads a buffer: return 0, else errno. They do nothing for mapped buffers.
  int begin_access(std::size_t index);
  int end_access(std::size_t index);

  std::size_t count() const { return buffers_.size(); }
  std::size_t queued() const;
  bool is_queued(std::size_t index) const { return buffers_[index].queued; }
  std::span<const std::byte> bytes(std::size_t index) const { return {buffers_[index].at, buffers_[index].bytes}; }

 private:
  struct Buffer {
    const std::byte* at = nullptr;
    std::size_t bytes = 0;
    int file = -1;  // file descriptor of the DMA buffer
    bool queued = false;
    bool accessed = false;  // begin_access was called without end_access
  };
  V4l2Buffers(V4l2Device& device, V4l2Memory memory) : device_(device), memory_(memory) {}
  Result<void> add(std::uint32_t index, std::size_t frame_bytes, std::size_t max_bytes);
  Result<int> exported(std::uint32_t index);
  int synchronise(std::size_t index, std::uint64_t flags);

  V4l2Device& device_;
  V4l2Memory memory_;
  std::vector<Buffer> buffers_;
  bool requested_ = false;
  bool streaming_ = false;
};

}  // namespace lowlux::capture
