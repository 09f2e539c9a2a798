#pragma once

/// The kernels under make_luma_pyramid, with plain types only: their source is compiled for several instruction sets.
namespace lowlux::merge::rows {

/// Writes `count` means of 2x2 cells of a mosaic, as make_luma_pyramid describes them, and returns whether all exist.
/// @param greens_on_diagonal  whether the first cell of `upper` is green
bool mean_cells(const float* upper, const float* lower, bool greens_on_diagonal, int count, float* out);

/// Writes `count` means of those of 2x2 values that are not NaN; NaN where fewer than two are.
void halve_row(const float* upper, const float* lower, int count, float* out);

}  // namespace lowlux::merge::rows
