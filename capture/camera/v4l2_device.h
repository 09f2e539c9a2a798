#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "capture/camera/v4l2_system.h"
#include "isp/base/result.h"

namespace lowlux::capture {

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

}  // namespace lowlux::capture
