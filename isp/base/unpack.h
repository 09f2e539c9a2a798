#pragma once

#include <cstddef>
#include <cstdint>

#include "isp/base/raw_format.h"

namespace lowlux {

/// One row of a camera's buffer as 16-bit codes. Reads row_bytes(format, width) bytes at `in`, each once and in rising
/// order, none beyond; writes `width` codes at `out`, none beyond. Codes above 2^bits - 1 in 16-bit samples are kept.
/// No alignment is asked of `in`. Nothing is allocated. The format is one of raw_formats(); of a width below 1 nothing
/// is touched.
void unpack_row(const RawFormat& format, const std::byte* in, int width, std::uint16_t* out);

/// The vector instruction set unpack_row uses on this machine, as Highway names it.
const char* unpack_target();

}  // namespace lowlux
