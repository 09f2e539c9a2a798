#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// The picture turned upright, as its EXIF orientation asks (EXIF 2.32 table 6). With w x h pixels going in, what
/// stands at (x, y) afterwards stood at:
///     normal     (x, y)          mirror_horizontal  (w-1-x, y)
///     rotate_180 (w-1-x, h-1-y)  mirror_vertical    (x, h-1-y)
///     transpose  (y, x)          rotate_90          (y, h-1-x)
///     transverse (w-1-y, h-1-x)  rotate_270         (w-1-y, x)
/// The last four make a picture of h x w. `normal` hands the picture back without copying it.
/// The executor's threads share the rows.
Picture oriented(Picture picture, Orientation orientation, Executor& executor);

}  // namespace lowlux::isp
