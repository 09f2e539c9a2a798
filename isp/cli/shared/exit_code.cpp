#include "isp/cli/shared/exit_code.h"

#include <fmt/format.h>

#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/report.h"

namespace lowlux::cli {

int print_failure(const std::string& file, const Error& error, FailureJson json) {
  if (json == FailureJson::object) print_out(error_json(file, error) + "\n");
  if (json == FailureJson::array) print_out(fmt::format("[{}]\n", error_json(file, error)));
  print_err(error_line(file, error) + "\n");
  return exit_failed;
}

int print_failure(const Error& error, FailureJson json) { return print_failure(error.where, error, json); }

int print_usage_error(std::string_view verb, const Error& error, const Defaults& defaults) {
  const std::string text = (error.where.empty() ? "" : error.where + ": ") + error.message;
  const std::string place = default_place(defaults, text);
  print_err(one_line(fmt::format("lowlux {}: {}{}{}", verb, place, place.empty() ? "" : ": ", text)) + "\n");
  return exit_usage;
}

int print_argument_error(std::string_view verb, const Error& error, const Defaults& defaults, FailureJson json) {
  return error.code == ErrorCode::invalid_argument ? print_usage_error(verb, error, defaults)
                                                   : print_failure(error, json);
}

Error with_file(Error error, const std::string& file) {
  if (error.where.empty()) error.where = file;
  return error;
}

}  // namespace lowlux::cli
