#pragma once

#include "denoise/denoise_options.h"

namespace lowlux::reference {

/// Returns the noise ratio of the block at the centre of the square of 2 x 2 cells that holds a cell, mirrored beyond
/// the frame.
double ratio_at_cell(const denoise::RawElectronsView& raw, int cell_x, int cell_y);

/// Returns the mean over the pixels of one of tiles_x x tiles_y tiles of the noise ratio of their blocks.
double ratio_of_tile(const denoise::RawElectronsView& raw, int tile_x, int tile_y, int tiles_x, int tiles_y);

}  // namespace lowlux::reference
