#pragma once

#include "isp/base/executor.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// Encodes linear XYZ as an image of a space, without tone curve. For codes, colours outside of the gamut move towards
/// neutral as RgbTransform says; floats stay as they are.
/// @param xyz    display-linear, D65 white at Y = 1
/// @param space  not `camera`
Picture encode_picture(const SceneLinear& xyz, OutputSpace space, SampleType samples, Executor& executor);

}  // namespace lowlux::isp
