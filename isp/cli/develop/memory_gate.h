#pragma once

#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <optional>
#include <string>

namespace lowlux::cli {

/// Returns the memory this process may still take [bytes]: the system's available memory, or the memory left by its
/// control groups (v1 or v2) if that is less. Returns nullopt if nothing is known.
/// @param proc, groups  paths under which the system reports them
std::optional<double> available_memory(const std::string& proc = "/proc", const std::string& groups = "/sys/fs/cgroup");

/// Limits the number of files processed at a time to those that fit in memory, at least one. All are assumed to be as
/// large as the largest so far; until the first size is known, one file is processed.
class MemoryGate {
 public:
  /// @param limit_bytes  for all files together
  explicit MemoryGate(double limit_bytes) : limit_bytes_(limit_bytes) {}

  /// Waits until there is memory for one more file.
  void enter();
  /// Reports the memory that a file which has entered takes.
  void report_size(std::size_t bytes);
  void leave();
  /// Returns how many of the wanted files fit in memory at a time; 1 until the first size is known.
  int parallel_files(int wanted) const;

  /// Calls enter() and leave() of a gate, if it is not null.
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

  /// Returns text about the limit if files had to wait for memory; else nullopt.
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
