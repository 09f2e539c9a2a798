#pragma once

#include "isp/base/executor.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// Shrinks linear light: each value of `out` is the mean of `in` over the area that it covers, pixels at the border of
/// that area counted by the part that lies inside. Values are signed; their mean over the image is kept. The result
/// does not depend on the number of threads.
/// @param out  1 pixel to the size of `in` along each axis
void shrink_by_area(const RgbView<const float>& in, const RgbView<float>& out, Executor& executor);

}  // namespace lowlux::isp
