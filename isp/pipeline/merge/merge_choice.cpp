#include "isp/pipeline/merge/merge_choice.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/merge/align/align.h"
#include "isp/pipeline/merge/merge_budget.h"
#include "isp/pipeline/merge/shading.h"

namespace lowlux::isp {
namespace {

constexpr double still_px = 0.5;  // largest displacement of a camera that stands still

bool has_moved(const merge::Motion& motion) {
  return motion.found && merge::median_shift_px(motion) > std::max(still_px, 5 * motion.standard_error_px);
}

/// Returns the frames in which the motion of the camera is measured: two, if the reference is one of several.
std::vector<int> measured_frames(const MergeContext& work) {
  std::vector<int> out;
  for (const int index : {work.count - 1, work.count / 2, 0}) {
    const bool is_new = index != work.out.reference && std::ranges::find(out, index) == out.end();
    if (is_new && out.size() < motion_frames) out.push_back(index);
  }
  return out;
}

/// Measures the motion of the camera.
Result<void> measure_motion(MergeContext& work, MergeChoice& choice) {
  const std::vector<int> order = measured_frames(work);
  Executor& executor = work.executor;
  const auto reference = with_unshaded(
      work.reference, executor, [&](const merge::FrameView& view) { return merge::AlignReference(view, executor); });
  work.loader.expect(order);
  bool is_known = false;
  for (const int index : order) {
    Result<FrameElectrons> frame = work.loader.next();
    if (!frame) return tl::make_unexpected(frame.error());
    const Result<double> light = work.stated_light();
    if (!light) return tl::make_unexpected(light.error());
    merge::Motion motion = with_unshaded(*frame, executor, [&](const merge::FrameView& view) {
      return merge::find_motion(reference, view, *light, {}, executor);
    });
    is_known = is_known || motion.found;
    if (has_moved(motion)) choice.method.alignment = MergeAlignment::subpixel;
    choice.motions.emplace(index, std::move(motion));
  }
  choice.bracket = work.loader.exposures_differ();
  if (choice.bracket) choice.motions.clear();
  if (choice.bracket && !is_known) {
    choice.warnings.push_back(fmt::format(
        "{} could not be aligned with {}, whose exposure differs: the frames are merged as those of a camera at rest; "
        "if it moved, leave that frame out or name another --reference, else give --align none",
        work.loader.last_name(), work.loader.reference_name()));
  }
  work.clock.lap("motion of the camera");
  return {};
}

/// Chooses the alignment.
Result<void> choose_alignment(MergeContext& work, MergeChoice& choice) {
  if (work.count == 1) return {};
  if (!work.options.alignment) return measure_motion(work, choice);
  choice.method.alignment = *work.options.alignment;
  return {};
}

}  // namespace

Result<MergeChoice> choose_merge(MergeContext& work) {
  MergeChoice choice;
  choice.method.robust = work.options.robust.value_or(true);
  const auto chosen = [&](Result<void> done) -> Result<MergeChoice> {
    if (!done) return tl::make_unexpected(done.error());
    return std::move(choice);
  };
  const std::optional<ProcessingGoal>& goal = work.loader.reference_options().effects;
  if (!goal || !goal->budget_s || !goal->cost) return chosen(choose_alignment(work, choice));
  const RawDn& raw = work.loader.reference().raw;
  const MergeWork amount{work.count, cost_size(raw.active.width, raw.active.height), work.options.alignment,
                         work.options.robust};
  double budget_s = *goal->budget_s;
  if (work.options.developed_after) budget_s -= developing_reserve_s(*goal->cost, cost_size(raw), budget_s);
  std::optional<bool> moved;
  if (measures_motion(*goal->cost, amount, budget_s)) {
    if (Result<void> measured = choose_alignment(work, choice); !measured) return chosen(measured);
    moved = choice.method.alignment != MergeAlignment::none;
  }
  choice.plan = choose_merge_method(*goal->cost, amount, budget_s, moved);
  choice.method = choice.plan->method;
  if (!choice.plan->fits) {
    choice.warnings.push_back(fmt::format(
        "merging is predicted to take at least {:.0f} ms, more than the budget of {:.3g} ms: the cheapest method was "
        "used",
        1e3 * choice.plan->predicted_s, 1e3 * budget_s));
  }
  return chosen({});
}

}  // namespace lowlux::isp
