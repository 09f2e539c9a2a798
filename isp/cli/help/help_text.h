#pragma once

#include <string>
#include <string_view>

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

}  // namespace lowlux::cli
