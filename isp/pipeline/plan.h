#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "isp/pipeline/budget/step_plan.h"
#include "isp/pipeline/finished/display_target.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/options.h"
#include "isp/pipeline/plan/dark_charge.h"
#include "isp/pipeline/plan/framing.h"
#include "isp/pipeline/plan/levels.h"
#include "isp/pipeline/plan/plan_demosaic.h"
#include "isp/pipeline/plan/rendering.h"
#include "isp/pipeline/stage_clock.h"

namespace lowlux::isp {

/// Holds everything decided about one frame before a pixel is processed.
struct DevelopPlan {
  DevelopOptions options;           // options of the request
  std::optional<StepPlan> effects;  // set where DevelopOptions::effects requested it
  RawLevels levels;
  Rendering rendering;
  NoiseReduction noise_reduction;
  DemosaicPlan demosaic;
  std::shared_ptr<const DisplayTarget> display;  // set: codes are changed for it
  int width = 0;                                 // size of the rendered image, before framing and orientation
  int height = 0;
  std::optional<Framing> framing;    // set: a part of the image is kept, or it is shrunk
  std::optional<double> sharpen_px;  // set: sharpened for this blur; requested, and the noise is known
  bool local_tone_by_noise = false;  // local tone was requested, and the noise that limits it is known
  /// Fractions of white at which R, G and B saturate: result of saturated_from; where highlights are rebuilt, also of
  /// measure_saturation.
  std::array<double, 3> saturation{1, 1, 1};
  bool from_codes = false;  // result of renders_from_codes
  DarkCharge dark;
  std::vector<std::string> warnings;
  std::vector<StageTime> times;
};

}  // namespace lowlux::isp
