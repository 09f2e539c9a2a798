#include "isp/cli/shared/saturation_report.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace lowlux::cli {

std::string saturation_text(const isp::SaturationLevel& level) {
  return fmt::format("at {:.1f} +- {:.1f} DN, below the stated white: the pixels of several colours end there",
                     level.mean_dn, level.std_dn);
}

std::string saturation_json(const std::optional<isp::SaturationLevel>& level) {
  if (!level) return "null";
  return nlohmann::ordered_json{{"mean_dn", level->mean_dn}, {"std_dn", level->std_dn}}.dump();
}

}  // namespace lowlux::cli
