#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "isp/base/executor.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/progress.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/simulate/scene_argument.h"
#include "isp/cli/simulate/simulate_args.h"
#include "isp/cli/simulate/simulate_report.h"
#include "isp/cli/verbs.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/sensor/given_figures.h"
#include "isp/output/dng/dng_writer.h"
#include "isp/output/picture/image_writer.h"
#include "isp/pipeline/stage_clock.h"

namespace lowlux::cli {
namespace {

namespace fs = std::filesystem;

std::string frame_file(const SimulateArgs& args, int index) {
  if (args.frames == 1) return args.output;
  return fmt::format("{}_{:04}.dng", args.output.substr(0, args.output.size() - 4), index);
}

/// Holds the files of a run: all frames, then the truths.
struct Files {
  std::vector<std::string> frames;
  std::string truth;
  std::string truth_electrons;
};

/// Returns whether the truth is written; for a dark frame, whose truth is black, only where its file is named.
bool writes_truth(const SimulateArgs& args) {
  const bool black = args.scene.what == "dark" && args.scene.lamps.empty() && args.scene.stars == 0;
  return !args.no_truth && (!black || !args.truth.empty());
}

Files files_of(const SimulateArgs& args) {
  Files files;
  for (int i = 0; i < args.frames; ++i) files.frames.push_back(frame_file(args, i));
  if (writes_truth(args)) {
    files.truth = !args.truth.empty() ? args.truth : args.output.substr(0, args.output.size() - 4) + ".truth.exr";
  }
  files.truth_electrons = args.truth_electrons;
  return files;
}

/// Returns the error of the output files; empty if there is none.
std::string wrong_files(const SimulateArgs& args) {
  if (args.scene.what.empty()) return "SCENE is required: a picture, or dark, flat, chart; --help lists the options";
  if (args.output.empty()) return "-o is required: the raw file to write";
  if (!args.output.ends_with(".dng")) return fmt::format("-o: raw files are written as .dng, not as {}", args.output);
  std::vector<std::string> pictures;
  if (!args.truth.empty()) pictures.push_back(args.truth);
  if (!args.truth_electrons.empty()) pictures.push_back(args.truth_electrons);
  for (const std::string& picture : pictures) {
    const auto format = isp::format_of(picture);
    if (!format) return format.error().message;
    if (const auto fits = isp::check_writable(*format, SampleType::f32, OutputSpace::linear_srgb); !fits) {
      return fits.error().message;
    }
  }
  const Files files = files_of(args);
  if (!files.truth.empty() && same_name(files.truth, files.truth_electrons)) {
    return fmt::format("--truth-electrons: {} is the name of the truth too", files.truth_electrons);
  }
  return {};
}

/// Checks before any work that no output exists. A run that fails later (a full disk) or is interrupted leaves the
/// frames that were finished, each of them complete.
Result<void> check_free(const Files& files, const SimulateArgs& args) {
  std::vector<std::string> all = files.frames;
  for (const std::string& truth : {files.truth, files.truth_electrons}) {
    if (!truth.empty()) all.push_back(truth);
  }
  for (const std::string& file : all) {
    std::error_code ignored;
    if (fs::equivalent(file, args.scene.what, ignored)) {
      return fail(ErrorCode::exists, fmt::format("{} would replace its own scene", file), file);
    }
    if (auto place = check_place(file, args.force); !place) return place;
  }
  return {};
}

/// Converts XYZ in cd/m2 to linear sRGB with white at 1.
void to_relative_srgb(SceneLinear& picture, double white_cd_m2, Executor& executor) {
  const double scale = white_cd_m2 > 0 ? 1 / white_cd_m2 : 1;
  const Matrix3 m = scale * *inverse(*isp::rgb_to_xyz(isp::primaries_rec709));
  for_each_band(executor, picture.height(), [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      float* row[3] = {picture.plane[0].row(y), picture.plane[1].row(y), picture.plane[2].row(y)};
      for (int x = 0; x < picture.width(); ++x) {
        const Vector3 rgb = m * Vector3{row[0][x], row[1][x], row[2][x]};
        for (int c = 0; c < 3; ++c) row[c][x] = static_cast<float>(rgb[c]);
      }
    }
  });
}

/// Returns whether half floats suffice. They are finer than any noise, but end at 65504, which a lamp in a dark scene
/// exceeds.
bool fits_half(const SceneLinear& picture) {
  constexpr float largest = 65504;
  return std::all_of(picture.plane.begin(), picture.plane.end(), [](const Plane<float>& plane) {
    return std::all_of(plane.data(), plane.data() + plane.size(), [](float v) { return std::fabs(v) <= largest; });
  });
}

class Simulation {
 public:
  explicit Simulation(const SimulateArgs& args)
      : args_(args),
        files_(files_of(args)),
        executor_(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8)) {}

