#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "isp/cli/help/help_page.h"

/// Writes scripts of shells that complete command lines: a beginning, what each verb adds, and an end.
namespace lowlux::cli {

enum class Shell { bash, zsh, fish };

/// Returns the shell of that name; nullopt for any other.
std::optional<Shell> shell_named(std::string_view name);

std::string completion_begin(Shell shell);
std::string completion_of(const HelpPage& page, Shell shell);
std::string completion_end(Shell shell);

}  // namespace lowlux::cli
