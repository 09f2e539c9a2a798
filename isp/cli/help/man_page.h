#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "isp/cli/help/help_page.h"

namespace lowlux::cli {

/// Returns the manual page of a verb for section 1, in the man macros of roff.
std::string man_page(const HelpPage& page);

/// Returns the manual page of the command: lowlux(1).
/// @param verbs  name and summary of each
std::string command_man_page(std::span<const std::pair<std::string_view, std::string_view>> verbs);

}  // namespace lowlux::cli
