#pragma once

#include "isp/base/frame.h"
#include "isp/pipeline/plan.h"

namespace lowlux::isp {

/// Figures of the active area's sites in the order of the sites of a crop of it.
PerSite<float> of_crop(const PerSite<double>& active, const Rect& crop);

/// White-balance gain of each site of a crop of the active area, divided by what one unit of the mosaic is worth.
PerSite<float> site_gains(const RawDn& raw, const DevelopPlan& plan, const PerSite<double>& units_at_white,
                          const Rect& crop);
/// The same of a mosaic in electrons, or in fractions of white where the plan knows no gain.
PerSite<float> site_gains(const RawDn& raw, const DevelopPlan& plan, const Rect& crop);

}  // namespace lowlux::isp
