#pragma once

#include "denoise/spatial/bands.h"
#include "denoise/spatial/frame_memory.h"

namespace lowlux::denoise {

/// Gives the cells of level 0 that hold saturated sites (FrameMemory::saturated) the chroma of their surroundings, so
/// that they spread no chroma of their own on any level: the mean of the valid cells in the smallest of the 2x2, 4x4
/// ... cells that holds one, bilinear between them. Cells without a valid cell on the coarsest level are interpolated
/// linearly along its rows, then from row to row; 0 where no cell is valid at all. Does nothing if no cell is
/// saturated.
/// @param levels  number of levels of the current frame. PyramidLevel::value is overwritten.
void fill_saturated_chroma(const FrameMemory& memory, int levels, const Workers& workers);

}  // namespace lowlux::denoise
