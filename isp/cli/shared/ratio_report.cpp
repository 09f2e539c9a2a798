#include "isp/cli/shared/ratio_report.h"

#include <algorithm>

#include <fmt/format.h>

namespace lowlux::cli {

std::array<double, 3> ratio_range(const NoiseRatio& ratio) {
  const auto [least, most] = std::minmax_element(ratio.ratio.data(), ratio.ratio.data() + ratio.ratio.size());
  return {static_cast<double>(*least), median_ratio(&ratio), static_cast<double>(*most)};
}

std::string ratio_text(const NoiseRatio& ratio) {
  const auto [least, median, most] = ratio_range(ratio);
  return fmt::format("{:.3g} to {:.3g} times this variance in blocks of {} px, median {:.3g}", least, most,
                     ratio.block_px, median);
}

}  // namespace lowlux::cli
