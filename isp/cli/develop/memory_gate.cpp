#include "isp/cli/develop/memory_gate.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include <fmt/format.h>

namespace lowlux::cli {
namespace {

namespace fs = std::filesystem;

/// Returns the number in a file that holds nothing else; nullopt for "max" and absent files.
std::optional<double> number_in(const fs::path& file) {
  double value = 0;
  if (std::ifstream(file) >> value) return value;
  return std::nullopt;
}

/// Returns the number after `key` in a file of "key number" lines.
std::optional<double> number_of_key(const fs::path& file, const std::string& key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string name;
    double value = 0;
    if (words >> name >> value && name == key) return value;
  }
  return std::nullopt;
}

/// Holds the names of a control group's memory files.
struct GroupFiles {
  const char* limit;
  const char* usage;
  const char* cache;  // in memory.stat: file pages the system can reclaim
};
constexpr GroupFiles version_1{"memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"};
constexpr GroupFiles version_2{"memory.max", "memory.current", "inactive_file"};

/// Returns the memory left by the group at root/group and its parents.
double room_in_groups(const fs::path& root, std::string group, const GroupFiles& files) {
  double room = std::numeric_limits<double>::infinity();
  for (;;) {
    const fs::path folder = root / fs::path(group).relative_path();
    const auto limit = number_in(folder / files.limit), usage = number_in(folder / files.usage);
    if (limit && usage) {
      const double cache = number_of_key(folder / "memory.stat", files.cache).value_or(0);
      room = std::min(room, *limit - *usage + cache);
    }
    if (group.empty() || group == "/") return room;
    group = fs::path(group).parent_path().string();
  }
}

}  // namespace

std::optional<double> available_memory(const std::string& proc, const std::string& groups) {
  double room = std::numeric_limits<double>::infinity();
  if (const auto kib = number_of_key(proc + "/meminfo", "MemAvailable:")) room = 1024 * *kib;
  std::ifstream own_groups(proc + "/self/cgroup");  // lines "ID:CONTROLLERS:PATH"; version 2 has no controllers
  for (std::string line; std::getline(own_groups, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1), group = line.substr(second + 1);
    if (controllers.empty()) room = std::min(room, room_in_groups(groups, group, version_2));
    if (controllers == "memory") room = std::min(room, room_in_groups(groups + "/memory", group, version_1));
  }
  if (room == std::numeric_limits<double>::infinity()) return std::nullopt;
  return std::max(room, 0.0);
}

/// Returns the number of files at a time: at least one, more only when their size is known.
int MemoryGate::capacity() const {
  if (file_bytes_ == 0) return 1;
  return static_cast<int>(std::clamp(limit_bytes_ / file_bytes_, 1.0, 1e6));
}

bool MemoryGate::has_room() const { return inside_ < capacity(); }

void MemoryGate::enter() {
  std::unique_lock lock(mutex_);
  while (!has_room()) {
    waited_ = waited_ || file_bytes_ > 0;
    changed_.wait(lock);
  }
  ++inside_;
}

void MemoryGate::report_size(std::size_t bytes) {
  const std::lock_guard lock(mutex_);
  file_bytes_ = std::max(file_bytes_, static_cast<double>(bytes));
  changed_.notify_all();
}

void MemoryGate::leave() {
  const std::lock_guard lock(mutex_);
  --inside_;
  changed_.notify_all();
}

int MemoryGate::parallel_files(int wanted) const {
  const std::lock_guard lock(mutex_);
  return std::min(wanted, capacity());
}

std::optional<std::string> MemoryGate::limit_text() const {
  const std::lock_guard lock(mutex_);
  if (!waited_) return std::nullopt;
  return fmt::format("{} files in parallel, limited by memory: about {:.0f} MB for each, {:.0f} MB for all", capacity(),
                     1e-6 * file_bytes_, 1e-6 * limit_bytes_);
}

}  // namespace lowlux::cli
