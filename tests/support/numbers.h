#pragma once

#include <limits>

namespace lowlux::test {

/// What no measurement gives, as bad input.
inline constexpr double inf = std::numeric_limits<double>::infinity();
inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();

}  // namespace lowlux::test
