#pragma once

#include <string_view>

namespace lowlux::isp {

/// The text of Chart.js (MIT licence, its banner included), compiled in from the file found at configuration.
std::string_view chart_js();

/// The text of report_page.js: draws the page's plots, moves its sliders.
std::string_view report_page_js();

/// The text of report_page.css.
std::string_view report_page_css();

}  // namespace lowlux::isp
