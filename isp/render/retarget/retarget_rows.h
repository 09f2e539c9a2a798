#pragma once

#include <cstdint>

#include "isp/render/retarget/retarget_table.h"

namespace lowlux::isp {

/// Applies a table to one row of interleaved 16-bit codes R G B and writes codes of 8 or 16 bits: looked_up() in single
/// precision, rounded to the nearest code. The caller multiplies 8-bit codes by 257. Pixels do not depend on one
/// another, so a row may be passed in segments.
/// @param table  2 levels or more
/// @param rgb    3 width codes; may be `out` itself where that is of 16 bits
/// @param width  pixels; nothing is done if not positive
void apply(const RetargetTable& table, const std::uint16_t* rgb, int width, std::uint8_t* out);
void apply(const RetargetTable& table, const std::uint16_t* rgb, int width, std::uint16_t* out);

}  // namespace lowlux::isp
