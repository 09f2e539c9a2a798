#pragma once

#include <algorithm>

#include "isp/pipeline/plan.h"

/// These functions return what a plan requires of the frame as a whole.
namespace lowlux::isp {

inline bool bounds_noise(const DevelopPlan& plan) {
  const std::optional<LookPlan>& look = plan.rendering.look;
  return look && look->noise_limit && (look->noise || plan.noise_reduction.has_level());
}

inline bool needs_table(const DevelopPlan& plan) { return plan.rendering.look && plan.rendering.look->table; }

/// Returns whether camera RGB is changed after demosaicing and before colour, as a whole.
inline bool finishes(const DevelopPlan& plan) {
  return plan.options.highlights == Highlights::reconstruct || plan.sharpen_px || plan.options.local_tone > 0;
}

/// Returns whether the noise of each part of the image is needed: to hold it to a limit, to sharpen above it, to lift
/// shadows no further than it allows, or by a model that weighs it.
inline bool needs_noise(const DevelopPlan& plan) {
  return bounds_noise(plan) || plan.sharpen_px || plan.local_tone_by_noise ||
         (needs_table(plan) && plan.rendering.look->table->by_noise);
}

inline bool needs_grid(const DevelopPlan& plan) {
  const std::optional<LookPlan>& look = plan.rendering.look;
  const auto shows_effects = [](const LookPlan& of) {
    return of.effects && std::ranges::any_of(*of.effects, [](const LookEffect& effect) { return effect.used; });
  };
  return look && (shows_effects(*look) || bounds_noise(plan));
}

inline bool needs_seeing_map(const DevelopPlan& plan) {
  const std::optional<LookPlan>& look = plan.rendering.look;
  return plan.options.look.seeing_map && look && look->kind == Look::eye;
}

inline bool keeps_maps(const DevelopPlan& plan) {
  return plan.noise_reduction.has_level() && (plan.options.denoise.maps || needs_noise(plan));
}

}  // namespace lowlux::isp
