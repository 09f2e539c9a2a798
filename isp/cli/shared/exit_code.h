#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "isp/base/result.h"
#include "isp/cli/config/config_file.h"

/// Defines exit codes of the command, and the two ways in which a verb fails.
namespace lowlux::cli {

inline constexpr int exit_done = 0;
inline constexpr int exit_failed = 1;  // an input or the work failed
inline constexpr int exit_usage = 2;   // the command line is wrong

/// Lists what a failure prints on stdout in addition to its line on stderr: the form of the verb's --json.
enum class FailureJson : std::uint8_t { none, object, array };
constexpr FailureJson object_if(bool json) { return json ? FailureJson::object : FailureJson::none; }
constexpr FailureJson array_if(bool json) { return json ? FailureJson::array : FailureJson::none; }

/// Prints "lowlux: FILE: what is wrong". @return exit_failed
int print_failure(const std::string& file, const Error& error, FailureJson json = FailureJson::none);
/// Prints the failure of the file that the error itself names. @return exit_failed
int print_failure(const Error& error, FailureJson json = FailureJson::none);
/// Prints "lowlux VERB: OPTION: what is wrong"; the option is the error's place, if it has one. Where it is a default
/// of the user's file, FILE:LINE comes before it. @return exit_usage
int print_usage_error(std::string_view verb, const Error& error, const Defaults& defaults = {});
/// Prints a usage error if an argument is invalid, else the failure of the file or folder that it names.
int print_argument_error(std::string_view verb, const Error& error, const Defaults& defaults, FailureJson json);

/// Returns the error, with the file as its place if it has none.
Error with_file(Error error, const std::string& file);

}  // namespace lowlux::cli