  Result<SimulateOutcome> run() {
    if (const auto free = check_free(files_, args_); !free) return tl::make_unexpected(free.error());
    isp::StageClock clock(out_.times);
    auto source = make_source(clock);
    if (!source) return tl::make_unexpected(source.error());
    if (const auto written = write_frames(*source); !written) return tl::make_unexpected(written.error());
    isp::StageClock finish(out_.times);
    if (const auto written = write_truth(*source); !written) return tl::make_unexpected(written.error());
    finish.lap("truth");
    out_.plan = source->file_plan();
    if (args_.explain) out_.cost = source->measure_cost();
    return std::move(out_);
  }

 private:
  Result<capture::SyntheticSource> make_source(isp::StageClock& clock) {
    auto sensor = isp::sensor_named(args_.sensor, args_.gain, args_.figures);
    if (!sensor) return tl::make_unexpected(sensor.error());
    auto response = isp::spectral_response(*sensor, args_.optics);
    if (!response) return tl::make_unexpected(response.error());
    const auto used = isp::check_given_figures(args_.figures, *sensor, args_.optics);
    if (!used) return tl::make_unexpected(used.error());
    auto scene = scene_of(args_.scene, args_.options.seed, executor_);
    if (!scene) return tl::make_unexpected(scene.error());
    clock.lap("scene");
    out_.sensor = *sensor;
    out_.white_cd_m2 = scene->white_luminance_cd_m2;
    out_.warnings = scene->warnings;
    if (const double time_s = args_.options.exposure.time_s; time_s > 0) {
      out_.saturation_cd_m2 = isp::saturation_luminance_cd_m2(sensor->model, *response, time_s);
    }
    description_ = scene->scene.description;
    if (const auto fits = check_size(scene->scene.xyz_cd_m2); !fits) return tl::make_unexpected(fits.error());
    auto source = capture::SyntheticSource::of(std::move(scene->scene), *std::move(sensor), *std::move(response),
                                               args_.options, executor_);
    clock.lap("exposure and plan");
    if (source && source->moved_pixels() > 0) {
      out_.warnings.push_back(
          fmt::format("{} pixels have colours no light can have: moved towards white", source->moved_pixels()));
    }
    return source;
  }

  /// Checks the size of an image, which has its own; --size is checked with the arguments.
  static Result<void> check_size(const SceneLinear& picture) {
    if (picture.width() >= min_side && picture.height() >= min_side) return {};
    return fail(ErrorCode::insufficient,
                fmt::format("the picture has {} x {} pixels, and raw developers read {} x {} and more: enlarge it",
                            picture.width(), picture.height(), min_side, min_side));
  }

  Result<void> write_frames(const capture::SyntheticSource& source) {
    Progress progress(args_.frames, !args_.quiet);
    isp::DngWriteOptions write{overwrite(), "lowlux " + version_number(), describe()};
    double read_out_s = 0, write_s = 0;
    for (int i = 0; i < args_.frames; ++i) {
      std::vector<isp::StageTime> times;
      isp::StageClock clock(times);
      const RawFrame frame = source.frame(static_cast<std::uint32_t>(i), executor_);
      clock.lap("readout");
      if (auto written = isp::write_dng(frame, files_.frames[i], write); !written) return written;
      clock.lap("raw file");
      read_out_s += times[0].seconds;
      write_s += times[1].seconds;
      out_.files.push_back(files_.frames[i]);
      progress.advance(1, files_.frames[i]);
    }
    out_.times.push_back({"readout", read_out_s});
    out_.times.push_back({"raw files", write_s});
    return {};
  }

