#pragma once

#include <array>
#include <string>

#include "isp/base/estimate.h"

namespace lowlux::cli {

/// The pixels of the 2x2 cell, for a table.
inline constexpr std::array site_names = {"site 00", "site 01", "site 10", "site 11"};

/// The two numbers of an estimate, for a table.
struct EstimateCells {
  std::string value;
  std::string standard_error;  // empty if there is none
};

/// Two digits of the standard error, and as many decimals of the value; without a standard error five digits.
EstimateCells cells_of(const Estimate& estimate);

/// The same in one text: "2047.30 +- 0.24".
std::string text_of(const Estimate& estimate);

}  // namespace lowlux::cli
