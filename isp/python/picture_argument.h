#pragma once

#include <optional>
#include <string>

#include <pybind11/pybind11.h>

#include "capture/file/picture_source.h"
#include "isp/base/executor.h"
#include "isp/base/image.h"

namespace lowlux::python {

/// An image that a caller passes: a file, or samples in memory.
struct PictureArgument {
  std::string name;  // the file, or what errors call the samples
  std::optional<Picture> picture;
};

/// Returns the path, or a copy of an array of (height, width, 3): bytes and 16-bit codes of sRGB, or floats of linear
/// sRGB. Throws Failure for other arrays, and for more pixels than a file may have (isp::DecodeLimits), before any
/// copy.
/// @param name  what errors call an array
PictureArgument picture_argument(const pybind11::object& image, const std::string& name);

/// Returns an image as light. Throws Failure as capture::read_picture fails.
capture::ScenePicture scene_of(const PictureArgument& image, Executor& executor);

}  // namespace lowlux::python
