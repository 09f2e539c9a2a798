#pragma once

#include <span>
#include <string>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/pipeline/budget/visible_noise.h"
#include "isp/pipeline/options.h"
#include "isp/pipeline/plan/levels.h"
#include "isp/pipeline/plan/rendering.h"
#include "isp/raw/measure/thumbnail.h"

namespace lowlux::isp {

/// States what omitting each effect would change [CIEDE2000]: single pixels and lines by their own contrast, which
/// means over 8 x 8 pixels would hide, all else as visible_noise.h measures it. Not a number where that is not known.
struct StepSizes {
  double measured_fraction = 0;  // fraction of the frame that was searched for row and column noise
  double defects = 0;            // change by the strongest defect, in its pixel
  double lines = 0;              // change that 5 % of the places exceed, averaged along rows and columns
  std::string lines_text;
  double dark = 0;     // change by the mean dark charge, if it is known
  double display = 0;  // change for a display; NaN if the noise is not known
};

/// States what the predictions of step_sizes() are based on.
struct SizeRequest {
  const Rendering& rendering;
  const Thumbnail& light;  // dark charge subtracted
  /// States the noise of the frame, of its median block where it differs; null where it is not known.
  const denoise::RawNoise* noise = nullptr;
  std::span<const VisibilityBlock> blocks;  // blocks of the frame; none where the noise is not known
  /// Row and column noise is measured in the whole frame where there is no sample, because a plan may leave it in.
  bool lines_may_remain = false;
};

/// Predicts what omitting each effect would change.
/// @param levels  with all defects that are to be repaired
StepSizes step_sizes(const RawFrame& frame, const DevelopOptions& options, const RawLevels& levels,
                     const SizeRequest& request, Executor& executor);

}  // namespace lowlux::isp
