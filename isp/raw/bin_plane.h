#pragma once

#include "isp/base/executor.h"
#include "isp/base/plane.h"

namespace lowlux::isp {

/// Writes the mean of each complete 2x2 block to `out`, which is floor(height / 2) x floor(width / 2).
void bin_plane(PlaneView<const float> in, PlaneView<float> out, Executor& executor);

}  // namespace lowlux::isp
