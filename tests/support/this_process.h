#pragma once

#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

/// These functions return what Linux reports that this process holds.
namespace lowlux::test {

inline double resident_bytes() {
  std::ifstream file("/proc/self/statm");
  double whole = 0, resident = 0;
  file >> whole >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

inline int threads_now() {
  return static_cast<int>(std::distance(std::filesystem::directory_iterator("/proc/self/task"), {}));
}

/// Returns the number of threads before a test starts its own. A sanitizer's starts with the first of the program.
inline int threads_at_rest() {
  std::thread([] {}).join();
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  return threads_now();
}

/// Returns the number of threads as soon as it is `expected`, or after a second: one that was joined can stay listed
/// for a moment.
inline int settled_threads(int expected) {
  for (int tries = 0; tries < 200 && threads_now() != expected; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return threads_now();
}

}  // namespace lowlux::test
