#pragma once

#include <cstdint>

/// The row kernel under apply_colour_table, dispatched at run time. Plain types only: its source is compiled for
/// several instruction sets, and shared inline code must not be.
namespace lowlux::isp::table_rows {

/// What the kernel needs of a ColourTable, which explains it.
struct Table {
  float luminance[3];
  float grey[3];
  float margin;
  float nodes_per_share;  // nodes between shares of 0 and 1
  std::int32_t cells;     // in either direction
  std::int32_t levels;
  std::int32_t first_level_bits;  // of the float
  float levels_per_bit;
  const float* node;
};

/// One row of planar R, G, B; `out` may be `in`.
void convert_row(const float* const (&in)[3], int width, const Table& table, float* const (&out)[3]);

/// Name of the instruction set in use.
const char* target_name();

}  // namespace lowlux::isp::table_rows
