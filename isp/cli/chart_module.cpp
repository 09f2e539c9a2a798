#include "isp/cli/chart_module.h"

#include "isp/cli/module.h"

namespace lowlux::cli {

Result<calib::DetectCharts*> load_chart_detector() {
  const auto found = load_module({.file = "liblowlux_chart.so",
                                  .function = calib::detect_charts_name,
                                  .purpose = "finding charts",
                                  .needs = "OpenCV's mcc module (Debian: libopencv-contrib-dev)"});
  if (!found) return tl::make_unexpected(found.error());
  return reinterpret_cast<calib::DetectCharts*>(*found);
}

}  // namespace lowlux::cli
