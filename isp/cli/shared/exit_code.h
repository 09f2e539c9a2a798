#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/result.h"
#include "isp/cli/config/config_file.h"

/// Defines exit codes of the command, and the two ways in which a verb fails.
namespace lowlux::cli {

inline constexpr int exit_done = 0;
inline constexpr int exit_failed = 1;  // an input or the work failed
inline constexpr int exit_usage = 2;   // the command line is wrong

/// Lists what a failure prints in addition to its line on stderr: the form of the verb's --json, on stdout, or on
/// stderr where stdout is a video.
enum class FailureJson : std::uint8_t { none, object, array, object_on_stderr };
constexpr FailureJson object_if(bool json) { return json ? FailureJson::object : FailureJson::none; }
constexpr FailureJson array_if(bool json) { return json ? FailureJson::array : FailureJson::none; }

/// Returns the form of a verb whose arguments could not be parsed, or that are wrong together: none without --json, and
/// none where standard output is the file (-o -).
/// @param has  whether a flag, or a flag and its value, are among the arguments
FailureJson failure_json(std::string_view verb,
                         const std::function<bool(std::string_view flag, std::string_view value)>& has);
/// Returns that of unparsed arguments.
FailureJson failure_json(std::string_view verb, const std::vector<std::string>& words);

/// Prints a failure as JSON, without its line.
void print_failure_json(const std::string& file, const Error& error, FailureJson json);
/// Prints "lowlux: FILE: what is wrong". @return exit_failed
int print_failure(const std::string& file, const Error& error, FailureJson json = FailureJson::none);
/// Prints the failure of the file that the error itself names. @return exit_failed
int print_failure(const Error& error, FailureJson json = FailureJson::none);
/// Prints "lowlux VERB: OPTION: what is wrong"; the option is the error's place, if it has one. Where it is a default
/// of the user's file, FILE:LINE comes before it. @return exit_usage
int print_usage_error(std::string_view verb, const Error& error, FailureJson json, const Defaults& defaults = {});
/// Prints a usage error if an argument is invalid, else the failure of the file or folder that it names.
int print_argument_error(std::string_view verb, const Error& error, const Defaults& defaults, FailureJson json);

/// Returns the error, with the file as its place if it has none.
Error with_file(Error error, const std::string& file);

}  // namespace lowlux::cli
