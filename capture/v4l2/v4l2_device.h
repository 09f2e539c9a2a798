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

/// Operating system calls of the V4L2 source; tests replace them by a driver of their own. An entry behaves as the
/// system call of its name: -1 and errno on failure.
struct V4l2System {
  void* context = nullptr;                                 // first argument of each entry
  int (*open)(void* context, const char* path) = nullptr;  // to read and write; calls on it do not block
  int (*close)(void* context, int file) = nullptr;
  int (*ioctl)(void* context, int file, unsigned long request, void* argument) = nullptr;
  /// Maps shared memory for reading; returns null on failure.
  void* (*map)(void* context, int file, std::size_t bytes, std::int64_t offset) = nullptr;
  int (*unmap)(void* context, void* at, std::size_t bytes) = nullptr;
  /// Waits for one file: `events` are the awaited POLLIN..., `*happened` those that occurred; returns 1, or 0 after the
  /// time.
  int (*poll)(void* context, int file, short events, int timeout_ms, short* happened) = nullptr;
  std::vector<std::string> (*devices)(void* context) = nullptr;  // paths of video devices, video2 before video10
  std::chrono::nanoseconds (*now)(void* context) = nullptr;      // CLOCK_MONOTONIC
};

/// Returns the calls of this machine: /dev/video*.
V4l2System v4l2_system();

/// A V4L2 capture node that is open. Closed on destruction.
class V4l2Device {
 public:
  /// Opens a device. Errors: no such device or gone (not_found), busy or not allowed (unreadable), not a V4L2 capture
  /// device that streams (unsupported).
  static Result<std::unique_ptr<V4l2Device>> open(const V4l2System& system, const std::string& path);
  ~V4l2Device();
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  /// Makes one ioctl, repeated if a signal interrupts it: returns 0, else errno.
  int call(unsigned long request, void* argument);

  /// Returns the failure `code` (an errno) of the step `what`, as a message.
  Error error(int code, const std::string& what) const;
  /// Returns the error of a device that was unplugged.
  Error disconnected_error() const;

  const V4l2System& system() const { return system_; }
  int file() const { return file_; }
  const std::string& path() const { return path_; }
  const std::string& name() const { return name_; }    // name of the hardware, printable; the path if it states none
  std::uint32_t buffer_type() const { return type_; }  // V4L2_BUF_TYPE_VIDEO_CAPTURE, with _MPLANE or not
  bool multi_planar() const { return multi_planar_; }
  /// Whether the driver leaves the route from the sensor to this node to the media controller: the formats it lists are
  /// then those of the node, whatever the sensor delivers.
  bool media_controlled() const { return media_controlled_; }
  bool gone() const { return gone_; }  // a call found that the device no longer exists
  void set_disconnected() { gone_ = true; }

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

/// Transfer of frames into this process. Both ways avoid a copy.
enum class V4l2Memory : std::uint8_t {
  mmap,    // the driver's buffers are mapped
  dma_buf  // the buffers are exported as DMA buffers (VIDIOC_EXPBUF), mapped, and synchronised around each use
};

/// Holds the options of open_v4l2().
struct V4l2Options {
  CameraRequest request;
  V4l2Memory memory = V4l2Memory::mmap;
  /// Value for V4L2_CID_ANALOGUE_GAIN, else V4L2_CID_GAIN, in the driver's own units; instead of
  /// CameraRequest::analogue_gain.
  std::optional<int> gain_code;
  /// The codes that automatic exposure may set, with the factors that they stand for: V4L2 does not state them. Empty:
  /// the gain stays as it is.
  std::vector<CameraGain> gain_codes;
};

}  // namespace lowlux::capture
