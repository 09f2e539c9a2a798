#pragma once

#include <string_view>

#include "isp/base/frame.h"

namespace lowlux::cli {

/// "masked-pixels" and so on, as reports name them.
std::string_view name_of(BlackPoint::Source source);

/// "profile", "file", "picture".
std::string_view name_of(NoiseProfile::Source source);

}  // namespace lowlux::cli
