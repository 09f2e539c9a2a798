#include "isp/pipeline/merge/merge_budget.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <functional>
#include <vector>

namespace lowlux::isp {
namespace {

constexpr int first_mean = 8;              // frames, of which the reference is predicted first
constexpr int last_mean = 256;             // merge::ColourMean holds no more frames
constexpr double colour_fraction = 0.4;    // of the time of placing a frame: adding it to the mean of all colours
constexpr double colour_prediction = 4.5;  // times the first prediction: developing all colours at every pixel

/// Returns of how many of the frames the reference is predicted last, at most.
int last_of(int frames) { return std::min(frames / 2, last_mean); }

bool is_static(MergeAlignment alignment) { return alignment == MergeAlignment::none; }

int rank_of(const MergeMethod& method) {
  if (is_static(method.alignment)) return method.robust ? 1 : 0;
  return 2 + (method.robust ? 2 : 0) + (method.alignment == MergeAlignment::cells ? 0 : 1);
}

/// Returns the methods that are open to choice, from best to worst.
std::vector<MergeMethod> open_methods(const MergeWork& work, bool moved) {
  std::vector<MergeAlignment> alignments{MergeAlignment::none};
  if (work.alignment) {
    alignments = {*work.alignment};
  } else if (moved) {
    alignments = {MergeAlignment::subpixel, MergeAlignment::cells, MergeAlignment::none};
  }
  std::vector<MergeMethod> out;
  for (const MergeAlignment alignment : alignments) {
    for (const bool robust : {true, false}) {
      if (work.robust.value_or(robust) == robust) out.push_back({alignment, robust});
    }
  }
  std::ranges::sort(out, std::ranges::greater{}, rank_of);
  return out;
}

/// Returns how many times a sub-pixel merge predicts the reference from a mean.
int predictions_of_mean(int frames) {
  int out = 0;
  for (int averaged = 2; averaged < frames; ++averaged) out += predicts_again(averaged, frames) ? 1 : 0;
  return out;
}

/// Returns how many frames are added to the mean of all colours from which it does.
int frames_of_colours(int frames) {
  int out = 0;
  while (will_predict_again(out + 1, frames)) ++out;
  return out;
}

/// Returns the time of the robust mean of so many frames over that of sampled_frames. Most of it is the comparison with
/// the reference frame, which takes as long for any number.
double robust_fraction(int frames) {
  constexpr double compared = 3;  // frames whose mean takes as long as the comparison
  return (compared + frames) / (compared + sampled_frames);
}

bool motion_is_open(const MergeWork& work) { return !work.alignment && work.frames > 1; }

/// States the cheapest of the methods that are better than the chosen one.
void state_better(const CostModel& cost, const MergeWork& work, const std::vector<MergeMethod>& methods,
                  MergePlan& plan) {
  for (const MergeMethod& method : methods) {
    if (rank_of(method) <= rank_of(plan.method)) break;
    const double seconds = predicted_merge_s(cost, work, method, plan.motion_measured);
    if (plan.better && seconds >= plan.better_s) continue;
    plan.better = method;
    plan.better_s = seconds;
  }
}

}  // namespace

bool predicts_again(int averaged, int frames) {
  return averaged >= first_mean && std::has_single_bit(static_cast<unsigned>(averaged)) && averaged <= last_of(frames);
}

bool will_predict_again(int averaged, int frames) {
  return std::bit_floor(static_cast<unsigned>(last_of(frames))) >
         static_cast<unsigned>(std::max(averaged, first_mean - 1));
}

double predicted_merge_s(const CostModel& cost, const MergeWork& work, const MergeMethod& method,
                         bool motion_measured) {
  const int n = work.frames;
  const int sampled = std::min(n, sampled_frames);
  const bool compares = method.robust && n > 1;
  std::vector<CostTerm> parts{{CostPart::merge_codes}};
  const auto add = [&](CostPart part, double times) { parts.push_back({part, times}); };
  const int measured = motion_measured ? std::min(motion_frames, n - 1) : 0;
  if (is_static(method.alignment)) {
    add(CostPart::merge_alignment, measured);
    add(CostPart::merge_frame, 1 + n + measured + (compares ? sampled - 1 : 0));
    add(CostPart::merge_mean, n);
    if (compares) add(CostPart::merge_robust, robust_fraction(sampled));
    if (compares) add(CostPart::merge_comparison, n);
    return predicted_s(cost, work.size, parts);
  }
  add(CostPart::merge_frame, n + measured);
  add(CostPart::merge_mean, 1);
  add(CostPart::merge_alignment, n - 1);
  if (compares) add(CostPart::merge_comparison, n - 1);
  const bool cells = method.alignment == MergeAlignment::cells;
  if (cells) {
    add(CostPart::merge_cells, n - 1);
  } else {
    add(CostPart::merge_subpixel, n - 1 + colour_fraction * frames_of_colours(n));
    add(CostPart::merge_prediction, 1 + colour_prediction * predictions_of_mean(n));
  }
  return predicted_s(cost, work.size, parts);
}

bool measures_motion(const CostModel& cost, const MergeWork& work, double budget_s) {
  if (!motion_is_open(work)) return false;
  bool aligned_fits = false;
  for (const MergeMethod& method : open_methods(work, true)) {
    const bool fits = predicted_merge_s(cost, work, method, true) <= budget_s;
    if (is_static(method.alignment)) return fits && aligned_fits;  // the best of them
    aligned_fits |= fits;
  }
  return false;
}

MergePlan choose_merge_method(const CostModel& cost, const MergeWork& work, double budget_s,
                              std::optional<bool> moved) {
  const std::vector<MergeMethod> methods = open_methods(work, moved.value_or(false));
  assert(!methods.empty());
  MergePlan out{.budget_s = budget_s, .motion_measured = moved.has_value(), .fits = false};
  bool first = true;
  for (const MergeMethod& method : methods) {
    const double seconds = predicted_merge_s(cost, work, method, moved.has_value());
    const bool fits = seconds <= budget_s;
    if (fits || first || seconds < out.predicted_s) {
      out.method = method;
      out.predicted_s = seconds;
      out.fits = fits;
    }
    first = false;
    if (fits) break;
  }
  state_better(cost, work, methods, out);
  return out;
}

double developing_reserve_s(const CostModel& cost, const CostSize& size, double budget_s) {
  const double developing_s = predicted_s(
      cost, size,
      {{CostPart::planning}, {CostPart::lines}, {CostPart::check}, {CostPart::floats}, {CostPart::standard_0}});
  return std::min(developing_s, budget_s / 2);
}

}  // namespace lowlux::isp
