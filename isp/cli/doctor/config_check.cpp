#include "isp/cli/doctor/config_check.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <map>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "isp/cli/help/suggestion.h"

namespace lowlux::cli {
namespace {

/// Returns the parts of a text that are not empty.
std::vector<std::string> parts_of(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find(separator, start), text.size());
    if (end > start) parts.emplace_back(text.substr(start, end - start));
    start = end + 1;
  }
  return parts;
}

std::string text_of_pipe(int descriptor) {
  std::string text;
  std::array<char, 4096> block{};
  for (;;) {
    const ssize_t got = ::read(descriptor, block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return text;
    text.append(block.data(), static_cast<std::size_t>(got));
  }
}

/// Runs this command with arguments, and returns its standard output; nullopt if it could not be run or failed.
std::optional<std::string> output_of_command(std::vector<std::string> words) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return std::nullopt;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  words.insert(words.begin(), "lowlux");
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int failure = posix_spawn(&child, "/proc/self/exe", &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  std::string text = failure == 0 ? text_of_pipe(ends[0]) : std::string();
  close(ends[0]);
  int status = 0;
  const bool is_done = failure == 0 && waitpid(child, &status, 0) == child && WIFEXITED(status);
  if (!is_done || WEXITSTATUS(status) != 0) return std::nullopt;
  return text;
}

/// Returns the names of the options of a verb, "calibrate black" for example; empty if they cannot be listed.
std::vector<std::string> option_names(const std::string& verb) {
  std::vector<std::string> words = parts_of(verb, ' ');
  words.emplace_back("--help-options");
  const auto text = output_of_command(std::move(words));
  return text ? parts_of(*text, '\n') : std::vector<std::string>();
}

}  // namespace

std::string unknown_options(const std::vector<ConfigLine>& lines, const std::string& file) {
  std::map<std::string, std::vector<std::string>> names_of;  // by verb
  std::string text;
  for (const ConfigLine& line : lines) {
    const auto [found, is_new] = names_of.try_emplace(line.verb);
    if (is_new) found->second = option_names(line.verb);
    const std::vector<std::string>& names = found->second;
    if (names.empty() || std::ranges::find(names, line.option) != names.end()) continue;
    const std::vector<std::string_view> known(names.begin(), names.end());
    text += fmt::format("{}{}:{}: {} has no option '{}'{}", text.empty() ? "" : "; ", file, line.number, line.verb,
                        line.option, suggestion(line.option, known));
  }
  return text;
}

}  // namespace lowlux::cli
