#pragma once

#include <cstdint>

/// The row kernel of apply_colour_table is dispatched at run time. It takes plain types only: its source is compiled
/// for several instruction sets, which must not have inline code in common.
namespace lowlux::isp::table_rows {

/// Holds the data of a ColourTable, documented there, that the kernel needs.
struct Table {
  float luminance[3];
  float grey[3];
  float margin;
  float nodes_per_fraction;  // nodes between fractions of 0 and 1
  std::int32_t cells;        // in either direction
  std::int32_t levels;
  std::int32_t first_level_bits;  // bit pattern of the float
  float levels_per_bit;
  const float* node;
};

/// Converts one row of planar R, G, B; `out` may be `in`.
/// @param level_value  what the levels of the table stand for, if it is not the sum of R, G and B: a value above 0 for
///                     each pixel; else null
void convert_row(const float* const (&in)[3], const float* level_value, int width, const Table& table,
                 float* const (&out)[3]);

/// Returns the name of the instruction set in use.
const char* target_name();

}  // namespace lowlux::isp::table_rows
