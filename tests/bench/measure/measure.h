#pragma once

#include <charconv>
#include <functional>
#include <initializer_list>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "isp/base/result.h"
#include "isp/metrics/statistics.h"

/// What the measurements of the program `measure` share, and the measurements.
namespace lowlux::test {

/// Ends a measurement: the message is printed in one line.
struct Failure : std::runtime_error {
  Failure(int code, const std::string& message) : std::runtime_error(message), exit_code(code) {}
  int exit_code;  // 2: the arguments cannot be used, 1: anything else
};

/// Returns the value, or fails with the error's message.
template <class T>
T value_of(Result<T> result) {
  if (!result) throw Failure(1, result.error().message);
  return std::move(*result);
}

/// Holds the arguments of a measurement that have not been read yet. Options and flags are read first, then what else
/// there is in its order, then end(). Arguments that cannot be used are a failure.
class Arguments {
 public:
  explicit Arguments(std::vector<std::string> words) : words_(std::move(words)) {}

  /// Returns whether "NAME" is given.
  bool flag(std::string_view name);
  /// Returns the value of "NAME VALUE".
  std::optional<std::string> option(std::string_view name);
  template <class Number>
  Number option(std::string_view name, Number otherwise, Number min) {
    const auto text = option(name);
    return text ? number_in(*text, min) : otherwise;
  }
  /// Returns the next argument.
  std::optional<std::string> next();
  template <class Number>
  Number next(Number otherwise, Number min) {
    const auto text = next();
    return text ? number_in(*text, min) : otherwise;
  }
  /// Returns whether the next argument is this one, and then reads it.
  bool is_next(std::string_view word);
  /// Returns the next argument, which has to be there.
  std::string required(const std::string& what);
  /// Returns the next argument, which has to be one of these.
  std::string one_of(std::initializer_list<std::string_view> choices);
  /// Fails if an argument is left.
  void end() const;

  template <class Number>
  static Number number_in(const std::string& text, Number min) {
    Number number{};
    const char* const last = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data(), last, number);
    if (error != std::errc() || end != last || !(number >= min)) refuse_number(text, static_cast<double>(min));
    return number;
  }

 private:
  [[noreturn]] static void refuse_number(const std::string& text, double min);
  std::vector<std::string> words_;
};

/// Returns the time of the wall clock, and the processor time of all threads together.
double wall_ms();
double cpu_ms();

/// Returns how long some work takes by one of these clocks.
template <class Work>
double ms_of(double (*clock_ms)(), const Work& work) {
  const double start_ms = clock_ms();
  work();
  return clock_ms() - start_ms;
}

/// Holds work that is timed in several rounds.
struct Task {
  std::string name;
  std::function<void()> run;
  double amount = 1;  // of pixels, megapixels or draws in one round
  int threads = 1;
  std::vector<double> wall_times_ms{}, cpu_times_ms{};

  double median_wall_ms() const { return isp::median(wall_times_ms) / amount; }
  double median_cpu_ms() const { return isp::median(cpu_times_ms) / amount; }
};

/// Runs all tasks in turn, after one round that does not count.
void time_in_turn(std::span<Task> tasks, int rounds);

int measure_align(Arguments& arguments);
int measure_calibration(Arguments& arguments);
int measure_colour_table(Arguments& arguments);
int measure_denoise(Arguments& arguments);
int measure_encoding(Arguments& arguments);
int measure_look(Arguments& arguments);
int make_raw(Arguments& arguments);
int measure_merge_budget(Arguments& arguments);
int measure_motion(Arguments& arguments);
int measure_noise_ratio(Arguments& arguments);
int measure_picture_noise(Arguments& arguments);
int measure_pixel_cost(Arguments& arguments);
int measure_planned_time(Arguments& arguments);
int measure_planner(Arguments& arguments);
int measure_raw_to_rgb(Arguments& arguments);
int measure_retarget(Arguments& arguments);
int measure_sampler(Arguments& arguments);
int measure_stage(Arguments& arguments);
int measure_stars(Arguments& arguments);
int measure_temporal(Arguments& arguments);
int measure_tile_margin(Arguments& arguments);
int measure_unpack(Arguments& arguments);

}  // namespace lowlux::test
