#include "capture/camera/v4l2_device.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "capture/file/pass_on.h"

namespace lowlux::capture {
namespace {

// A signal interrupts a call once; what interrupts it this often is no signal.
constexpr int most_interruptions = 100;

// V4L2_CAP_IO_MC of Linux 5.9; older headers lack it.
constexpr std::uint32_t capability_media_controlled = 0x20000000;

/// A fixed field of a driver, which may lack its final zero, with what cannot be printed as '?'.
template <std::size_t n>
std::string printable(const unsigned char (&field)[n]) {
  std::string text(std::begin(field), std::find(std::begin(field), std::end(field), '\0'));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

}  // namespace

V4l2Device::V4l2Device(const V4l2System& system, std::string path, int file)
    : system_(system), path_(std::move(path)), file_(file), name_(path_) {}

V4l2Device::~V4l2Device() { system_.close(system_.context, file_); }

Result<std::unique_ptr<V4l2Device>> V4l2Device::open(const V4l2System& system, const std::string& path) {
  int file = -1;
  for (int attempt = 0; attempt < most_interruptions; ++attempt) {
    file = system.open(system.context, path.c_str());
    if (file >= 0 || errno != EINTR) break;
  }
  if (file < 0) {
    const int code = errno;
    if (code == ENOENT || code == ENOTDIR || code == ENODEV || code == ENXIO) {
      return fail(ErrorCode::not_found, "there is no such device: connect the camera, or name another device", path);
    }
    const std::string reason = code == EBUSY ? "another program uses it: end that program, or take another device"
                               : code == EACCES || code == EPERM
                                   ? "it may not be opened: become a member of the group that owns it, mostly 'video'"
                                   : "it cannot be opened: " + std::system_category().message(code);
    return fail(ErrorCode::unreadable, reason, path);
  }
  std::unique_ptr<V4l2Device> device(new V4l2Device(system, path, file));
  if (auto known = device->identify(); !known) return pass_on(known);
  return device;
}

Result<void> V4l2Device::identify() {
  v4l2_capability told{};
  if (const int code = call(VIDIOC_QUERYCAP, &told)) {
    if (code == ENOTTY || code == EINVAL) return fail(ErrorCode::unsupported, "this is no V4L2 device", path_);
    return tl::make_unexpected(error(code, "the driver does not tell what the device is"));
  }
  name_ = printable(told.card);
  const std::uint32_t can = (told.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? told.device_caps : told.capabilities;
  const bool single_planar = (can & V4L2_CAP_VIDEO_CAPTURE) != 0;
  multi_planar_ = !single_planar && (can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0;
  if (!single_planar && !multi_planar_) {
    return fail(ErrorCode::unsupported, name_ + " captures no video at this node: take another node of the camera",
                path_);
  }
  if ((can & V4L2_CAP_STREAMING) == 0) {
    return fail(ErrorCode::unsupported, name_ + " does not stream into buffers, which lowlux needs", path_);
  }
  type_ = multi_planar_ ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  media_controlled_ = (can & capability_media_controlled) != 0;
  return {};
}

int V4l2Device::call(unsigned long request, void* argument) {
  int code = EINTR;
  for (int attempt = 0; attempt < most_interruptions && code == EINTR; ++attempt) {
    code = system_.ioctl(system_.context, file_, request, argument) < 0 ? errno : 0;
  }
  if (code == ENODEV) gone_ = true;
  return code;
}

Error V4l2Device::error(int code, const std::string& what) const {
  switch (code) {
    case ENODEV:
      return gone_error();
    case EBUSY:
      return {ErrorCode::unreadable, what + ": another program uses the device, end that program first", path_};
    case ENOMEM:
      return {ErrorCode::too_large, what + ": there is not enough memory, ask for fewer buffers or a smaller size",
              path_};
    default:
      return {ErrorCode::unreadable, what + ": " + std::system_category().message(code), path_};
  }
}

Error V4l2Device::gone_error() const {
  return {ErrorCode::not_found, "the device is gone: " + name_ + " was unplugged or its driver was unloaded", path_};
}

}  // namespace lowlux::capture
