#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/options.h"
#include "isp/pipeline/plan/levels.h"
#include "isp/pipeline/plan/rendering.h"
#include "isp/raw/measure/thumbnail.h"

namespace lowlux::isp {

/// One thing that may be left out of developing, or done with less work.
struct PlannedEffect {
  std::string_view name;
  double size = 0;  // CIEDE2000 that leaving it out would change; not a number where that is not known
  double left = 0;  // that the decision leaves of it, against everything that can be done
  bool used = true;
  std::string decision;           // in words
  std::optional<double> seconds;  // it is predicted to take, or would; what every plan begins with is none of them
};

/// What was decided of them together.
struct EffectsPlan {
  std::vector<PlannedEffect> effects;
  std::optional<double> predicted_s;  // of planning and rendering
  bool find_defects = true;
  bool lines = true;  // row and column noise is subtracted with the noise
  bool dark = true;
  bool display = true;
  std::optional<denoise::Level> level;
  bool level_decided = false;           // false: noise is reduced as the options have it
  std::optional<NoiseRegions> regions;  // with levels of their own
};

/// Decides what a frame calls for, by its levels, its noise and a sample of it. Without a budget it leaves out what
/// stays below the tolerance, all of it together; with one it takes the most accurate of all plans that are predicted
/// to fit, or the cheapest of those within the tolerance, if one is given and one fits.
/// @param levels  before defects were looked for
/// Precondition: options.effects. Error: the budget is below the cheapest plan, whose time is stated (insufficient).
Result<EffectsPlan> decide_effects(const RawFrame& frame, const Thumbnail& thumbnail, const DevelopOptions& options,
                                   const RawLevels& levels, const Rendering& rendering, Executor& executor);

}  // namespace lowlux::isp
