#include "isp/cli/estimate_text.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace lowlux::cli {

EstimateCells cells_of(const Estimate& e) {
  if (!(e.standard_error > 0)) return {fmt::format("{:.5g}", e.value), ""};
  const int decimals = 1 - static_cast<int>(std::floor(std::log10(e.standard_error)));
  if (decimals < 0 || decimals > 9) return {fmt::format("{:.5g}", e.value), fmt::format("{:.2g}", e.standard_error)};
  return {fmt::format("{:.{}f}", e.value, decimals), fmt::format("{:.{}f}", e.standard_error, decimals)};
}

std::string text_of(const Estimate& e) {
  const EstimateCells cells = cells_of(e);
  return cells.standard_error.empty() ? cells.value : cells.value + " +- " + cells.standard_error;
}

}  // namespace lowlux::cli
