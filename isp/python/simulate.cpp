#include "isp/python/simulate.h"

#include <algorithm>
#include <optional>
#include <thread>

#include <pybind11/stl.h>

#include "capture/file/picture_colour.h"
#include "capture/file/picture_light.h"
#include "isp/cli/compare/compare_work.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/simulate/simulate_files.h"
#include "isp/cli/simulate/simulate_work.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/python/call.h"

namespace lowlux::python {
namespace {

namespace py = pybind11;

using Words = std::vector<std::string>;

struct Simulated {
  cli::SimulatedData data;
  std::string report;
  std::vector<std::string> warnings;
};

Simulated simulated(const std::string& output, bool overwrite, const Words& words) {
  auto args = parsed(cli::parse_simulate, words);
  if (!output.empty()) {
    if (const std::string wrong = cli::wrong_files(args); !wrong.empty()) {
      throw Failure({ErrorCode::invalid_argument, wrong, {}});
    }
  }
  args.output = output;
  args.force = overwrite;
  args.quiet = true;
  Simulated out;
  auto done = cli::simulate(args, &out.data);
  if (!done) throw Failure(cli::with_file(std::move(done.error()), args.scene.what));
  out.report = cli::simulate_json(args, *done);
  out.warnings = std::move(done->warnings);
  return out;
}

py::object array_or_none(std::optional<SceneLinear> picture) {
  if (!picture) return py::none();
  return array_of(Picture(*std::move(picture)));
}

py::tuple simulate(const std::string& output, bool overwrite, const Words& words) {
  std::optional<Simulated> made;
  {
    const py::gil_scoped_release released;
    made = simulated(output, overwrite, words);
  }
  std::vector<RawImagePtr> frames;
  for (RawFrame& frame : made->data.frames) frames.push_back(std::make_shared<RawImage>(std::move(frame)));
  return py::make_tuple(frames, made->report, array_or_none(std::move(made->data.truth)),
                        array_or_none(std::move(made->data.truth_e)), made->data.burst_truth, made->warnings);
}

/// Holds an image to compare: a file, or samples in memory.
struct Compared {
  std::string name;
  std::optional<Picture> picture;
};

/// Returns a copy of an array of (height, width, 3): bytes and 16-bit codes of sRGB, or floats of linear sRGB.
Compared picture_of(const py::object& image, const std::string& name) {
  if (!py::isinstance<py::array>(image)) return {image.cast<std::string>(), {}};
  const auto array = image.cast<py::array>();
  if (array.ndim() != 3 || array.shape(2) != 3 || array.size() == 0) {
    throw Failure({ErrorCode::invalid_argument, "an image is an array of (height, width, 3)", name});
  }
  const auto height = static_cast<int>(array.shape(0)), width = static_cast<int>(array.shape(1));
  const auto codes = [&](auto sample) {
    using Sample = decltype(sample);
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

capture::ScenePicture scene_of(const Compared& image, Executor& executor) {
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

std::string compare(const py::object& reference, const py::object& test) {
  const Compared a = picture_of(reference, "reference"), b = picture_of(test, "test");
  const py::gil_scoped_release released;
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8));
  const cli::CompareArgs args{.reference = a.name, .test = b.name};
  const capture::ScenePicture first = scene_of(a, executor), second = scene_of(b, executor);
  return cli::compare_json(args, value_of(cli::compare_scenes(first, second, args, executor)));
}

}  // namespace

void add_simulate(py::module_& module) {
  module.def("simulate", simulate);
  module.def("compare", compare);
}

}  // namespace lowlux::python
