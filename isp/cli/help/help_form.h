#pragma once

#include <optional>
#include <string>
#include <vector>

#include "isp/cli/help/help_page.h"

namespace lowlux::cli {

/// Returns what the build makes files of, if that is the only argument of a verb: its name (--help-name), its manual
/// page (--help-man) or its part of a completion script (--help-bash, --help-zsh, --help-fish), and what `doctor`
/// checks the user's defaults by: the names of its options (--help-options); nullopt otherwise.
std::optional<std::string> help_in_form(const HelpPage& page, const std::string& argument);

/// Returns whether an argument asks for one of these forms.
bool is_help_form(const std::string& argument);

}  // namespace lowlux::cli
