#pragma once

#include <functional>
#include <optional>

namespace lowlux::isp {

/// Returns the peak memory that work takes in addition to the memory in use before [bytes]. The work runs in a child
/// process, whose largest resident set is read before and after, so that memory left by other work does not count. The
/// child has the calling thread alone, and ends with the work. Returns nullopt if it could not be started, or failed.
std::optional<double> peak_bytes_of(const std::function<bool()>& work);

/// Returns the physical memory of the machine [bytes].
double physical_bytes();

}  // namespace lowlux::isp
