#pragma once

#include <optional>
#include <span>
#include <string>

#include "calib/dark_site.h"
#include "calib/dark_stack.h"
#include "isp/base/dark_frame.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Whether a group is brighter on one side than on the other: by more than five standard errors, one frame's noise, and
/// a quarter of the charge above the pedestal where that is known. Error: it is; malformed.
Result<void> check_even_dark(const DarkGroup& group, const PerSite<DarkSite>& sites,
                             const std::optional<PerSite<double>>& pedestal_dn);

/// Whether the dark frame has the level of the picture's masked pixels. Error: it is off by more than two standard
/// deviations of a pixel and 0.1 % of the range. @return a warning if it is off by more than half of one
Result<std::optional<std::string>> check_masked_level(const RawDn& picture, const PerSite<double>& masked_dn,
                                                      const DarkFrame& dark);

/// Whether the picture is brighter than its dark frame. Error: more than 1 % of its pixels lie more than four standard
/// deviations below (3e-5 of a normal law do): subtraction would leave black dots.
Result<void> check_below_picture(const RawDn& picture, const DarkFrame& dark);

}  // namespace lowlux::calib
