#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

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

}  // namespace lowlux::capture
