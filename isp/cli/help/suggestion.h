#pragma once

#include <span>
#include <string>
#include <string_view>

namespace lowlux::cli {

/// Returns " (did you mean --exposure?)" for a name that is similar to a known one, empty if none is.
std::string suggestion(std::string_view wanted, std::span<const std::string_view> known);

}  // namespace lowlux::cli
