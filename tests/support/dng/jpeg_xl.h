#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "isp/base/plane.h"

namespace lowlux::test {

/// Encodes codes of `bits` bits, `samples` a pixel, as a JPEG XL.
/// @param distance  0: without loss; else that of libjxl, in XYB of linear light
std::vector<std::byte> jpeg_xl_of(const Plane<std::uint16_t>& codes, int samples, int bits, float distance = 0);

}  // namespace lowlux::test
