#pragma once

#include "isp/pipeline/options.h"

namespace CLI {
class App;
}

namespace lowlux::cli {

/// Adds the options of `develop` that change tone and colour: --brightness, --contrast, --saturation.
void add_adjustments(CLI::App& app, isp::DevelopOptions& options);

/// Adds the options of `develop` that work on the demosaiced image: --highlights, --sharpen.
void add_finish(CLI::App& app, isp::DevelopOptions& options);

/// Adds the options of `develop` that choose a part of the image and its size: --crop, --max-size.
void add_framing(CLI::App& app, isp::DevelopOptions& options);

}  // namespace lowlux::cli
