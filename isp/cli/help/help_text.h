#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isp/cli/help/help_page.h"

namespace lowlux::cli {

/// Returns the text with lines broken at blanks: at most `width` bytes unless a word is longer, all but the first
/// after `indent` blanks.
/// @param used  bytes that are on the first line already
std::string wrapped(std::string_view text, std::size_t indent, std::size_t used, std::size_t width = 80);

/// Returns what --help prints: usage, the options in front and the examples.
std::string short_help(const HelpPage& page);

/// Returns what --help-all prints: all options by section.
std::string full_help(const HelpPage& page);

/// Returns what the build makes files of, if that is the only argument of a verb: its name (--help-name), its manual
/// page (--help-man) or its part of a completion script (--help-bash, --help-zsh, --help-fish), and what `doctor`
/// checks the user's defaults by: the names of its options (--help-options); nullopt otherwise.
std::optional<std::string> help_in_form(const HelpPage& page, const std::string& argument);

/// Returns whether an argument asks for one of these forms.
bool is_help_form(const std::string& argument);

}  // namespace lowlux::cli
