#pragma once

#include <array>

#include "denoise/spatial/bands.h"
#include "denoise/spatial/chroma_start.h"
#include "denoise/spatial/frame_memory.h"

/// What happens between the finest planes and their denoised likes. Levels 0 .. levels - 1 of `memory`.
namespace lowlux::denoise {

struct PassFrame {
  FrameMemory& memory;
  const ChromaStarts& starts;
  int levels;
  Workers workers;
  std::array<double, most_levels> variance_scale{1, 1, 1, 1, 1};  // see DenoiseOptions
};

/// Coarser planes and variances from those of level 0.
void build_pyramid(const PassFrame& frame);

/// Pass 0: hard thresholds. Pass 1: Wiener gains from what pass 0 left. Fills value[pass] and `residual` of all levels;
/// each level's value is recomposed from the coarser ones.
/// @param step cells from one block to the next, 2 or 4
void run_pass(const PassFrame& frame, int pass, int step);

/// value[pass] of `level`, as its blocks or patches left it, on top of that of the next coarser level.
void recompose(const PassFrame& frame, int level, int pass);

/// Adds the residual variances of coarser levels to those of finer ones.
void add_residuals(const PassFrame& frame);

}  // namespace lowlux::denoise
