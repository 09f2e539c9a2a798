#pragma once

#include <cstdint>
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

/// States what becomes of negative values, which are not radiance: each becomes 0, with a warning that states their
/// number and their fraction of the light.
enum class Negatives : std::uint8_t {
  few,  // above a twentieth of the light they are an error
  any
};

/// Converts linear RGB to upright XYZ. Values that are not finite are an error.
Result<SceneLinear> light_of(const SceneLinear& picture, const Matrix3& to_xyz, Orientation orientation,
                             Executor& executor, std::vector<std::string>& warnings,
                             Negatives negatives = Negatives::few);

}  // namespace lowlux::capture
