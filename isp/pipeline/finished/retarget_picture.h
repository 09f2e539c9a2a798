#pragma once

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/render/retarget/retarget.h"
#include "isp/render/retarget/retarget_table.h"

namespace lowlux::isp {

/// Holds an image for another display.
struct RetargetedPicture {
  Picture picture;                    // sRGB codes, or floats of linear sRGB
  int levels = 0;                     // levels of the table, along each axis
  TableError error;                   // error of the table
  double fraction_outside_gamut = 0;  // fraction of up to 4096 evenly spread pixels whose match the display cannot show
};

/// Maps an image through another map of colours, by way of 16-bit sRGB codes and a table.
/// @param xyz      display-linear, D65 white at Y = 1; colours outside sRGB move towards the neutral first
/// @param samples  u8 and u16: sRGB codes; f32: linear sRGB
/// Errors: those of retargeting().
Result<RetargetedPicture> retarget_picture(const SceneLinear& xyz, const RetargetOptions& options, SampleType samples,
                                           Executor& executor);

}  // namespace lowlux::isp
