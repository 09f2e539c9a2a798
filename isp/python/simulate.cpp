#include <algorithm>
#include <memory>
#include <optional>
#include <thread>

#include <pybind11/stl.h>

#include "capture/file/picture_source.h"
#include "isp/cli/compare/compare_work.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/simulate/simulate_files.h"
#include "isp/cli/simulate/simulate_work.h"
#include "isp/python/call.h"
#include "isp/python/module.h"
#include "isp/python/picture_argument.h"
#include "isp/python/text.h"

namespace lowlux::python {
namespace {

namespace py = pybind11;

using Words = std::vector<std::string>;

struct Simulated {
  cli::SimulatedData data;
  std::string report;
  std::vector<std::string> warnings;
};

Simulated simulated(const PictureArgument& scene, const std::string& output, bool overwrite, const Words& words) {
  auto args = parsed(cli::parse_simulate, words);
  if (scene.picture) {
    PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8));
    args.scene.picture = std::make_shared<capture::ScenePicture>(scene_of(scene, executor));
  }
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

py::tuple simulate(const py::object& scene, const std::string& output, bool overwrite, const Words& words) {
  const PictureArgument picture = picture_argument(scene, "scene");
  std::optional<Simulated> made;
  {
    const py::gil_scoped_release released;
    made = simulated(picture, output, overwrite, words);
  }
  std::vector<RawImagePtr> frames;
  for (RawFrame& frame : made->data.frames) frames.push_back(std::make_shared<RawImage>(RawImage{std::move(frame)}));
  return py::make_tuple(frames, made->report, array_or_none(std::move(made->data.truth)),
                        array_or_none(std::move(made->data.truth_e)), made->data.burst_truth, strs_of(made->warnings));
}

std::string compare(const py::object& reference, const py::object& test) {
  const PictureArgument a = picture_argument(reference, "reference"), b = picture_argument(test, "test");
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
