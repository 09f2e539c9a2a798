#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/budget/visible_noise.h"
#include "isp/pipeline/plan.h"
#include "isp/raw/measure/thumbnail.h"

namespace lowlux::isp {

/// Decides what a frame calls for, by its levels, its noise and a sample of it: sets plan.effects, and takes dark
/// charge and a display out of the plan where they are left out. Without a budget it leaves out what stays below the
/// tolerance, all of it together; with one it takes the most accurate of all plans that are predicted to fit, or the
/// cheapest of those within the tolerance, if one is given and one fits.
/// Needs plan.options.effects, and of the plan black, electrons at white, rendering. Error: the budget is below the
/// cheapest plan, whose time is told (insufficient).
Result<void> decide_effects(const RawFrame& frame, const Thumbnail& thumbnail, DevelopPlan& plan, Executor& executor);

/// What a level of noise reduction leaves of the visible noise, against Level::high, for blocks of this signal to noise
/// ratio in even surroundings: about the most that pictures showed, but for lamps in the dark; nullopt is no reduction.
/// tests/bench/planner_bench.cpp prints what was seen over it.
double left_of_noise(std::optional<denoise::Level> level, double snr);

/// Root mean square CIEDE2000 of that: left_of_noise() of the noise of the surroundings, which thresholds go by, and
/// without reduction what clipping at black makes of it.
float left_delta_e(std::optional<denoise::Level> level, const SeenBlock& block);

/// What is left of it against the truth, for telling which of two plans is better.
double error_share(std::optional<denoise::Level> level);

}  // namespace lowlux::isp