  Result<void> write_truth(const capture::SyntheticSource& source) {
    isp::WriteOptions write;
    write.overwrite = overwrite();
    write.software = "lowlux " + version_number();
    if (!files_.truth.empty()) {
      SceneLinear truth = source.xyz_cd_m2();
      to_relative_srgb(truth, out_.white_cd_m2, executor_);
      if (out_.white_cd_m2 > 0) write.white_luminance_cd_m2 = out_.white_cd_m2;
      write.exr.depth = fits_half(truth) ? isp::ExrOptions::Depth::half : isp::ExrOptions::Depth::full;
      auto written = isp::write_picture(std::move(truth), OutputSpace::linear_srgb, {}, files_.truth, write, executor_);
      if (!written) return written;
      out_.files.push_back(files_.truth);
    }
    if (files_.truth_electrons.empty()) return {};
    write.white_luminance_cd_m2.reset();
    write.exr.depth = isp::ExrOptions::Depth::full;
    SceneLinear electrons{};
    electrons.plane = source.signal_e(executor_).plane;
    out_.files.push_back(files_.truth_electrons);
    return isp::write_picture(std::move(electrons), OutputSpace::camera, {}, files_.truth_electrons, write, executor_);
  }

  isp::Overwrite overwrite() const { return args_.force ? isp::Overwrite::yes : isp::Overwrite::no; }

  std::string describe() const {
    return fmt::format(
        "simulated: {}, white {:g} cd/m2, {:g} s, f/{:g}, {:g} C, {} photons, effects {}, seed {}, sensor {}",
        description_, out_.white_cd_m2, args_.options.exposure.time_s, args_.options.f_number,
        args_.options.exposure.temperature_c,
        args_.options.sampling == capture::PhotonSampling::physical ? "physical" : "published",
        args_.effects.empty() ? (args_.options.effects.tolerance ? "auto" : "all") : args_.effects.c_str(),
        args_.options.seed, args_.options.sensor_seed);
  }

  const SimulateArgs& args_;
  Files files_;
  PoolExecutor executor_;
  std::string description_;
  SimulateOutcome out_;
};

void print_outcome(const SimulateArgs& args, const SimulateOutcome& outcome) {
  if (!args.quiet) {
    for (const std::string& warning : outcome.warnings) {
      print_err(fmt::format("{}\n", one_line(fmt::format("lowlux: {}: warning: {}", args.scene.what, warning))));
    }
  }
  if (args.json) {
    print_out(fmt::format("{}\n", simulate_json(args, outcome)));
    return;
  }
  if (!args.quiet) print_out(fmt::format("{}", simulate_text(args, outcome)));
  if (args.explain) print_out(fmt::format("{}", explain_text(args, outcome)));
  if (args.timings) print_out(fmt::format("{}", times_text(outcome.times)));
}

}  // namespace

int run_simulate(const std::vector<std::string>& words) {
  const Parsed<SimulateArgs> parsed = parse_simulate(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<SimulateArgs>(parsed);
  if (args.list) {
    print_out(fmt::format("{}", simulate_list()));
    return exit_done;
  }
  if (const std::string wrong = wrong_files(args); !wrong.empty()) {
    return print_usage_error("simulate", {ErrorCode::invalid_argument, wrong, {}});
  }
  const Result<SimulateOutcome> outcome = Simulation(args).run();
  if (!outcome) {
    const Error& error = outcome.error();
    if (error.code != ErrorCode::invalid_argument) return print_failure(args.scene.what, error);
    const std::string place = error.where.empty() ? "" : " (" + error.where + ")";
    return print_usage_error("simulate", {error.code, error.message + place, {}});
  }
  print_outcome(args, *outcome);
  return exit_done;
}

}  // namespace lowlux::cli
