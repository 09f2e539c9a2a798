#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/result.h"

namespace CLI {
class App;
}  // namespace CLI

/// Reads the user's defaults of options: lines "option = value" below a line "[verb]"; # begins a comment line.
namespace lowlux::cli {

/// Holds one line of the file.
struct ConfigLine {
  std::string verb;  // "develop", "calibrate black"
  std::string option;
  std::string value;
  int number = 0;
};

/// Holds defaults that are used in a run.
struct Defaults {
  struct Item {
    std::string flag;  // "--quality"
    std::string word;  // argument as it is parsed: "--quality=95"
    std::string line;  // "FILE:3"
  };
  std::string file;  // empty: no file was used
  std::vector<Item> items;
  bool sets(std::string_view flag) const;
};

/// Returns $XDG_CONFIG_HOME/lowlux/config, or ~/.config/lowlux/config; nullopt where neither variable is set.
std::optional<std::string> config_file();

/// Parses the text of a file. Errors, with FILE:LINE as their place: a line of another form, an unknown verb.
Result<std::vector<ConfigLine>> parse_config(std::string_view text, const std::string& file);

/// Reads the user's file; empty if there is none. Errors: it cannot be read; those of parse_config.
Result<std::vector<ConfigLine>> read_config(const std::string& file);

/// Returns the defaults of a verb that the arguments leave open: none with --no-config or help, nor for `doctor`, which
/// reports the file itself; none of an option that is given, that excludes a given one, or that needs one that is
/// neither given nor a default that is used.
/// @param left_out  flags whose defaults are not used
/// Errors, with FILE:LINE as their place: those of read_config; an option that the verb does not have.
Result<Defaults> find_defaults(const CLI::App& app, const std::vector<std::string>& words,
                               const std::set<std::string>& left_out = {});

/// Returns the flags of the defaults that the arguments exclude: each contradicts the arguments without the other
/// defaults. None if arguments and defaults do not contradict each other.
/// @param contradicts  whether the arguments and the defaults contradict each other, without those of these flags
std::set<std::string> excluded_defaults(const Defaults& defaults,
                                        const std::function<bool(const std::set<std::string>& left_out)>& contradicts);

/// Returns the place "FILE:LINE" of the default that an error is about, once the app was parsed, or by the defaults
/// that were used: the first whose option the text names. Empty: none is.
std::string default_place(const CLI::App& app, std::string_view text);
std::string default_place(const Defaults& defaults, std::string_view text);

/// Returns the defaults in one line: "--quality=95 --wb=auto (FILE)".
std::string defaults_text(const Defaults& defaults);

}  // namespace lowlux::cli
