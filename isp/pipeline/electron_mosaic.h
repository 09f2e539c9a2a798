#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/pipeline/plan.h"

namespace lowlux::isp {

/// Takes black off the active area of a Bayer or monochrome frame: the plan's dark frame, or its black point.
void take_black_off(const RawDn& raw, const DevelopPlan& plan, PlaneView<float> out, Executor& executor);
/// The same of a part of it, its corner at an even column and row.
void take_black_off(const RawDn& raw, const DevelopPlan& plan, const Rect& part, PlaneView<float> out,
                    Executor& executor);

/// The active area of a Bayer frame in electrons as they were measured, dark charge in, defects repaired, signed.
/// Precondition: plan.electrons_at_white.
/// @param memory  reused where it has the size
RawElectrons raw_electrons(const RawFrame& frame, const DevelopPlan& plan, Plane<float> memory, Executor& executor);
/// The same of a part of it, its corner at an even column and row. Defects within two pixels of its border are repaired
/// by what is known of their neighbours.
void raw_electrons(const RawFrame& frame, const DevelopPlan& plan, const Rect& part, PlaneView<float> out,
                   Executor& executor);

}  // namespace lowlux::isp
