#include "capture/v4l2/v4l2_buffers.h"

#include <fcntl.h>
#include <linux/dma-buf.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <utility>

#include "capture/file/pass_on.h"
#include "capture/v4l2/v4l2_negotiation.h"

namespace lowlux::capture {
namespace {

constexpr std::uint32_t max_buffers = 32;  // VIDEO_MAX_FRAME
constexpr int max_attempts = 100;          // DMA_BUF_IOCTL_SYNC must also be repeated for EAGAIN

/// One v4l2_buffer, with the plane that a multi-planar driver requires.
class BufferCall {
 public:
  BufferCall(const V4l2Device& device, std::uint32_t index) : multi_planar_(device.multi_planar()) {
    buffer.type = device.buffer_type();
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    if (multi_planar_) {
      buffer.m.planes = &plane_;
      buffer.length = 1;
    }
  }
  std::uint32_t bytes() const { return multi_planar_ ? plane_.length : buffer.length; }
  std::uint32_t bytes_used() const { return multi_planar_ ? plane_.bytesused : buffer.bytesused; }
  std::uint32_t data_offset() const { return multi_planar_ ? plane_.data_offset : 0; }
  std::uint32_t map_offset() const { return multi_planar_ ? plane_.m.mem_offset : buffer.m.offset; }

  v4l2_buffer buffer{};

