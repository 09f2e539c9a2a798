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

/// Adds the options of `develop` that change tone and colour: --brightness, --contrast, --saturation.
void add_adjustments(CLI::App& app, isp::DevelopOptions& options);

/// Adds the options of `develop` that work on the demosaiced image: --highlights, --sharpen.
void add_finish(CLI::App& app, isp::DevelopOptions& options);

/// Adds the options of `develop` that choose a part of the image and its size: --crop, --max-size.
void add_framing(CLI::App& app, isp::DevelopOptions& options);

}  // namespace lowlux::cli
