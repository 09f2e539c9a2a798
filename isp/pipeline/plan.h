#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "isp/pipeline/budget/plan_effects.h"
#include "isp/pipeline/finished/display_target.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/options.h"
#include "isp/pipeline/plan/levels.h"
#include "isp/pipeline/plan/rendering.h"
#include "isp/pipeline/stage_clock.h"

namespace lowlux::isp {

/// Everything decided about one frame before a pixel is touched.
struct DevelopPlan {
  DevelopOptions options;              // what was asked for
  std::optional<EffectsPlan> effects;  // where DevelopOptions::effects asked for it
  RawLevels levels;
  Rendering rendering;
  NoiseReduction noise_reduction;
  std::shared_ptr<const DisplayTarget> display;  // set: codes are changed for it
  int width = 0;                                 // of the picture, before orientation
  int height = 0;
  bool from_codes = false;  // renders_from_codes
  std::vector<std::string> warnings;
  std::vector<StageTime> times;
};

}  // namespace lowlux::isp
