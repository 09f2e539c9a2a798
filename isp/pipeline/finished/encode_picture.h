#pragma once

#include "isp/base/executor.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// Linear XYZ to a picture of a space, without tone curve. Of codes, what is outside of the gamut moves towards the
/// neutral of its luminance; floats stay as they are.
/// @param xyz    display-linear, D65 white at Y = 1
/// @param space  not `camera`
Picture encode_picture(const SceneLinear& xyz, OutputSpace space, SampleType samples, Executor& executor);

}  // namespace lowlux::isp
