#pragma once

#include <span>

#include "isp/base/noise_ratio.h"

/// Noise that differs from place to place, in the shapes in which the denoiser needs it.
namespace lowlux::denoise {

/// Computes the ratio at the centres of one row of squares of 2 x 2 cells; beyond the frame, of the mirrored cells.
/// @param columns, rows  cells of the frame
/// @param out            one value for each square of the row
void ratio_of_squares(const NoiseRatioView& ratio, int columns, int rows, int square_row, std::span<float> out);

/// Computes the mean ratio of windows of 2 x 2 sites at (0, y), (1, y) ...
void ratio_of_windows(const NoiseRatioView& ratio, int y, std::span<float> out);

/// Returns whether windows at rows y and other_y have the same ratios.
bool same_blocks(const NoiseRatioView& ratio, int y, int other_y);

}  // namespace lowlux::denoise
