#include "isp/bench/methods/contained_command.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <mutex>
#include <optional>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace lowlux::isp {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int number_descriptor = 3;  // receives the command's process ID
constexpr int life_descriptor = 4;    // reaches its end when this process dies
constexpr int go_descriptor = 5;      // receives a line when the command may begin
constexpr int first_free_descriptor = 6;
constexpr std::size_t longest_quote = 200;
constexpr const char* output_file = "printed.txt";

/// Starts a watchdog and the command in the background and exits, so that both become children of the subreaper. The
/// command's accounting then begins with this small shell; the watchdog removes everything if lowlux dies. The command
/// waits for a line, so that it cannot end before the starter, which would collect it.
/// Arguments: 1 blocks of 512 bytes of a file, 2 KiB of memory, 3 the command, 4 the folder.
constexpr const char* starter = R"(ulimit -c 0; ulimit -f "$1"; ulimit -d "$2"
{ exec 3>&- 5<&-; read -r _ <&4; rm -rf "$4"; kill -KILL 0; } >/dev/null 2>&1 &
{ read -r _ <&5 && exec 3>&- 4<&- 5<&- && exec /bin/sh -c "$3"; } &
echo $! >&3
)";

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

Error system_error(const std::string& what, int number) {
  return {ErrorCode::unreadable, what + ": " + std::generic_category().message(number), {}};
}

