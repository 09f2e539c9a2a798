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

/// Describes one effect that may be left out of developing, or done with less work.
struct PlannedStep {
  std::string_view name;
  double size = 0;  // CIEDE2000 that omitting it would change; not a number where that is not known
  double left = 0;  // CIEDE2000 that the decision leaves of it, relative to everything; not a number if not known
  bool used = true;
  std::string decision;           // explanation
  std::optional<double> seconds;  // time it is predicted to take, or would; excludes the work common to all plans
};

/// Holds the decisions about all effects together.
struct StepPlan {
  std::vector<PlannedStep> effects;
  std::optional<double> predicted_s;  // for planning and rendering
  bool lines = true;                  // row and column noise is subtracted with the noise
  bool dark = true;
  bool display = true;
  DemosaicMethod max_demosaic = DemosaicMethod::residual_median;  // most expensive method that fits into the time
  std::optional<denoise::Level> level;
  bool level_decided = false;           // false: noise is reduced as the options state
  std::optional<NoiseRegions> regions;  // regions with levels of their own
};

/// Decides which effects a frame needs, from its levels, its noise and a sample of it. Without a budget it omits what
/// stays below the tolerance, all of it together; with one it chooses the most accurate of all plans that are predicted
/// to fit, or the cheapest of those within the tolerance, if one is given and one fits. Defects are not open to choice:
/// no sample shows that a frame has none, so every plan has the time of the search and of the repair.
/// @param light   the thumbnail, dark charge subtracted
/// @param levels  with all defects that are to be repaired
/// Precondition: options.effects. Error: the budget is below the cheapest plan, whose time is stated (insufficient).
Result<StepPlan> choose_steps(const RawFrame& frame, const Thumbnail& thumbnail, const Thumbnail& light,
                              const DevelopOptions& options, const RawLevels& levels, const Rendering& rendering,
                              Executor& executor);

}  // namespace lowlux::isp
