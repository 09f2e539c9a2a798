#pragma once

#include <optional>
#include <string>

#include "isp/cli/args.h"

namespace CLI {
class App;
}

/// Options that verbs have in common which make pictures of raw frames.
namespace lowlux::cli {

/// Exposure, white balance, tone, space, half size.
void add_rendering(CLI::App& app, DevelopArgs& args);
/// What is known of the camera, and what is repaired by it.
void add_camera(CLI::App& app, DevelopArgs& args);
/// What is wrong with the options of add_camera together, or nothing.
std::optional<std::string> wrong_profiles(const DevelopArgs& args);
void add_denoise(CLI::App& app, DevelopArgs& args);
/// What picture files hold: bits, JPEG quality.
void add_samples(CLI::App& app, DevelopArgs& args);

}  // namespace lowlux::cli
