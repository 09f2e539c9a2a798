#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/result.h"
#include "isp/merge/motion.h"
#include "isp/pipeline/merge/merge_context.h"
#include "isp/pipeline/merge/merged_raw.h"

namespace lowlux::isp {

/// Holds how the frames of a merge are aligned and averaged.
struct MergeChoice {
  MergeMethod method;
  bool bracket = false;                  // the exposures of frames that were read differ
  std::map<int, merge::Motion> motions;  // motions that were measured for the choice, of frames of equal exposure
  std::optional<MergePlan> plan;         // set where there is a budget
  std::vector<std::string> warnings;
};

/// Chooses as the options state; what they leave open by the motion of two frames, the last, a middle and the first one
/// but the reference, and by the budget in the options of the reference (ProcessingGoal). Errors: those of reading
/// these frames.
Result<MergeChoice> choose_merge(MergeContext& work);

}  // namespace lowlux::isp
