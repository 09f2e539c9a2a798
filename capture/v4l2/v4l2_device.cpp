#include "capture/v4l2/v4l2_device.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "capture/file/pass_on.h"

namespace lowlux::capture {
namespace {

// A signal interrupts a call once; more interruptions than this are not caused by signals.
constexpr int max_interruptions = 100;

// V4L2_CAP_IO_MC of Linux 5.9; older headers do not define it.
constexpr std::uint32_t capability_media_controlled = 0x20000000;

/// Returns a fixed field of a driver, which may lack its final zero, with '?' for unprintable characters.
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
  for (int attempt = 0; attempt < max_interruptions; ++attempt) {
    file = system.open(system.context, path.c_str());
    if (file >= 0 || errno != EINTR) break;
  }
  if (file < 0) {
    const int code = errno;
    if (code == ENOENT || code == ENOTDIR || code == ENODEV || code == ENXIO) {
      return fail(ErrorCode::not_found, "there is no such device: connect the camera, or name another device", path);
    }
    const std::string reason =
        code == EBUSY ? "another program uses it: end that program, or take another device"
        : code == EACCES || code == EPERM
            ? "no permission to open it: the user must be in the group that owns it, mostly 'video'"
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
    if (code == ENOTTY || code == EINVAL) return fail(ErrorCode::unsupported, "this is not a V4L2 device", path_);
    return tl::make_unexpected(error(code, "the driver does not state what the device is"));
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
  for (int attempt = 0; attempt < max_interruptions && code == EINTR; ++attempt) {
    code = system_.ioctl(system_.context, file_, request, argument) < 0 ? errno : 0;
  }
  if (code == ENODEV) gone_ = true;
  return code;
}

Error V4l2Device::error(int code, const std::string& what) const {
  switch (code) {
    case ENODEV:
      return disconnected_error();
    case EBUSY:
      return {ErrorCode::unreadable, what + ": another program uses the device, end that program first", path_};
    case ENOMEM:
      return {ErrorCode::too_large, what + ": there is not enough memory, ask for fewer buffers or a smaller size",
              path_};
    default:
      return {ErrorCode::unreadable, what + ": " + std::system_category().message(code), path_};
  }
}

Error V4l2Device::disconnected_error() const {
  return {ErrorCode::not_found,
          "the device is no longer available: " + name_ + " was unplugged or its driver was unloaded", path_};
}

namespace {

int open_device(void* /*context*/, const char* path) {
  return ::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC | O_NOCTTY);
}

int close_file(void* /*context*/, int file) { return ::close(file); }

int call(void* /*context*/, int file, unsigned long request, void* argument) {
  return ::ioctl(file, request, argument);
}

void* map(void* /*context*/, int file, std::size_t bytes, std::int64_t offset) {
  void* at = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, file, static_cast<off_t>(offset));
  return at == MAP_FAILED ? nullptr : at;
}

int unmap(void* /*context*/, void* at, std::size_t bytes) { return ::munmap(at, bytes); }

int wait(void* /*context*/, int file, short events, int timeout_ms, short* happened) {
  pollfd one{file, events, 0};
  const int count = ::poll(&one, 1, timeout_ms);
  *happened = one.revents;
  return count;
}

/// Returns the 7 of "video7".
std::optional<int> number_of(std::string_view name) {
  constexpr std::string_view prefix = "video";
  if (!name.starts_with(prefix)) return std::nullopt;
  name.remove_prefix(prefix.size());
  int number = 0;
  const auto [end, failure] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (failure != std::errc() || end != name.data() + name.size() || number < 0) return std::nullopt;
  return number;
}

std::vector<std::string> list_devices(void* /*context*/) {
  std::vector<std::pair<int, std::string>> found;
  std::error_code failure;
  for (std::filesystem::directory_iterator at("/dev", failure), end; !failure && at != end; at.increment(failure)) {
    if (const auto number = number_of(at->path().filename().string())) {
      found.emplace_back(*number, at->path().string());
    }
  }
  std::sort(found.begin(), found.end());
  std::vector<std::string> paths;
  paths.reserve(found.size());
  for (auto& [number, path] : found) paths.push_back(std::move(path));
  return paths;
}

std::chrono::nanoseconds now(void* /*context*/) { return std::chrono::steady_clock::now().time_since_epoch(); }

}  // namespace

V4l2System v4l2_system() {
  return {.context = nullptr,
          .open = open_device,
          .close = close_file,
          .ioctl = call,
          .map = map,
          .unmap = unmap,
          .poll = wait,
          .devices = list_devices,
          .now = now};
}

}  // namespace lowlux::capture
