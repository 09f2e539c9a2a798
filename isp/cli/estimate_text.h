#pragma once

#include <string>

#include "isp/base/estimate.h"

namespace lowlux::cli {

/// "2047.30 +- 0.24": two digits of the standard error, and as many decimals of the value; without a standard error
/// five digits.
std::string text_of(const Estimate& estimate);

}  // namespace lowlux::cli
