#pragma once

#include <string>

#include "isp/base/result.h"
#include "isp/model/appearance/shin_table.h"

namespace lowlux::cli {

/// Coefficients of Shin's model from a file of at most 1 MB; see read_shin_table(). Errors name the file.
Result<isp::ShinTable> read_shin_file(const std::string& file);

}  // namespace lowlux::cli
