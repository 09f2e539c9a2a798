#pragma once

#include <array>
#include <optional>
#include <vector>

#include "isp/base/result.h"
#include "isp/pipeline/budget/chroma_work.h"
#include "isp/pipeline/budget/effect_sizes.h"
#include "isp/pipeline/budget/visible_noise.h"
#include "isp/pipeline/options.h"

/// The ways to develop one frame, what each leaves and takes, and which is chosen.
namespace lowlux::isp {

/// Of the tolerance, for the level of noise reduction: what is predicted of it is a bound of what was seen on the
/// pictures it was tuned on, and others may exceed it by a little.
constexpr double share_for_level = 0.9;

/// What is seen of the noise of a frame, and what levels leave of it: seen_percentile() over its blocks.
struct LevelNoise {
  double all = 0;
  std::array<double, denoise::all_levels.size()> left{};  // by each level, against Level::high
  double without_level = 0;                               // the same without any

  double left_by(std::optional<denoise::Level> level) const {
    return level ? left[static_cast<std::size_t>(*level)] : without_level;
  }
};
LevelNoise level_noise(const std::vector<SeenBlock>& blocks);

/// One way to develop the frame.
struct EffectCandidate {
  std::optional<denoise::Level> level;
  bool defects = true;
  bool lines = true;
  bool dark = true;
  bool display = true;
  double left = 0;   // against everything that can be done
  double error = 0;  // against the truth
  double seconds = 0;
};

/// What decisions rest on, of one frame.
struct EffectFacts {
  const EffectsChoice& choice;
  EffectSizes sizes;
  std::vector<SeenBlock> blocks;
  bool has_noise = false;  // it is known, and may be reduced
  LevelNoise noise;
  ChromaWork chroma;
  std::optional<denoise::Level> fixed_level;
  bool level_is_fixed = false;
  bool may_search = true;
  bool may_take_lines = true;
  bool from_codes = false;  // without reduction, repair and dark nothing keeps the frame from it
  bool look = false;
  bool display = false;
  SampleType samples = SampleType::u8;
  Rect active;
  CostSize size;
};

/// Sets left, error and seconds (0 without a cost model).
void rate(const EffectFacts& facts, EffectCandidate& plan);

/// As EffectsChoice asks. Error: the budget is below the cheapest plan.
Result<EffectCandidate> choose_candidate(const EffectFacts& facts);

}  // namespace lowlux::isp
