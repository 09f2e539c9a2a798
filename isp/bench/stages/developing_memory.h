#pragma once

#include <functional>
#include <optional>

namespace lowlux::isp {

/// The most memory that work takes beyond what is there before [bytes]: it is done in a child process, whose largest
/// resident set is asked for before and after, so that nothing is counted that other work left behind. The child has
/// the calling thread alone, and ends with the work. nullopt: no child could be made, or it failed.
std::optional<double> peak_bytes_of(const std::function<bool()>& work);

/// Of the machine [bytes].
double physical_bytes();

}  // namespace lowlux::isp
