#pragma once

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/render/retarget/retarget.h"
#include "isp/render/retarget/retarget_table.h"

namespace lowlux::isp {

/// A picture for another display.
struct RetargetedPicture {
  Picture picture;        // sRGB codes, or floats of linear sRGB
  int levels = 0;         // of the table, along each axis
  TableError error;       // of the table
  double share_held = 0;  // of up to 4096 pixels spread evenly: the display does not show what would look the same
};

/// The same pixels under another map of colours, by way of 16-bit sRGB codes and a table.
/// @param xyz      display-linear, D65 white at Y = 1; what sRGB does not hold moves towards the neutral first
/// @param samples  u8 and u16: sRGB codes; f32: linear sRGB
/// Errors: those of retargeting().
Result<RetargetedPicture> retarget_picture(const SceneLinear& xyz, const RetargetOptions& options, SampleType samples,
                                           Executor& executor);

}  // namespace lowlux::isp
