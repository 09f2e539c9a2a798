#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "isp/cli/help/help_page.h"

/// Makes the files of the help that are installed: manual pages, and scripts of shells that complete command lines.
namespace lowlux::cli {

/// Returns the manual page of a verb for section 1, in the man macros of roff.
std::string man_page(const HelpPage& page);

/// Returns the manual page of the command: lowlux(1).
/// @param verbs  name and summary of each
std::string command_man_page(std::span<const std::pair<std::string_view, std::string_view>> verbs);

enum class Shell { bash, zsh, fish };

/// Returns the shell of that name; nullopt for any other.
std::optional<Shell> shell_named(std::string_view name);

/// These functions return the parts of a completion script: a beginning, what each verb adds, and an end.
std::string completion_begin(Shell shell);
std::string completion_of(const HelpPage& page, Shell shell);
std::string completion_end(Shell shell);

}  // namespace lowlux::cli
