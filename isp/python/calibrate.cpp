#include <algorithm>
#include <optional>
#include <thread>

#include <pybind11/stl.h>

#include "calib/profile/profile_io.h"
#include "isp/cli/calibrate/calibrate_args.h"
#include "isp/cli/calibrate/calibrate_colour.h"
#include "isp/cli/calibrate/calibration.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/profile_option.h"
#include "isp/python/call.h"
#include "isp/python/module.h"
#include "isp/python/text.h"

namespace lowlux::python {
namespace {

namespace py = pybind11;

using Words = std::vector<std::string>;

struct Calibrated {
  std::string profile;  // JSON
  std::vector<std::string> warnings;
};

Error with_place(Error error) { return cli::with_file(std::move(error), "calibrate"); }

/// Does one kind of calibration, and writes its files where the output has a name.
template <class Args>
Calibrated calibrated(cli::Parsed<Args> (*parse)(const Words&), Result<cli::Calibration> (*work)(const Args&),
                      const std::string& output, bool overwrite, const Words& words) {
  const py::gil_scoped_release released;
  auto args = parsed(parse, words);
  cli::CalibrateArgs& common = args.common;
  common.output = output;
  common.force = overwrite;
  common.quiet = true;
  const cli::Calibration found = value_of(work(args).map_error(with_place));
  value_of(cli::write_calibration(common, found));
  return {value_of(calib::profile_text(found.profile)), found.warnings};
}

Calibrated calibrated_colour(const std::string& output, bool overwrite, const Words& words) {
  const py::gil_scoped_release released;
  auto args = parsed(cli::parse_calibrate_colour, words);
  args.output = output;
  args.force = overwrite;
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8));
  const std::string& input = args.chart.empty() ? args.camera : args.chart;
  auto outcome = cli::calibrate_colour(args, executor);
  if (!outcome) throw Failure(cli::with_file(std::move(outcome.error()), input));
  const CameraProfile profile = value_of(cli::colour_profile(args, *outcome));
  return {value_of(calib::profile_text(profile)), outcome->warnings};
}

py::tuple calibrate(const std::string& kind, const std::string& output, bool overwrite, const Words& words) {
  Calibrated made;
  if (kind == "black") {
    made = calibrated(cli::parse_calibrate_black, cli::calibrate_black, output, overwrite, words);
  } else if (kind == "noise") {
    made = calibrated(cli::parse_calibrate_noise, cli::calibrate_noise, output, overwrite, words);
  } else if (kind == "quoted") {
    made = calibrated(cli::parse_calibrate_quoted, cli::calibrate_quoted, output, overwrite, words);
  } else if (kind == "colour") {
    made = calibrated_colour(output, overwrite, words);
  } else {
    throw Failure({ErrorCode::invalid_argument, "'" + kind + "' is none of black, colour, noise, quoted", "kind"});
  }
  return py::make_tuple(made.profile, strs_of(made.warnings));
}

std::string read_profile(const std::string& path) {
  const py::gil_scoped_release released;
  auto profile = cli::read_profile(path);
  if (!profile) throw Failure(cli::with_file(std::move(profile.error()), path));
  return value_of(calib::profile_text(*profile));
}

/// Checks a profile given as JSON, and returns it as it is written.
std::string profile_text(const std::string& text) {
  const CameraProfile profile = value_of(calib::parse_profile(text));
  return value_of(calib::profile_text(profile));
}

void write_profile(const std::string& text, const std::string& path, bool overwrite) {
  const CameraProfile profile = value_of(calib::parse_profile(text));
  value_of(cli::write_profile(path, profile, overwrite ? isp::Overwrite::yes : isp::Overwrite::no));
}

}  // namespace

void add_calibrate(py::module_& module) {
  module.def("calibrate", calibrate);
  module.def("read_profile", read_profile);
  module.def("profile_text", profile_text);
  module.def("write_profile", write_profile);
}

}  // namespace lowlux::python
