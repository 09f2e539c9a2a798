#pragma once

#include <string_view>

namespace lowlux::isp {

/// The text of Chart.js (MIT licence, its banner included), compiled in from the file found at configuration.
std::string_view chart_js();

}  // namespace lowlux::isp
