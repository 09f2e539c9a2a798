#pragma once

#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <optional>
#include <string>

namespace lowlux::cli {

/// Memory this process may still take [bytes]: what the system calls available, or what its control groups (v1 or v2)
/// leave if that is less. nullopt if nothing is known.
/// @param proc, groups  where the system reports them
std::optional<double> available_memory(const std::string& proc = "/proc", const std::string& groups = "/sys/fs/cgroup");

/// Lets as many files be worked on at a time as memory holds, and always one. All are taken to be as large as the
/// largest so far; until the first size is known there is one file.
class MemoryGate {
 public:
  /// @param limit_bytes  for all files together
  explicit MemoryGate(double limit_bytes) : limit_bytes_(limit_bytes) {}

  /// Waits until there is memory for one more file.
  void enter();
  /// A file that was let in takes so much.
  void report_size(std::size_t bytes);
  void leave();
  /// How many files of those that are wanted at a time memory holds; 1 until the first size is known.
  int files_at_a_time(int wanted) const;

  /// enter() and leave() of a gate, if there is one.
  class Entry {
   public:
    explicit Entry(MemoryGate* gate) : gate_(gate) {
      if (gate_ != nullptr) gate_->enter();
    }
    ~Entry() {
      if (gate_ != nullptr) gate_->leave();
    }
    Entry(const Entry&) = delete;
    Entry& operator=(const Entry&) = delete;

   private:
    MemoryGate* gate_;
  };

  /// Text about the limit if files had to wait for memory; else nullopt.
  std::optional<std::string> limit_text() const;

 private:
  bool has_room() const;
  int capacity() const;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  double limit_bytes_;
  double file_bytes_ = 0;
  int inside_ = 0;
  bool waited_ = false;  // for memory, not for the first size
};

}  // namespace lowlux::cli
