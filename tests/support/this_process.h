#pragma once

#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

/// These functions return what Linux reports that this process holds; WithoutRoot changes whose process it is.
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

/// Makes the process of root one of an ordinary user for as long as it lives, so that permissions apply. Those of other
/// users stay what they are.
class WithoutRoot {
 public:
  WithoutRoot() : was_root_(geteuid() == 0 && seteuid(nobody) == 0) {}
  ~WithoutRoot() {
    if (was_root_ && seteuid(0) != 0) _exit(1);
  }
  WithoutRoot(const WithoutRoot&) = delete;
  WithoutRoot& operator=(const WithoutRoot&) = delete;

 private:
  static constexpr uid_t nobody = 65534;
  bool was_root_;
};

}  // namespace lowlux::test
