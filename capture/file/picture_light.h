#pragma once

#include <string>
#include <vector>

#include "capture/file/picture_colour.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Converts the codes of a display image to upright XYZ. `colour` has a curve value for each code.
Result<SceneLinear> light_of(const Encoded8& picture, const DisplayColour& colour, Orientation orientation,
                             Executor& executor);
Result<SceneLinear> light_of(const Encoded16& picture, const DisplayColour& colour, Orientation orientation,
                             Executor& executor);

/// Converts linear RGB to upright XYZ. Values that are not radiance are an error, or set to 0 with a warning: see
/// read_picture.
Result<SceneLinear> light_of(const SceneLinear& picture, const Matrix3& to_xyz, Orientation orientation,
                             Executor& executor, std::vector<std::string>& warnings);

}  // namespace lowlux::capture
