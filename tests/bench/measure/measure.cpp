#include "tests/bench/measure/measure.h"

#include <algorithm>
#include <ctime>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace lowlux::test {
namespace {

double now_ms(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

}  // namespace

bool Arguments::flag(std::string_view name) { return std::erase(words_, name) > 0; }

std::optional<std::string> Arguments::option(std::string_view name) {
  const auto found = std::ranges::find(words_, name);
  if (found == words_.end()) return std::nullopt;
  if (found + 1 == words_.end()) throw Failure(2, fmt::format("{} has no value", name));
  std::string value = std::move(*(found + 1));
  words_.erase(found, found + 2);
  return value;
}

std::optional<std::string> Arguments::next() {
  if (words_.empty()) return std::nullopt;
  if (words_.front().starts_with("--")) end();
  std::string word = std::move(words_.front());
  words_.erase(words_.begin());
  return word;
}

bool Arguments::is_next(std::string_view word) {
  const bool is = !words_.empty() && words_.front() == word;
  if (is) words_.erase(words_.begin());
  return is;
}

std::string Arguments::required(const std::string& what) {
  auto word = next();
  if (!word) throw Failure(2, what + " is missing");
  return *std::move(word);
}

std::string Arguments::one_of(std::initializer_list<std::string_view> choices) {
  const std::string known = fmt::format("{}", fmt::join(choices, " or "));
  std::string word = required(known);
  if (std::ranges::find(choices, word) == choices.end()) throw Failure(2, fmt::format("'{}' is not {}", word, known));
  return word;
}

void Arguments::end() const {
  if (!words_.empty()) throw Failure(2, fmt::format("unexpected argument '{}'", words_.front()));
}

void Arguments::refuse_number(const std::string& text, double min) {
  throw Failure(2, fmt::format("'{}' is not a number of at least {:g}", text, min));
}

double wall_ms() { return now_ms(CLOCK_MONOTONIC); }
double cpu_ms() { return now_ms(CLOCK_PROCESS_CPUTIME_ID); }

void time_in_turn(std::span<Task> tasks, int rounds) {
  for (int round = -1; round < rounds; ++round) {
    for (Task& task : tasks) {
      const double wall_start_ms = wall_ms(), cpu_start_ms = cpu_ms();
      task.run();
      const double cpu_end_ms = cpu_ms(), wall_end_ms = wall_ms();
      if (round < 0) continue;
      task.wall_times_ms.push_back(wall_end_ms - wall_start_ms);
      task.cpu_times_ms.push_back(cpu_end_ms - cpu_start_ms);
    }
  }
}

}  // namespace lowlux::test
