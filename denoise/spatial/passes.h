#pragma once

#include <array>

#include "denoise/spatial/bands.h"
#include "denoise/spatial/chroma_start.h"
#include "denoise/spatial/frame_memory.h"

/// The filter passes between the finest noisy planes and the denoised ones. They use levels 0 .. levels - 1 of
/// `memory`.
namespace lowlux::denoise {

struct PassFrame {
  FrameMemory& memory;
  const ChromaStarts& starts;
  int levels;
  Workers workers;
  std::array<double, max_levels> variance_scale{1, 1, 1, 1, 1};  // see DenoiseOptions
};

/// Computes the coarser planes and variances from those of level 0.
void build_pyramid(const PassFrame& frame);

/// Runs pass 0 with hard thresholds, or pass 1 with Wiener gains from the result of pass 0. Fills value[pass] and
/// `residual` of all levels; each level's value is recomposed from the coarser ones.
/// @param rows_apart cells from one row of blocks to the next, 2 or 4; in a row, blocks are 2 cells apart
void run_pass(const PassFrame& frame, int pass, int rows_apart);

/// Adds value[pass] of `level`, the result of its blocks or patches, to that of the next coarser level.
void recompose(const PassFrame& frame, int level, int pass);

/// Adds the residual variances of coarser levels to those of finer ones.
void add_residuals(const PassFrame& frame);

}  // namespace lowlux::denoise
