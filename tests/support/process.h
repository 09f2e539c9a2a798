#pragma once

#include <cstddef>
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

void write_file(const std::string& path, const void* data, std::size_t bytes);
std::string read_file(const std::string& path);

}  // namespace lowlux::test
