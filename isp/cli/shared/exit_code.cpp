#include "isp/cli/shared/exit_code.h"

#include <algorithm>

#include <fmt/format.h>

#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/report.h"

namespace lowlux::cli {

FailureJson failure_json(std::string_view verb,
                         const std::function<bool(std::string_view flag, std::string_view value)>& has) {
  if (!has("--json", {}) || has("--output", "-")) return FailureJson::none;
  const bool has_array = verb == "develop" || verb == "denoise" || (verb == "info" && !has("--advise", {}));
  if (has_array) return FailureJson::array;
  return verb == "capture" && has("--live", {}) ? FailureJson::object_on_stderr : FailureJson::object;
}

FailureJson failure_json(std::string_view verb, const std::vector<std::string>& words) {
  const auto end = std::ranges::find(words, "--");
  return failure_json(verb, [&](std::string_view flag, std::string_view value) {
    if (value.empty()) return std::find(words.begin(), end, flag) != end;
    const std::string_view letter = flag.substr(1, 2);  // "-o" of "--output"
    for (auto word = words.begin(); word != end; ++word) {
      const bool is_next = word + 1 != end && word[1] == value && (*word == flag || *word == letter);
      const bool is_attached =
          *word == fmt::format("{}={}", flag, value) || *word == fmt::format("{}{}", letter, value);
      if (is_next || is_attached) return true;
    }
    return false;
  });
}

void print_failure_json(const std::string& file, const Error& error, FailureJson json) {
  if (json == FailureJson::object) print_out(error_json(file, error) + "\n");
  if (json == FailureJson::array) print_out(fmt::format("[{}]\n", error_json(file, error)));
  if (json == FailureJson::object_on_stderr) print_err(error_json(file, error) + "\n");
}

int print_failure(const std::string& file, const Error& error, FailureJson json) {
  print_failure_json(file, error, json);
  print_err(error_line(file, error) + "\n");
  return exit_failed;
}

int print_failure(const Error& error, FailureJson json) { return print_failure(error.where, error, json); }

int print_usage_error(std::string_view verb, const Error& error, FailureJson json, const Defaults& defaults) {
  print_failure_json({}, error, json);
  const std::string text = (error.where.empty() ? "" : error.where + ": ") + error.message;
  const std::string place = default_place(defaults, text);
  print_err(one_line(fmt::format("lowlux {}: {}{}{}", verb, place, place.empty() ? "" : ": ", text)) + "\n");
  return exit_usage;
}

int print_argument_error(std::string_view verb, const Error& error, const Defaults& defaults, FailureJson json) {
  return error.code == ErrorCode::invalid_argument ? print_usage_error(verb, error, json, defaults)
                                                   : print_failure(error, json);
}

Error with_file(Error error, const std::string& file) {
  if (error.where.empty()) error.where = file;
  return error;
}

}  // namespace lowlux::cli
