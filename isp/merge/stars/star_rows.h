#pragma once

#include <cstdint>

/// Row kernels of the search for stars, dispatched at run time. They use plain types only: their source is compiled for
/// several instruction sets, and shared inline code must not be.
namespace lowlux::merge::rows {

/// Number of values that may be read and written before and after a row of scores; filters reach less far.
inline constexpr int row_padding = 32;

/// Input for one row of scores, (signal - level) / standard deviation. Level and 1 / standard deviation are linear
/// between nodes, one line for even and one for odd columns. Beyond the outer nodes the level continues, and the
/// standard deviation stays.
struct ScoreRow {
  const float* signal_e;
  int width;
  int nodes;
  const std::int32_t* node_px;  // even, rising
  const float* level_e[2];      // at the nodes, of even and odd columns
  const float* per_std[2];
  float* score;  // with padding; 0 where the signal is missing, and in the padding
};

/// Writes one row of scores. Returns whether any signal is missing (NaN).
bool score_row(const ScoreRow& in);

/// Input for one row of the filter: rows[0 .. 2 radius] of scores around it, with padding.
struct FilterRow {
  const float* const* rows;
  int radius;         // below row_padding - 16
  const float* taps;  // radius + 1, from the centre outward
  int width;
  float* vertical;  // scratch, with padding, which is 0
  float* out;       // with padding after the row
};
void filter_row(const FilterRow& in);

/// Writes the columns whose value is above the limit, and returns their number.
int bright_columns(const float* row, int width, float limit, std::int32_t* columns);

}  // namespace lowlux::merge::rows
