#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// What the V4L2 source asks of the operating system; tests put a driver of their own in its place. An entry behaves as
/// the system call of its name: -1 and errno on failure.
struct V4l2System {
  void* context = nullptr;                                 // first argument of each entry
  int (*open)(void* context, const char* path) = nullptr;  // to read and write; calls on it never wait
  int (*close)(void* context, int file) = nullptr;
  int (*ioctl)(void* context, int file, unsigned long request, void* argument) = nullptr;
  /// Shared, for reading; null on failure.
  void* (*map)(void* context, int file, std::size_t bytes, std::int64_t offset) = nullptr;
  int (*unmap)(void* context, void* at, std::size_t bytes) = nullptr;
  /// Waits for one file: `events` are the POLLIN... waited for, `*happened` what came; returns 1, or 0 after the time.
  int (*poll)(void* context, int file, short events, int timeout_ms, short* happened) = nullptr;
  std::vector<std::string> (*devices)(void* context) = nullptr;  // paths of video devices, video2 before video10
  std::chrono::nanoseconds (*now)(void* context) = nullptr;      // CLOCK_MONOTONIC
};

/// That of this machine: /dev/video*.
V4l2System v4l2_system();

/// A V4L2 capture node that is open. Closed on destruction.
class V4l2Device {
 public:
  /// Errors: no such device or gone (not_found), busy or not allowed (unreadable), no V4L2 capture device that streams
  /// (unsupported).
  static Result<std::unique_ptr<V4l2Device>> open(const V4l2System& system, const std::string& path);
  ~V4l2Device();
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  /// One ioctl, repeated where a signal interrupts it: 0, else errno.
  int call(unsigned long request, void* argument);

  /// The failure `code` (an errno) of the step `what`, as people read it.
  Error error(int code, const std::string& what) const;
  /// The one of a device that was unplugged.
  Error gone_error() const;

  const V4l2System& system() const { return system_; }
  int file() const { return file_; }
  const std::string& path() const { return path_; }
  const std::string& name() const { return name_; }    // of the hardware, printable; the path where it does not tell
  std::uint32_t buffer_type() const { return type_; }  // V4L2_BUF_TYPE_VIDEO_CAPTURE, with _MPLANE or not
  bool multi_planar() const { return multi_planar_; }
  /// The driver leaves the way from the sensor to this node to the media controller: the formats it lists are those of
  /// the node, whatever the sensor delivers.
  bool media_controlled() const { return media_controlled_; }
  bool gone() const { return gone_; }  // some call found that the device is there no longer
  void set_gone() { gone_ = true; }

 private:
  V4l2Device(const V4l2System& system, std::string path, int file);
  Result<void> identify();

  V4l2System system_;
  std::string path_;
  int file_;
  std::string name_;
  std::uint32_t type_ = 0;
  bool multi_planar_ = false;
  bool media_controlled_ = false;
  bool gone_ = false;
};

/// How frames get into this process. Both without a copy.
enum class V4l2Memory : std::uint8_t {
  mmap,    // the driver's buffers are mapped
  dma_buf  // they are exported as DMA buffers (VIDIOC_EXPBUF), mapped, and synchronised around each use
};

struct V4l2Options {
  CameraRequest request;
  V4l2Memory memory = V4l2Memory::mmap;
  /// Of V4L2_CID_ANALOGUE_GAIN, else V4L2_CID_GAIN, in the driver's own units; instead of CameraRequest::analogue_gain.
  std::optional<int> gain_code;
};

}  // namespace lowlux::capture
