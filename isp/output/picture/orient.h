#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// Returns the image rotated or mirrored to upright, as its EXIF orientation requires (EXIF 2.32 table 6). For an input
/// of w x h pixels, the output pixel at (x, y) is the input pixel at:
///     normal     (x, y)          mirror_horizontal  (w-1-x, y)
///     rotate_180 (w-1-x, h-1-y)  mirror_vertical    (x, h-1-y)
///     transpose  (y, x)          rotate_90          (y, h-1-x)
///     transverse (w-1-y, h-1-x)  rotate_270         (w-1-y, x)
/// The last four make an image of h x w. `normal` returns the image without copying it. The rows are divided among the
/// executor's threads.
Picture oriented(Picture picture, Orientation orientation, Executor& executor);

}  // namespace lowlux::isp
