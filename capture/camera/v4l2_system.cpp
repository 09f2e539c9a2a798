#include "capture/camera/v4l2_system.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

namespace lowlux::capture {
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

/// The 7 of "video7".
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
