#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "capture/v4l2/v4l2_device.h"

namespace lowlux::test {

/// Simulates the driver of one V4L2 camera, /dev/video0, with what a test needs to make it misbehave. Time passes in it
/// only while a caller waits. Calls that no driver would get right (closed files, foreign maps, buffers queued twice)
/// count as `misuses`.
class FakeV4l2 {
 public:
  struct Fault {
    int code = 0;
    int calls = 1 << 30;
    int good_before = 0;
  };
  struct Format {
    std::uint32_t fourcc = 0;
    std::uint32_t bytes_per_pixel = 2;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> sizes;  // none: not listed
    bool is_range = false;
  };
  struct Control {
    int value = 0;
    int minimum = 0;
    int maximum = 0;
    int step = 1;
    std::uint32_t flags = 0;
  };
  struct Frame {
    std::uint32_t sequence = 0;
    std::uint32_t flags = 0x2000;  // V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC
    std::optional<std::uint32_t> bytes_used;
    std::uint32_t data_offset = 0;
    std::optional<std::uint32_t> index;  // a false index
    std::int64_t seconds = 12;
    std::int64_t microseconds = 345678;
  };
  /// Holds what the driver makes of a format it was asked for or has.
  struct Layout {
    std::uint32_t fourcc = 0;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::uint32_t stride_bytes = 0;
    std::uint32_t buffer_bytes = 0;
    std::uint32_t field = 1;  // V4L2_FIELD_NONE
    std::uint32_t planes = 1;
  };

  explicit FakeV4l2(bool is_multi_planar = false);
  capture::V4l2System system();

  // The camera; to be changed before it is opened.
  std::vector<std::string> paths{"/dev/video0"};
  std::vector<Format> formats;
  std::map<std::uint32_t, Control> controls;
  std::int64_t pixel_rate_hz = 0;  // 0: no such control
  std::uint32_t capabilities;
  std::uint32_t crop_width = 0;  // 0: no selections
  std::uint32_t interval[2] = {1, 30};
  bool sets_interval = true;
  std::optional<std::uint32_t> only_interval;  // frames per second that it keeps to
  Layout layout;                               // the current layout
  std::function<void(Layout&)> on_set_format;  // changes the layout of a format it knows
  std::function<void(std::uint32_t id)> on_set_control;
  std::optional<std::uint32_t> buffers_given;
  std::optional<std::uint32_t> buffer_length;
  std::optional<std::uint32_t> stated_length;  // a false length
  int map_errno = 0;

  // Faults: errno of the open or of one request; for `calls` calls, after `good_before` good ones.
  int open_errno = 0;
  std::map<unsigned long, Fault> faults;
  std::mt19937* random = nullptr;  // any call may fail, in any way
  int calls_before_unplugging = 1 << 30;
  bool unplugged = false;
  bool wakes_on_unplugging = true;
  short poll_answer = 0;  // bits that are returned at once, whatever is waited for
  int poll_errno = 0;

  // The stream.
  std::deque<Frame> frames;  // frames to come
  int frame_interval_ms = 10;

  // What was done.
  std::map<unsigned long, int> calls;
  int open_files = 0;
  int open_maps = 0;
  int misuses = 0;
  int accesses = 0;  // of DMA buffers, begun and not ended
  bool is_streaming = false;
  std::size_t requested = 0;
  std::int64_t now_ms = 0;
  std::size_t queued() const { return queue_.size(); }

 private:
  struct Memory {
    std::vector<std::byte> bytes;
    bool mapped = false;
    bool is_queued = false;
  };
  static FakeV4l2& of(void* context) { return *static_cast<FakeV4l2*>(context); }
  int open(const char* path);
  int close(int file);
  int ioctl(int file, unsigned long request, void* argument);
  int answer(int file, unsigned long request, void* argument);
  void* map(int file, std::size_t bytes, std::int64_t offset);
  int unmap(void* at, std::size_t bytes);
  int poll(int file, short events, int timeout_ms, short* happened);
  int random_fault(unsigned long request);

  int query(void* argument) const;
  int list_format(void* argument) const;
  int list_size(void* argument) const;
  int get_format(void* argument) const;
  int set_format(void* argument);
  int exchange_interval(void* argument, bool set);
  int query_control(void* argument) const;
  int exchange_control(void* argument, bool set);
  int wide_control(void* argument) const;
  int selection(void* argument) const;
  int request_buffers(void* argument);
  int query_buffer(void* argument) const;
  int queue_buffer(void* argument);
  int dequeue_buffer(void* argument);
  int export_buffer(void* argument);

  bool is_multi_planar_;
  std::map<int, int> files_;  // open files: -1 the camera, else the buffer exported
  int last_file_ = 2;
  std::vector<std::unique_ptr<Memory>> memory_;
  std::deque<std::uint32_t> queue_;
};

}  // namespace lowlux::test
