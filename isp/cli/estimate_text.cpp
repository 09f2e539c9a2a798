#include "isp/cli/estimate_text.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace lowlux::cli {

std::string text_of(const Estimate& e) {
  if (!(e.standard_error > 0)) return fmt::format("{:.5g}", e.value);
  const int decimals = 1 - static_cast<int>(std::floor(std::log10(e.standard_error)));
  if (decimals < 0 || decimals > 9) return fmt::format("{:.5g} +- {:.2g}", e.value, e.standard_error);
  return fmt::format("{:.{}f} +- {:.{}f}", e.value, decimals, e.standard_error, decimals);
}

}  // namespace lowlux::cli