 private:
  v4l2_plane plane_{};
  bool multi_planar_;
};

int request_buffers(V4l2Device& device, std::uint32_t wanted, std::uint32_t* had) {
  v4l2_requestbuffers asked{};
  asked.count = wanted;
  asked.type = device.buffer_type();
  asked.memory = V4L2_MEMORY_MMAP;
  const int code = device.call(VIDIOC_REQBUFS, &asked);
  *had = asked.count;
  return code;
}

/// Returns the failure of VIDIOC_STREAMON.
Error not_started(const V4l2Device& device, int code) {
  switch (code) {
    case EPIPE:
      return {ErrorCode::unreadable,
              "streaming does not start: the sensor and " + device.name() +
                  " are set to different formats or not linked, set the sensor's format with media-ctl",
              device.path()};
    case ENOSPC:
      return {ErrorCode::unreadable,
              "streaming does not start: the bandwidth of the bus is too low, request a smaller size or frame rate",
              device.path()};
    default:
      return device.error(code, "streaming does not start");
  }
}

}  // namespace

Result<std::unique_ptr<V4l2Buffers>> V4l2Buffers::request(V4l2Device& device, V4l2Memory memory, int count,
                                                          std::size_t frame_bytes) {
  std::unique_ptr<V4l2Buffers> out(new V4l2Buffers(device, memory));
  std::uint32_t had = 0;
  if (const int code = request_buffers(device, static_cast<std::uint32_t>(count), &had)) {
    return tl::make_unexpected(device.error(code, "the driver gives no buffers"));
  }
  out->requested_ = true;  // if a later step fails, they are returned when `out` is destroyed
  if (had == 0 || had > max_buffers) {
    return fail(ErrorCode::malformed,
                "asked for " + std::to_string(count) + " buffers, the driver gives " + std::to_string(had) +
                    ", expected 1 to " + std::to_string(max_buffers),
                device.path());
  }
  out->buffers_.reserve(had);
  const std::size_t max_bytes = max_buffer_bytes / had;
  for (std::uint32_t index = 0; index < had; ++index) {
    if (auto added = out->add(index, frame_bytes, max_bytes); !added) return pass_on(added);
  }
  return out;
}

Result<void> V4l2Buffers::add(std::uint32_t index, std::size_t frame_bytes, std::size_t max_bytes) {
  BufferCall told(device_, index);
  if (const int code = device_.call(VIDIOC_QUERYBUF, &told.buffer)) {
    return tl::make_unexpected(device_.error(code, "the driver does not describe its buffer"));
  }
  if (told.bytes() < frame_bytes) {
    return fail(ErrorCode::malformed,
                "a buffer of the driver has " + std::to_string(told.bytes()) + " bytes, a frame takes " +
                    std::to_string(frame_bytes) + ": ask for another format",
                device_.path());
  }
  if (told.bytes() > max_bytes) {
    return fail(ErrorCode::too_large,
                "a buffer of the driver has " + std::to_string(told.bytes()) + " bytes, the limit for each is " +
                    std::to_string(max_bytes) + ": ask for fewer buffers, or for a smaller size",
                device_.path());
  }
  Buffer buffer{.at = nullptr, .bytes = told.bytes(), .file = -1, .queued = false};
  if (memory_ == V4l2Memory::dma_buf) {
    auto file = exported(index);
    if (!file) return pass_on(file);
    buffer.file = *file;
  }
  const V4l2System& system = device_.system();
  buffer.at = static_cast<const std::byte*>(
      memory_ == V4l2Memory::dma_buf
          ? system.map(system.context, buffer.file, buffer.bytes, 0)
          : system.map(system.context, device_.file(), buffer.bytes, static_cast<std::int64_t>(told.map_offset())));
  const int code = buffer.at == nullptr ? errno : 0;
  buffers_.push_back(buffer);
  if (code != 0) return tl::make_unexpected(device_.error(code, "the driver's buffer cannot be mapped"));
  return {};
}

Result<int> V4l2Buffers::exported(std::uint32_t index) {
  v4l2_exportbuffer asked{};
  asked.type = device_.buffer_type();
  asked.index = index;
  asked.flags = O_RDONLY | O_CLOEXEC;
  if (const int code = device_.call(VIDIOC_EXPBUF, &asked)) {
    if (code != ENOTTY && code != EINVAL) {
      return tl::make_unexpected(device_.error(code, "the driver does not export its buffer"));
    }
    return fail(ErrorCode::unsupported, "the driver of " + device_.name() + " exports no DMA buffers: use mmap",
                device_.path());
  }
  if (asked.fd < 0) return fail(ErrorCode::malformed, "the driver exports a buffer without a file", device_.path());
  return asked.fd;
}

V4l2Buffers::~V4l2Buffers() {
  const V4l2System& system = device_.system();
  if (streaming_) {
    int type = static_cast<int>(device_.buffer_type());
    device_.call(VIDIOC_STREAMOFF, &type);
  }
  for (std::size_t index = 0; index < buffers_.size(); ++index) {
    const Buffer& buffer = buffers_[index];
    if (buffer.accessed) end_access(index);
    if (buffer.at != nullptr) system.unmap(system.context, const_cast<std::byte*>(buffer.at), buffer.bytes);
    if (buffer.file >= 0) system.close(system.context, buffer.file);
  }
  std::uint32_t had = 0;
  if (requested_) request_buffers(device_, 0, &had);
}

Result<void> V4l2Buffers::start_streaming() {
  for (std::size_t index = 0; index < buffers_.size(); ++index) {
    if (const int code = queue(index)) return tl::make_unexpected(device_.error(code, "the driver takes no buffer"));
  }
  int type = static_cast<int>(device_.buffer_type());
  if (const int code = device_.call(VIDIOC_STREAMON, &type)) return tl::make_unexpected(not_started(device_, code));
  streaming_ = true;
  return {};
}

int V4l2Buffers::queue(std::size_t index) {
  BufferCall asked(device_, static_cast<std::uint32_t>(index));
  const int code = device_.call(VIDIOC_QBUF, &asked.buffer);
  buffers_[index].queued = code == 0;
  return code;
}

int V4l2Buffers::take(V4l2Taken& taken) {
  BufferCall told(device_, 0);
  if (const int code = device_.call(VIDIOC_DQBUF, &told.buffer)) return code;
  taken = {.index = told.buffer.index,
           .flags = told.buffer.flags,
           .sequence = told.buffer.sequence,
           .bytes_used = told.bytes_used(),
           .data_offset = told.data_offset(),
           .seconds = told.buffer.timestamp.tv_sec,
           .microseconds = told.buffer.timestamp.tv_usec};
  if (taken.index >= buffers_.size() || !buffers_[taken.index].queued) return EBADMSG;
  buffers_[taken.index].queued = false;
  return 0;
}

int V4l2Buffers::begin_access(std::size_t index) {
  const int code = synchronise(index, DMA_BUF_SYNC_START | DMA_BUF_SYNC_READ);
  buffers_[index].accessed = code == 0;
  return code;
}

int V4l2Buffers::end_access(std::size_t index) {
  buffers_[index].accessed = false;
  return synchronise(index, DMA_BUF_SYNC_END | DMA_BUF_SYNC_READ);
}

int V4l2Buffers::synchronise(std::size_t index, std::uint64_t flags) {
  if (memory_ != V4l2Memory::dma_buf) return 0;
  const V4l2System& system = device_.system();
  dma_buf_sync asked{flags};
  int code = EAGAIN;
  for (int attempt = 0; attempt < max_attempts && (code == EAGAIN || code == EINTR); ++attempt) {
    code = system.ioctl(system.context, buffers_[index].file, DMA_BUF_IOCTL_SYNC, &asked) < 0 ? errno : 0;
  }
  if (code == ENODEV) device_.set_disconnected();
  return code;
}

std::size_t V4l2Buffers::queued() const {
  return static_cast<std::size_t>(
      std::count_if(buffers_.begin(), buffers_.end(), [](const Buffer& buffer) { return buffer.queued; }));
}

}  // namespace lowlux::capture
