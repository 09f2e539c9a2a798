#pragma once

#include "capture/x_trans/x_trans_setting.h"
#include "isp/base/executor.h"
#include "isp/base/plane.h"

/// Interpolation of X-Trans mosaics by filters that were computed for the least error (scripts/train-x-trans).
/// capture/README.md has the method, its figures and its limits.
namespace lowlux::capture {

/// Interpolates three colours at every site. Every site keeps the value that was measured there.
///
/// Constants and, away from borders, linear gradients of each colour are reproduced exactly but for rounding, whatever
/// the other colours are: noise of mean 0 leaves means as they are. Values are signed and not limited, except within
/// five pixels of saturated sites (1 or more): gradients are not exact there, and where all sites of a colour within
/// one pixel are saturated, so is the interpolated value (capture/README.md). A colour without any site in the mosaic
/// gets the mean of the sites there are.
///
/// @param mosaic  height x width, finite
/// @param out     height x (3 width), R, G, B interleaved; must not overlap `mosaic`
/// @note The bytes do not depend on the number of threads. It takes 1 MB for each thread.
void interpolate_x_trans(PlaneView<const float> mosaic, const XTransSetting& setting, PlaneView<float> out,
                         Executor& executor);

}  // namespace lowlux::capture
