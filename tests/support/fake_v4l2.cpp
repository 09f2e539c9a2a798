#include "tests/support/fake_v4l2.h"

#include <linux/dma-buf.h>
#include <linux/videodev2.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>

namespace lowlux::test {
namespace {

constexpr int camera = -1;  // value in files_

}  // namespace

FakeV4l2::FakeV4l2(bool is_multi_planar)
    : formats{{V4L2_PIX_FMT_YUYV, 2, {{640, 480}}},
              {V4L2_PIX_FMT_SRGGB8, 1, {{32, 24}, {16, 12}}},
              {V4L2_PIX_FMT_SRGGB10, 2, {{16, 12}, {32, 24}}},
              {V4L2_PIX_FMT_Y12, 2, {{16, 12}}}},
      capabilities(V4L2_CAP_STREAMING | (is_multi_planar ? V4L2_CAP_VIDEO_CAPTURE_MPLANE : V4L2_CAP_VIDEO_CAPTURE)),
      layout{V4L2_PIX_FMT_YUYV, 640, 480, 1280, 1280 * 480},
      is_multi_planar_(is_multi_planar) {}

capture::V4l2System FakeV4l2::system() {
  return {.context = this,
          .open = [](void* fake, const char* path) { return of(fake).open(path); },
          .close = [](void* fake, int file) { return of(fake).close(file); },
          .ioctl = [](void* fake, int file, unsigned long request,
                      void* argument) { return of(fake).ioctl(file, request, argument); },
          .map = [](void* fake, int file, std::size_t bytes,
                    std::int64_t offset) { return of(fake).map(file, bytes, offset); },
          .unmap = [](void* fake, void* at, std::size_t bytes) { return of(fake).unmap(at, bytes); },
          .poll = [](void* fake, int file, short events, int timeout_ms,
                     short* happened) { return of(fake).poll(file, events, timeout_ms, happened); },
          .devices = [](void* fake) { return of(fake).paths; },
          .now = [](void* fake) -> std::chrono::nanoseconds { return std::chrono::milliseconds(of(fake).now_ms); }};
}

int FakeV4l2::open(const char* path) {
  const bool known = std::find(paths.begin(), paths.end(), path) != paths.end();
  errno = open_errno != 0 ? open_errno : ENOENT;
  if (open_errno != 0 || !known) return -1;
  files_[++last_file_] = camera;
  open_files = static_cast<int>(files_.size());
  return last_file_;
}

int FakeV4l2::close(int file) {
  const auto found = files_.find(file);
  if (found == files_.end()) {
    ++misuses;
    errno = EBADF;
    return -1;
  }
  if (found->second == camera) {  // as the kernel cleans up
    is_streaming = false;
    queue_.clear();
  }
  files_.erase(found);
  open_files = static_cast<int>(files_.size());
  return 0;
}

int FakeV4l2::ioctl(int file, unsigned long request, void* argument) {
  ++calls[request];
  int code = 0;
  if (!files_.contains(file)) {
    ++misuses;
    code = EBADF;
  } else if (files_[file] == camera && (unplugged || --calls_before_unplugging < 0)) {  // exported memory stays
    unplugged = true;
    code = ENODEV;
  } else if (auto fault = faults.find(request); fault != faults.end() && fault->second.good_before-- <= 0) {
    code = fault->second.calls-- > 0 ? fault->second.code : 0;
  }
  if (code == 0 && random != nullptr) code = random_fault(request);
  if (code == 0) code = answer(file, request, argument);
  errno = code;
  return code == 0 ? 0 : -1;
}

int FakeV4l2::random_fault(unsigned long request) {
  // Ends of lists and unknown controls occur anyway; one call in 40 fails, and of those one in eight permanently.
  if ((*random)() % 40 != 0) return 0;
  constexpr int codes[] = {EIO, EBUSY, EINVAL, ENOMEM, EINTR, EAGAIN, EPIPE, ENODEV};
  const int code = codes[(*random)() % std::size(codes)];
  if (code == ENODEV) unplugged = true;
  if ((*random)() % 8 == 0) faults[request] = {code};
  return code;
}

int FakeV4l2::answer(int file, unsigned long request, void* argument) {
  if (request == DMA_BUF_IOCTL_SYNC) {
    if (files_[file] == camera) return ENOTTY;
    accesses += (static_cast<dma_buf_sync*>(argument)->flags & DMA_BUF_SYNC_END) != 0 ? -1 : 1;
    return 0;
  }
  if (files_[file] != camera) return ENOTTY;
  switch (request) {
    case VIDIOC_QUERYCAP:
      return query(argument);
    case VIDIOC_ENUM_FMT:
      return list_format(argument);
    case VIDIOC_ENUM_FRAMESIZES:
      return list_size(argument);
    case VIDIOC_G_FMT:
      return get_format(argument);
    case VIDIOC_S_FMT:
      return set_format(argument);
    case VIDIOC_G_PARM:
      return exchange_interval(argument, false);
    case VIDIOC_S_PARM:
      return exchange_interval(argument, true);
    case VIDIOC_QUERYCTRL:
      return query_control(argument);
    case VIDIOC_G_CTRL:
      return exchange_control(argument, false);
    case VIDIOC_S_CTRL:
      return exchange_control(argument, true);
    case VIDIOC_G_EXT_CTRLS:
      return wide_control(argument);
    case VIDIOC_G_SELECTION:
      return selection(argument);
    case VIDIOC_REQBUFS:
      return request_buffers(argument);
    case VIDIOC_QUERYBUF:
      return query_buffer(argument);
    case VIDIOC_QBUF:
      return queue_buffer(argument);
    case VIDIOC_DQBUF:
      return dequeue_buffer(argument);
    case VIDIOC_EXPBUF:
      return export_buffer(argument);
    case VIDIOC_STREAMON:
      is_streaming = true;
      return 0;
    case VIDIOC_STREAMOFF:
      is_streaming = false;
      queue_.clear();
      for (auto& memory : memory_) memory->is_queued = false;
      return 0;
    default:
      return ENOTTY;
  }
}

void* FakeV4l2::map(int file, std::size_t bytes, std::int64_t offset) {
  const auto found = files_.find(file);
  errno = map_errno;
  if (map_errno != 0 || (random != nullptr && (*random)() % 40 == 0)) {
    if (errno == 0) errno = ENOMEM;
    return nullptr;
  }
  const std::int64_t index = found == files_.end() ? -1 : found->second == camera ? offset >> 12 : found->second;
  if (index < 0 || index >= std::ssize(memory_) || bytes > memory_[static_cast<std::size_t>(index)]->bytes.size()) {
    ++misuses;
    errno = EINVAL;
    return nullptr;
  }
  Memory& memory = *memory_[static_cast<std::size_t>(index)];
  memory.mapped = true;
  ++open_maps;
  return memory.bytes.data();
}

int FakeV4l2::unmap(void* at, std::size_t bytes) {
  for (auto& memory : memory_) {
    if (memory->bytes.data() != at || !memory->mapped || bytes != memory->bytes.size()) continue;
    memory->mapped = false;
    --open_maps;
    return 0;
  }
  ++misuses;
  return -1;
}

int FakeV4l2::poll(int file, short events, int timeout_ms, short* happened) {
  if (!files_.contains(file) || timeout_ms < 0) ++misuses;
  errno = poll_errno;
  if (poll_errno != 0) {
    now_ms += std::max(timeout_ms / 100, 1);  // the time until the signal
    return -1;
  }
  *happened = poll_answer;
  if (unplugged && wakes_on_unplugging) *happened = POLLERR | POLLHUP;
  *happened = static_cast<short>(*happened & (events | POLLERR | POLLHUP | POLLNVAL));
  if (*happened != 0) return 1;
  if ((events & POLLIN) != 0 && !frames.empty() && !queue_.empty()) {
    now_ms += std::min(timeout_ms, frame_interval_ms);
    *happened = POLLIN;
    return 1;
  }
  now_ms += timeout_ms;
  return 0;
}

}  // namespace lowlux::test
