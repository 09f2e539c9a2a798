#include "isp/python/picture_argument.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include <pybind11/numpy.h>

#include "capture/file/picture_colour.h"
#include "capture/file/picture_light.h"
#include "isp/codec/picture_file.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/python/failure.h"
#include "isp/python/quiet_numpy.h"

namespace lowlux::python {

namespace py = pybind11;

PictureArgument picture_argument(const py::object& image, const std::string& name) {
  if (!py::isinstance<py::array>(image)) return {image.cast<std::string>(), {}};
  const auto array = image.cast<py::array>();
  if (array.ndim() != 3 || array.shape(2) != 3 || array.size() == 0) {
    throw Failure({ErrorCode::invalid_argument, "an image is an array of (height, width, 3)", name});
  }
  const isp::DecodeLimits limits;
  if (!isp::check_size(array.shape(1), array.shape(0), limits)) {
    throw Failure(
        {ErrorCode::too_large, "an image has at most " + std::to_string(limits.max_pixels) + " pixels", name});
  }
  const auto height = static_cast<int>(array.shape(0)), width = static_cast<int>(array.shape(1));
  const auto codes = [&](auto sample) {
    using Sample = decltype(sample);
    const QuietNumpy quiet;
    const auto values = py::array_t<Sample, py::array::c_style | py::array::forcecast>(array);
    Plane<Sample> plane(3 * width, height);
    std::copy_n(values.data(), plane.size(), plane.data());
    return plane;
  };
  const char kind = array.dtype().kind();
  if (kind == 'u' && array.itemsize() == 1) return {name, Picture(Encoded8{codes(std::uint8_t{})})};
  if (kind == 'u' && array.itemsize() == 2) return {name, Picture(Encoded16{codes(std::uint16_t{})})};
  if (kind != 'f') {
    throw Failure({ErrorCode::invalid_argument, "an image is an array of uint8, uint16 or floats", name});
  }
  const Plane<float> values = codes(float{});
  SceneLinear linear(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < 3 * width; ++x) linear.plane[static_cast<std::size_t>(x % 3)].at(x / 3, y) = values.at(x, y);
  }
  return {name, Picture(std::move(linear))};
}

capture::ScenePicture scene_of(const PictureArgument& image, Executor& executor) {
  const auto located = [&](Error error) {
    error.where = image.name;
    return error;
  };
  if (!image.picture) return value_of(capture::read_picture(image.name, executor).map_error(located));
  capture::ScenePicture scene;
  const auto light = [&](const auto& samples) -> Result<SceneLinear> {
    if constexpr (std::is_same_v<std::decay_t<decltype(samples)>, SceneLinear>) {
      const Matrix3 to_xyz = *isp::rgb_to_xyz(isp::primaries_rec709);
      return capture::light_of(samples, to_xyz, Orientation::normal, executor, scene.warnings);
    } else {
      const int count = std::is_same_v<std::decay_t<decltype(samples)>, Encoded8> ? 256 : 65536;
      return capture::light_of(samples, capture::srgb_colour(count), Orientation::normal, executor);
    }
  };
  scene.xyz = value_of(std::visit(light, *image.picture).map_error(located));
  return scene;
}

}  // namespace lowlux::python
