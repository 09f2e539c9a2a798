#include "isp/cli/help/suggestion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "isp/base/text.h"

namespace lowlux::cli {

std::string suggestion(std::string_view wanted, std::span<const std::string_view> known) {
  const auto near = near_matches(wanted, known);
  return near.empty() ? std::string() : fmt::format(" (did you mean {}?)", fmt::join(near, " or "));
}

}  // namespace lowlux::cli
