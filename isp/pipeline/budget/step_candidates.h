#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "isp/base/result.h"
#include "isp/pipeline/budget/chroma_work.h"
#include "isp/pipeline/budget/step_sizes.h"
#include "isp/pipeline/budget/visible_noise.h"
#include "isp/pipeline/options.h"

/// This header rates the ways to develop one frame by what each leaves and how long it takes, and chooses one.
namespace lowlux::isp {

/// States the fraction of the tolerance for the level of noise reduction: its prediction is an upper bound over the
/// tuning images, which others may exceed by a little.
constexpr double fraction_for_level = 0.9;

/// Holds the visible noise of a frame, and what levels leave of it: visible_percentile() over its blocks.
struct LevelNoise {
  double all = 0;
  std::array<double, denoise::all_levels.size()> left{};  // by each level, relative to Level::high
  double without_level = 0;                               // without any level, relative to Level::high

  double left_by(std::optional<denoise::Level> level) const {
    return level ? left[static_cast<std::size_t>(*level)] : without_level;
  }
};
LevelNoise level_noise(const std::vector<VisibilityBlock>& blocks);

/// Describes one way to develop the frame.
struct StepCandidate {
  std::optional<denoise::Level> level;
  bool lines = true;
  bool dark = true;
  bool display = true;
  DemosaicMethod max_demosaic = DemosaicMethod::residual_median;
  double left = 0;   // relative to everything that can be done; infinite where that is not known
  double error = 0;  // relative to the truth
  double seconds = 0;
};

/// Holds what the decisions about one frame rest on.
struct StepFacts {
  const ProcessingGoal& choice;
  StepSizes sizes;
  std::vector<VisibilityBlock> blocks;
  bool noise_by_ratio = false;  // a frame that is not a mosaic: its level follows from its signal-to-noise ratio
  int pixel_planes = 0;         // planes of a frame that is not a mosaic, 1 or 3; 0 for mosaics
  double checked_fraction = 1;  // fraction of a frame that is checked, if it is not a mosaic: see pixel_noise.h
  bool has_noise = false;       // the noise is known, and may be reduced
  LevelNoise noise;
  ChromaWork chroma;
  std::optional<denoise::Level> fixed_level;
  bool level_is_fixed = false;
  bool may_search = true;   // defects are searched for in the whole frame
  std::size_t defects = 0;  // number of repaired defects
  bool may_subtract_lines = true;
  bool from_codes = false;  // can be rendered from codes unless reduction, repair or dark charge prevents it
  /// States how the missing colours of the frame would be interpolated with and without noise reduction, given time;
  /// absent where none are missing.
  std::optional<DemosaicMethod> demosaic_reduced;
  std::optional<DemosaicMethod> demosaic_noisy;
  bool demosaic_is_fixed = false;
  bool look = false;
  bool display = false;
  SampleType samples = SampleType::u8;
  Rect active;
  CostSize size;
};

/// Sets left, error and seconds of a plan (0 seconds without a cost model).
void rate(const StepFacts& facts, StepCandidate& plan);

/// Chooses a candidate as ProcessingGoal states. Error: the budget is below the cheapest plan.
Result<StepCandidate> choose_step_candidate(const StepFacts& facts);

}  // namespace lowlux::isp
