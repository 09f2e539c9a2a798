#include "isp/cli/hull_module.h"

#include "isp/cli/module.h"

namespace lowlux::cli {

Result<isp::MeasureHulls*> load_hulls() {
  const auto found = load_module({.file = "liblowlux_hull.so",
                                  .function = isp::measure_hulls_name,
                                  .purpose = "the convex gamut ratio",
                                  .needs = "OpenCV's imgproc module (Debian: libopencv-imgproc-dev)"});
  if (!found) return tl::make_unexpected(found.error());
  return reinterpret_cast<isp::MeasureHulls*>(*found);
}

}  // namespace lowlux::cli
