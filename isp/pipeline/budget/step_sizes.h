#pragma once

#include <span>
#include <string>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/pipeline/budget/visible_noise.h"
#include "isp/pipeline/options.h"
#include "isp/pipeline/plan/levels.h"
#include "isp/raw/measure/thumbnail.h"
#include "isp/raw/repair.h"

namespace lowlux::isp {

/// States what omitting each effect would change: CIEDE2000 as visible_noise.h measures it. Not a number where that is
/// not known, because the frame is too small, or too uneven, for a sample to save anything.
struct StepSizes {
  double sampled_fraction = 0;  // fraction of the frame
  double defects = 0;           // of the 8 x 8 pixels around the strongest defect of the sample
  bool has_defects = false;
  std::string defects_words;
  double lines = 0;  // of row and column noise
  std::string lines_words;
  double dark = 0;     // of the mean dark charge that is known
  double display = 0;  // of the change for a display; not a number where the noise is not known
};

/// Predicts what omitting each effect would change.
/// @param noise   of the frame; null where it is not known
/// @param blocks  of the frame; none where the noise is not known
StepSizes step_sizes(const RawFrame& frame, const DevelopOptions& options, const RawLevels& levels,
                     const Thumbnail& thumbnail, const denoise::RawNoise* noise, std::span<const SeenBlock> blocks,
                     Executor& executor);

/// Returns the noise that the search for defects is based on.
DefectNoise defect_noise(const RawFrame& frame, const BlackPoint& black, const Thumbnail& thumbnail);

}  // namespace lowlux::isp
