#pragma once

#include <string_view>

#include "isp/base/frame.h"
#include "isp/pipeline/plan/dark_charge.h"

namespace lowlux::cli {

/// Returns "masked-pixels" and so on, the names in reports.
std::string_view name_of(BlackPoint::Source source);
std::string_view name_of(isp::DarkCharge::State state);

/// Returns "profile", "file" or "picture".
std::string_view name_of(NoiseProfile::Source source);

}  // namespace lowlux::cli
