#pragma once

#include <array>

#include "denoise/denoiser.h"
#include "isp/base/frame.h"
#include "isp/pipeline/plan/levels.h"
#include "isp/pipeline/plan/pixel_noise.h"
#include "isp/raw/measure/thumbnail.h"

namespace lowlux::isp {

/// States on which pyramid level the denoiser will start the chroma of a frame, as fractions of the frame for levels 0,
/// 1 and 2.
struct ChromaWork {
  std::array<double, 3> start{1, 0, 0};  // in tiles that start on the level
  std::array<double, 3> work{1, 0, 0};   // in tiles whose chroma is processed from it on, near finer starts too
};

/// Predicts what denoise/spatial/chroma_start.h decides, from the means of a thumbnail's blocks. Precondition:
/// levels.electrons_at_white.
/// @param noise  noise of the frame, its dark charge included
ChromaWork chroma_work(const RawFrame& frame, const RawLevels& levels, const denoise::RawNoise& noise,
                       const Thumbnail& thumbnail);

/// Predicts the same of a frame that is not a mosaic, of which each pixel is a cell.
ChromaWork chroma_work(const RawFrame& frame, const CellNoise& cell, const Thumbnail& thumbnail);

}  // namespace lowlux::isp
