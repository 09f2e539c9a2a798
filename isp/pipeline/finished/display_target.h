#pragma once

#include <string>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/render/retarget/retarget.h"
#include "isp/render/retarget/retarget_table.h"

namespace lowlux::isp {

/// Mean error [CIEDE2000] a table of colours may have; a larger table is made where one has more.
inline constexpr double retarget_table_tolerance = 0.5;

/// The display pictures are made for: a change of sRGB codes, and what it goes by.
struct DisplayTarget {
  double source_cd_m2 = 0;   // white of displays the codes were right for
  double display_cd_m2 = 0;  // white of this one
  std::string coefficients;  // of Shin's model; empty: it is not used
  MeasuredTable made;
};

/// A map as the smallest table within retarget_table_tolerance. Takes up to seconds.
MeasuredTable retarget_table(const RetargetMap& map, Executor& executor);

/// Tabulates retargeting(options). Takes up to seconds. Errors: those of retargeting().
Result<DisplayTarget> display_target(const RetargetOptions& options, Executor& executor);

}  // namespace lowlux::isp
