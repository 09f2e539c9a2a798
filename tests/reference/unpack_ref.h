#pragma once

#include <cstddef>
#include <cstdint>

#include "isp/base/packed/raw_format.h"

namespace lowlux::reference {

/// Returns the code of column x of a row that begins at `row`, put together bit by bit from where the format has each:
/// what isp/base/packed/raw_format.h states, in plain arithmetic.
std::uint16_t unpacked_code(const RawFormat& format, const std::byte* row, int x);

}  // namespace lowlux::reference
