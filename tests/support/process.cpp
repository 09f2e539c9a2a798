#include "tests/support/process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <stdexcept>

extern char** environ;

namespace lowlux::test {

RunningProcess::RunningProcess(const std::vector<std::string>& command) {
  const std::string out = scratch_.file("out");
  const std::string err = scratch_.file("err");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t ends;  // a test in the background of a shell may have SIGINT ignored
  sigemptyset(&ends);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) sigaddset(&ends, signal);
  posix_spawnattr_setsigdefault(&attributes, &ends);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  std::vector<char*> argv;
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const int failure = posix_spawnp(&child_, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (failure != 0) throw std::runtime_error("cannot run " + command.front());
}

RunningProcess::~RunningProcess() {
  if (child_ == 0) return;
  send(SIGKILL);
  waitpid(child_, nullptr, 0);
}

void RunningProcess::send(int signal) const { kill(child_, signal); }

ProcessResult RunningProcess::wait() {
  int status = 0;
  rusage usage{};
  wait4(child_, &status, 0, &usage);
  child_ = 0;
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_file(scratch_.file("out")),
          read_file(scratch_.file("err")), 1024.0 * static_cast<double>(usage.ru_maxrss)};
}

ProcessResult run_process(const std::vector<std::string>& command) { return RunningProcess(command).wait(); }

void write_file(const std::string& path, const void* data, std::size_t bytes) {
  std::ofstream(path, std::ios::binary).write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes));
}

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace lowlux::test
