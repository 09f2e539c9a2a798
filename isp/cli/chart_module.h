#pragma once

#include "calib/chart_detector.h"
#include "isp/base/result.h"

namespace lowlux::cli {

/// The chart detector, loaded from liblowlux_chart.so beside the command or in the installation's library folder, once;
/// it stays. Only who looks for a chart pays for OpenCV (calib/chart_detector.h).
/// Errors: unreadable, with what the loader says (OpenCV's mcc is not installed, the file is missing).
Result<calib::DetectCharts*> load_chart_detector();

}  // namespace lowlux::cli