/// A pipe whose ends other programs do not inherit, above the descriptors of the starter.
class Pipe {
 public:
  Pipe() {
    std::array<int, 2> low{};
    if (pipe2(low.data(), O_CLOEXEC) != 0) return;
    for (std::size_t i = 0; i < 2; ++i) {
      end_[i] = fcntl(low[i], F_DUPFD_CLOEXEC, first_free_descriptor);
      close(low[i]);
    }
  }
  ~Pipe() {
    close_end(0);
    close_end(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  bool is_open() const { return end_[0] >= 0 && end_[1] >= 0; }
  int read_end() const { return end_[0]; }
  int write_end() const { return end_[1]; }
  void close_end(std::size_t i) {
    if (end_[i] >= 0) close(std::exchange(end_[i], -1));
  }

 private:
  std::array<int, 2> end_{-1, -1};
};

struct Pipes {
  Pipe number, life, go;

  bool are_open() const { return number.is_open() && life.is_open() && go.is_open(); }
};

/// Makes this process adopt orphans while the object exists.
class Subreaper {
 public:
  Subreaper() {
    prctl(PR_GET_CHILD_SUBREAPER, &before_, 0, 0, 0);
    prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0);
  }
  ~Subreaper() { prctl(PR_SET_CHILD_SUBREAPER, static_cast<unsigned long>(before_), 0, 0, 0); }
  Subreaper(const Subreaper&) = delete;
  Subreaper& operator=(const Subreaper&) = delete;

 private:
  int before_ = 0;
};

/// Returns the environment with TMPDIR in the folder.
std::vector<std::string> environment_of(const std::filesystem::path& folder) {
  std::vector<std::string> out{"TMPDIR=" + folder.string()};
  for (char** entry = environ; *entry != nullptr; ++entry) {
    if (!std::string_view(*entry).starts_with("TMPDIR=")) out.emplace_back(*entry);
  }
  return out;
}

std::vector<char*> pointers_of(std::vector<std::string>& words) {
  std::vector<char*> out;
  out.reserve(words.size() + 1);
  for (std::string& word : words) out.push_back(word.data());
  out.push_back(nullptr);
  return out;
}

/// Starts the starter in a process group of its own, which its process ID names.
Result<pid_t> start(std::vector<std::string> words, const std::filesystem::path& folder, const Pipes& pipes) {
  const std::string output = (folder / output_file).string();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, output.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  posix_spawn_file_actions_adddup2(&actions, 1, 2);
  posix_spawn_file_actions_adddup2(&actions, pipes.number.write_end(), number_descriptor);
  posix_spawn_file_actions_adddup2(&actions, pipes.life.read_end(), life_descriptor);
  posix_spawn_file_actions_adddup2(&actions, pipes.go.read_end(), go_descriptor);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t all, none;
  sigfillset(&all);
  sigemptyset(&none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
  std::vector<std::string> environment = environment_of(folder);
  pid_t child = 0;
  const int failed = posix_spawn(&child, words[0].c_str(), &actions, &attributes, pointers_of(words).data(),
                                 pointers_of(environment).data());
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return tl::make_unexpected(system_error("/bin/sh cannot start", failed));
  return child;
}

/// Reads the process ID that the starter prints. Returns 0 if it prints none.
pid_t read_number(Pipe& number) {
  number.close_end(1);
  std::string text;
  std::array<char, 32> part{};
  for (;;) {
    const ssize_t got = read(number.read_end(), part.data(), part.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0 || text.size() > part.size()) break;
    text.append(part.data(), static_cast<std::size_t>(got));
    if (text.ends_with('\n')) break;
  }
  return static_cast<pid_t>(std::strtol(text.c_str(), nullptr, 10));
}

struct Ended {
  int status = 0;
  rusage used{};
};

/// Waits for one child.
void collect(pid_t child) {
  while (waitpid(child, nullptr, 0) < 0 && errno == EINTR) continue;
}

/// Waits for a process of a group until the time is over; others of the group are collected too.
std::optional<Ended> wait_for(pid_t group, pid_t process, Clock::time_point begin, double max_wall_s) {
  constexpr auto pause = std::chrono::milliseconds(1);
  for (;;) {
    Ended ended;
    const pid_t found = wait4(-group, &ended.status, WNOHANG, &ended.used);
    if (found == process) return ended;
    if (found < 0 && errno != EINTR) return std::nullopt;
    if (seconds_since(begin) > max_wall_s) return std::nullopt;
    if (found > 0) continue;
    std::this_thread::sleep_for(pause);
  }
}

/// Kills what is left of a group and collects it.
void end_group(pid_t group) {
  kill(-group, SIGKILL);
  for (;;) {
    if (waitpid(-group, nullptr, 0) < 0 && errno != EINTR) return;
  }
}

/// Reports whether a process has a text of `NAME=value` in the environment that it was started with.
bool has_in_environment(const std::filesystem::path& process, const std::string& entry) {
  std::ifstream file(process / "environ", std::ios::binary);
  for (std::string found; std::getline(file, found, '\0');) {
    if (found == entry) return true;
  }
  return false;
}

/// Kills and collects the processes of a command that left its group, as by setsid; its TMPDIR names them. Children of
/// a killed process become those of the subreaper. One that starts others faster than they are found is given up.
void end_outside_group(const std::filesystem::path& folder) {
  constexpr int max_rounds = 100;
  const std::string entry = "TMPDIR=" + folder.string();
  std::vector<pid_t> killed{0};
  for (int round = 0; !killed.empty() && round < max_rounds; ++round) {
    killed.clear();
    std::error_code failed;
    for (std::filesystem::directory_iterator at("/proc", failed), end; !failed && at != end; at.increment(failed)) {
      const auto process = static_cast<pid_t>(std::strtol(at->path().filename().c_str(), nullptr, 10));
      if (process <= 0 || process == getpid() || !has_in_environment(at->path(), entry)) continue;
      if (kill(process, SIGKILL) == 0) killed.push_back(process);
    }
    // A grandchild can be collected once its parent is.
    std::vector<pid_t> left = killed;
    while (std::erase_if(left, [](pid_t process) { return waitpid(process, nullptr, 0) == process; }) > 0) continue;
  }
}

/// Returns the last line of the output that is not empty, shortened, as `: "text"`; empty if there is none, or if the
/// command put something else in the place of the file: opening a pipe would wait for ever.
std::string last_printed(const std::filesystem::path& folder) {
  constexpr std::streamoff tail = 4096;
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(std::filesystem::symlink_status(folder / output_file, unknown))) return {};
  std::ifstream file(folder / output_file, std::ios::binary);
  file.seekg(0, std::ios::end);
  const std::streamoff size = file.tellg();
  if (size <= 0) return {};
  file.seekg(std::max(std::streamoff{0}, size - tail));
  std::string text(static_cast<std::size_t>(std::min(size, tail)), '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.erase(text.find_last_not_of(std::string_view(" \t\r\n\0", 5)) + 1);
  text.erase(0, text.find_last_of('\n') + 1);
  for (char& c : text) {
    if (c < ' ' || c > '~') c = ' ';
  }
  if (text.size() > longest_quote) text = text.substr(0, longest_quote) + "...";
  return text.empty() ? text : ": " + text;
}

std::string signal_text(int number, const CommandLimits& limits) {
  if (number == SIGXFSZ) {
    return fmt::format("it was stopped when it had written {} MB to one file", limits.max_file_bytes / 1000000);
  }
  return fmt::format("signal {} ended it ({})", number, sigdescr_np(number));
}

/// Returns the Error of a command that did not exit with 0.
std::optional<Error> failure_of(int status, const std::filesystem::path& folder, const CommandLimits& limits) {
  constexpr int not_found_exit = 127, signal_exit = 128;  // exit codes of /bin/sh
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return std::nullopt;
  const std::string printed = last_printed(folder);
  if (WIFSIGNALED(status)) return Error{ErrorCode::unreadable, signal_text(WTERMSIG(status), limits) + printed, {}};
  const int code = WEXITSTATUS(status);
  if (code == not_found_exit) return Error{ErrorCode::not_found, "its program is not found" + printed, {}};
  std::string what = fmt::format("it ended with exit code {}", code);
  if (code > signal_exit && code - signal_exit < NSIG) {
    what += fmt::format(", which means that {}", signal_text(code - signal_exit, limits));
  }
  return Error{ErrorCode::unreadable, what + printed, {}};
}

}  // namespace

Result<CommandUse> run_contained(const std::string& command, const std::filesystem::path& folder,
                                 const CommandLimits& limits) {
  static std::mutex one_at_a_time;  // the setting of a subreaper is the process's
  const std::lock_guard turn(one_at_a_time);
  Pipes pipes;
  if (!pipes.are_open()) return tl::make_unexpected(system_error("cannot make a pipe for a program", errno));
  const Subreaper adopting;
  const std::string memory_kib =
      command_memory_is_limited ? fmt::format("{}", limits.max_memory_bytes / 1024) : "unlimited";
  const auto group = start({"/bin/sh", "-c", starter, "lowlux", fmt::format("{}", limits.max_file_bytes / 512),
                            memory_kib, command, folder.string()},
                           folder, pipes);
  if (!group) return tl::make_unexpected(group.error());
  const pid_t process = read_number(pipes.number);
  collect(*group);
  const auto begin = Clock::now();
  const bool begun = process > 0 && write(pipes.go.write_end(), "\n", 1) == 1;
  const auto ended = begun ? wait_for(*group, process, begin, limits.max_wall_s) : std::nullopt;
  CommandUse use{.wall_s = seconds_since(begin)};
  end_group(*group);
  end_outside_group(folder);
  if (!begun) return fail(ErrorCode::unreadable, "/bin/sh cannot start it" + last_printed(folder));
  if (!ended && use.wall_s < limits.max_wall_s) {
    return fail(ErrorCode::unreadable, "its exit was collected by other code of this process");
  }
  if (!ended) {
    return fail(ErrorCode::too_large,
                fmt::format("it was stopped at its time limit of {:g} s", limits.max_wall_s) + last_printed(folder));
  }
  if (auto error = failure_of(ended->status, folder, limits)) return tl::make_unexpected(*std::move(error));
  use.cpu_s = seconds_of(ended->used.ru_utime) + seconds_of(ended->used.ru_stime);
  use.peak_bytes = 1024.0 * static_cast<double>(ended->used.ru_maxrss);
  return use;
}

std::string shell_word(const std::string& text) {
  constexpr std::string_view plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./+-=:,@%";
  if (!text.empty() && text.find_first_not_of(plain) == std::string::npos) return text;
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
    } else {
      out += c;
    }
  }
  return out + "'";
}

}  // namespace lowlux::isp
