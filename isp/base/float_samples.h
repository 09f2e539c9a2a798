#pragma once

#include <optional>
#include <string>

#include "isp/base/frame.h"

namespace lowlux {

/// The greatest absolute value of a floating-point sample, in white levels: 24 EV above white, more than any merge of
/// exposures makes. Products and squares of such values in later steps stay finite.
inline constexpr float max_sample_whites = 16777216;

/// Returns what is wrong with the first floating-point sample that is NaN, infinite or greater than max_sample_whites
/// times white, and where it is; nullopt if there is none.
std::optional<std::string> unusable_sample(const RawDn& raw);

}  // namespace lowlux
