#include "isp/cli/frame_text.h"

#include <cmath>

#include <fmt/format.h>

namespace lowlux::cli {
namespace {

constexpr double longest_fraction_s = 0.25001;

/// With so many decimals at most.
std::string rounded(double value, int decimals) {
  const double scale = std::pow(10, decimals);
  return fmt::format("{}", std::round(value * scale) / scale);
}

}  // namespace

std::string exposure_text(double exposure_s) {
  if (exposure_s > 0 && exposure_s < longest_fraction_s) return fmt::format("1/{:.0f} s", 1 / exposure_s);
  return rounded(exposure_s, 1) + " s";
}

std::string f_number_text(double f_number) { return "f/" + rounded(f_number, f_number < 1 ? 2 : 1); }

}  // namespace lowlux::cli
