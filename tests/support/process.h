#pragma once

#include <sys/types.h>

#include <cstddef>
#include <string>
#include <vector>

#include "tests/support/scratch_directory.h"

namespace lowlux::test {

/// Holds what a finished program left behind.
struct ProcessResult {
  int exit_code = -1;  // 128 + signal if a signal ended it
  std::string out;
  std::string err;
  double peak_bytes = 0;  // largest resident memory; at least what the test had when it started the program
};

/// Runs a program in a process group of its own, with its output captured and no standard input.
class RunningProcess {
 public:
  explicit RunningProcess(const std::vector<std::string>& command);
  ~RunningProcess();  // kills the program
  RunningProcess(const RunningProcess&) = delete;
  RunningProcess& operator=(const RunningProcess&) = delete;

  void send(int signal) const;
  ProcessResult wait();

 private:
  ScratchDirectory scratch_;
  pid_t child_ = 0;  // 0 once the program has ended
};

/// Runs a program to its end.
ProcessResult run_process(const std::vector<std::string>& command);

void write_file(const std::string& path, const void* data, std::size_t bytes);
std::string read_file(const std::string& path);

}  // namespace lowlux::test
