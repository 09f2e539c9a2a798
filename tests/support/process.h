#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lowlux::test {

/// What a finished program left behind.
struct ProcessResult {
  int exit_code = -1;  // 128 + signal if a signal ended it
  std::string out;
  std::string err;
};

/// Runs a program with its output captured and no standard input.
ProcessResult run_process(const std::vector<std::string>& command);

/// A folder that is gone with its object.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  /// Names in the folder, sorted, hidden ones included.
  std::vector<std::string> names() const;

 private:
  std::filesystem::path folder_;
};

void write_file(const std::string& path, const void* data, std::size_t bytes);
std::string read_file(const std::string& path);

}  // namespace lowlux::test
