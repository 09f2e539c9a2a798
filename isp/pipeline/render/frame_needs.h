#pragma once

#include <algorithm>

#include "isp/pipeline/plan.h"

/// What a plan asks of the frame as a whole.
namespace lowlux::isp {

inline bool bounds_noise(const DevelopPlan& plan) {
  return plan.look && plan.look->noise_limit && (plan.look->noise || plan.noise_reduction.has_level());
}

inline bool needs_grid(const DevelopPlan& plan) {
  const auto shows_effects = [](const LookPlan& look) {
    return std::ranges::any_of(look.effects, [](const LookEffect& effect) { return effect.used; });
  };
  return plan.look && (shows_effects(*plan.look) || bounds_noise(plan));
}

inline bool needs_table(const DevelopPlan& plan) { return plan.look && plan.look->table; }

inline bool keeps_maps(const DevelopPlan& plan) {
  return plan.noise_reduction.has_level() && (plan.options.denoise.maps || bounds_noise(plan));
}

}  // namespace lowlux::isp
