#pragma once

#include <optional>

#include "isp/pipeline/budget/cost_model.h"
#include "isp/pipeline/merge/merged_raw.h"

/// This header predicts how long merging takes, and chooses the method by a budget.
namespace lowlux::isp {

/// Frames whose mean is compared with the others, of a camera at rest and of stars.
inline constexpr int sampled_frames = 5;

/// Frames in which the motion of the camera is measured, if there are as many without the reference.
inline constexpr int motion_frames = 2;

/// Returns whether a sub-pixel merge of `frames` frames predicts the reference anew once so many are averaged: at 8,
/// 16 ... 256 frames, where at least as many are still to come. Drops blur what a prediction lacks, such as detail that
/// noise hides in a single frame.
bool predicts_again(int averaged, int frames);

/// Returns whether such a merge predicts the reference anew after more than `averaged` frames.
bool will_predict_again(int averaged, int frames);

/// Describes the frames to merge, and what of the method is open to choice.
struct MergeWork {
  int frames = 1;
  CostSize size;
  std::optional<MergeAlignment> alignment;  // requested
  std::optional<bool> robust;               // requested
};

/// Returns the predicted time of merging by a method, without waiting for files: the costs of converting the frames,
/// comparing and placing them, of the reference and of the codes, each for its number of frames. Frames of different
/// exposure are predicted like those of equal exposure.
/// @param motion_measured  the camera's motion was measured on two frames before
double predicted_merge_s(const CostModel& cost, const MergeWork& work, const MergeMethod& method, bool motion_measured);

/// Returns whether measuring if the camera moved can lead to a better result within the budget: it is open, and the
/// time suffices for the measurement and then for an aligned mean and for the best mean without alignment.
bool measures_motion(const CostModel& cost, const MergeWork& work, double budget_s);

/// Chooses the method with the best predicted result among those that are predicted to fit; the cheapest if none does.
/// Results rank, from worst to best, as `bench --stage merge` measures the developed images of hand-held frames:
/// without alignment the plain and the robust mean; plain means of whole cells and sub-pixel; robust means of whole
/// cells and sub-pixel. Frames are aligned where the camera moved, or where alignment is requested.
/// @param moved  whether the camera moved; absent where that was not measured
MergePlan choose_merge_method(const CostModel& cost, const MergeWork& work, double budget_s, std::optional<bool> moved);

/// Returns the part of a budget that is reserved for developing the merged frame: the predicted time of planning and
/// rendering with Level::standard, at most half of the budget.
double developing_reserve_s(const CostModel& cost, const CostSize& size, double budget_s);

}  // namespace lowlux::isp
