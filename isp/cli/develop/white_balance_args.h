#pragma once

#include <optional>
#include <string>

#include "isp/pipeline/options.h"

namespace CLI {
class App;
}

namespace lowlux::cli {

/// Adds --wb.
void add_white_balance(CLI::App& app, isp::WhiteBalanceChoice& choice);

/// Reads the text of --wb. Returns the error, or nothing.
std::optional<std::string> set_white_balance(const std::string& text, isp::WhiteBalanceChoice& choice);

}  // namespace lowlux::cli
