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

/// Figures of the active area's sites in the order of the sites of a crop of it.
PerSite<float> of_crop(const PerSite<double>& active, const Rect& crop);

/// White-balance gain of each site of a crop of the active area, divided by what one unit of the mosaic is worth.
PerSite<float> site_gains(const RawDn& raw, const DevelopPlan& plan, const PerSite<double>& units_at_white,
                          const Rect& crop);
/// The same of a mosaic in electrons, or in fractions of white where the plan knows no gain.
PerSite<float> site_gains(const RawDn& raw, const DevelopPlan& plan, const Rect& crop);

}  // namespace lowlux::isp
