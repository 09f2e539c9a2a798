#pragma once

#include "tests/reference/denoise_ref_blocks.h"

namespace lowlux::reference::denoising {

/// Applies non-local Bayes to one level (denoise/README.md, step 8), in double and one group of patches at a time.
/// @param variance  of each cell, as the level's own noise has it
/// @param starts  level on which chroma starts in each tile
Shrunk nl_bayes(const Four& x, const Four& variance, const Four& pilot, int level, const Image& starts);

}  // namespace lowlux::reference::denoising
