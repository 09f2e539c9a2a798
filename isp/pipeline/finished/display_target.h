#pragma once

#include <string>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/render/retarget/retarget.h"
#include "isp/render/retarget/retarget_table.h"

namespace lowlux::isp {

/// States the mean error [CIEDE2000] that a table of colours may have; a larger table is made where one has more.
inline constexpr double retarget_table_tolerance = 0.5;

/// Describes the display that images are made for: a change of sRGB codes, and what it is based on.
struct DisplayTarget {
  double source_cd_m2 = 0;   // white of the displays that the codes were made for
  double display_cd_m2 = 0;  // white of this display
  std::string coefficients;  // coefficients of Shin's model; empty: it is not used
  MeasuredTable made;
};

/// Tabulates a map as the smallest table within retarget_table_tolerance. Takes up to seconds.
MeasuredTable retarget_table(const RetargetMap& map, Executor& executor);

/// Tabulates retargeting(options). Takes up to seconds. Errors: those of retargeting().
Result<DisplayTarget> display_target(const RetargetOptions& options, Executor& executor);

}  // namespace lowlux::isp
