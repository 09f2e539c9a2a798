#pragma once

#include <chrono>
#include <string_view>
#include <vector>

namespace lowlux::isp {

/// Holds the time that one step took.
struct StageTime {
  std::string_view stage;
  double seconds;
};

/// Records how long each step took: lap() names the time since the last one.
class StageClock {
 public:
  explicit StageClock(std::vector<StageTime>& times) : times_(times) {}
  void lap(std::string_view stage) {
    const auto now = std::chrono::steady_clock::now();
    times_.push_back({stage, std::chrono::duration<double>(now - start_).count()});
    start_ = now;
  }

 private:
  std::vector<StageTime>& times_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace lowlux::isp
