#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <string>

namespace lowlux::cli {

/// A progress bar on stderr for work that takes longer than a second, where stderr is a terminal; elsewhere nothing.
/// May be used from any thread.
class Progress {
 public:
  Progress(int total, bool wanted);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Another `amount` of the total is done; `what` is being worked on.
  void advance(double amount, const std::string& what);
  /// Takes the bar off its line and calls print(); the bar stays away until that is done.
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
