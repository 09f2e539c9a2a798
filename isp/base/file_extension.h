#pragma once

#include <algorithm>
#include <string_view>

#include "isp/base/text.h"

namespace lowlux {

/// Returns whether the name of a file ends with an extension, which is given in lower case and with its dot. The name
/// may have it in upper case, as in IMG_1.DNG.
constexpr bool has_extension(std::string_view name, std::string_view extension) {
  return name.size() >= extension.size() &&
         std::ranges::equal(name.substr(name.size() - extension.size()), extension, {}, ascii_lower);
}

}  // namespace lowlux
