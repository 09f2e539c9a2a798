#pragma once

#include "isp/base/result.h"
#include "isp/bench/gamut_hull.h"

namespace lowlux::cli {

/// OpenCV's convex hulls, loaded from liblowlux_hull.so; see module.h. Who needs no gamut ratio need not have OpenCV.
/// Errors: unreadable, as load_module().
Result<isp::MeasureHulls*> load_hulls();

}  // namespace lowlux::cli
