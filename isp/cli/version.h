#pragma once

#include <string>

namespace lowlux::cli {

/// "0.1.0".
std::string version_number();
/// The version, the raw decoder and the kernels' instruction set, one line each.
std::string version_text();

}  // namespace lowlux::cli
