#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <string>

namespace lowlux::cli {

/// Shows a progress bar on stderr for work that takes longer than a second, if stderr is a terminal; else nothing. It
/// may be used from any thread.
class Progress {
 public:
  Progress(int total, bool wanted);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Adds `amount` to the progress; `what` names the current work.
  void advance(double amount, const std::string& what);
  /// Removes the bar, calls print(), and shows the bar again afterwards.
  void print(const std::function<void()>& print);

 private:
  void clear();

  std::mutex mutex_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  int total_;
  double done_ = 0;
  bool wanted_;
  bool shown_ = false;
};

}  // namespace lowlux::cli
