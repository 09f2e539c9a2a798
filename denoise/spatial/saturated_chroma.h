#pragma once

#include "denoise/spatial/bands.h"
#include "denoise/spatial/frame_memory.h"

namespace lowlux::denoise {

/// Gives the cells of level 0 that hold saturated sites (FrameMemory::saturated) the chroma of what is around them, so
/// that they have none of their own to spread on any level: the mean of what is seen of 2x2, 4x4 ... cells, the
/// smallest of which something is, bilinear between them. What is not seen on the coarsest level is linear along its
/// rows, then from row to row; 0 where no cell is seen at all. Does nothing where none is saturated.
/// @param levels  of the frame at hand. PyramidLevel::value is overwritten.
void fill_saturated_chroma(const FrameMemory& memory, int levels, const Workers& workers);

}  // namespace lowlux::denoise
