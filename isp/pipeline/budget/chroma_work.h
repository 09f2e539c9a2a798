#pragma once

#include <array>

#include "denoise/denoiser.h"
#include "isp/base/frame.h"
#include "isp/pipeline/plan/levels.h"
#include "isp/raw/measure/thumbnail.h"

namespace lowlux::isp {

/// On which pyramid level the denoiser will start the chroma of a frame, as shares of it for levels 0, 1 and 2.
struct ChromaWork {
  std::array<double, 3> start{1, 0, 0};  // in tiles that start there
  std::array<double, 3> work{1, 0, 0};   // in tiles where chroma is worked on from there: around what starts finer, too
};

/// As denoise/spatial/chroma_start.h decides it, from the means of a thumbnail's blocks. Precondition:
/// levels.electrons_at_white.
/// @param noise  of the frame, its dark charge included
ChromaWork chroma_work(const RawFrame& frame, const RawLevels& levels, const denoise::RawNoise& noise,
                       const Thumbnail& thumbnail);

}  // namespace lowlux::isp
