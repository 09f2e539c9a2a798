#include "isp/cli/simulate/simulate_work.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "capture/synthetic/burst.h"
#include "capture/synthetic/synthetic_source.h"
#include "isp/base/executor.h"
#include "isp/cli/develop/memory_gate.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/progress.h"
#include "isp/cli/simulate/scene_argument.h"
#include "isp/cli/simulate/simulate_args.h"
#include "isp/cli/simulate/simulate_files.h"
#include "isp/cli/simulate/simulate_report.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/sensor/given_figures.h"
#include "isp/output/dng/dng_writer.h"
#include "isp/output/picture/image_writer.h"
#include "isp/output/report/report.h"
#include "isp/pipeline/stage_clock.h"

namespace lowlux::cli {
namespace {

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

// The two kinds of sources: of one scene at rest, and of a burst.
Result<RawFrame> frame_of(const capture::SyntheticSource& source, std::uint32_t index, Executor& executor) {
  return source.frame(index, executor);
}
Result<RawFrame> frame_of(const capture::BurstSource& source, std::uint32_t index, Executor& executor) {
  return source.frame(index, executor);
}

SceneLinear truth_of(const capture::SyntheticSource& source, Executor& executor) { return source.xyz_cd_m2(executor); }
SceneLinear truth_of(const capture::BurstSource& source, Executor& executor) { return source.xyz_cd_m2(0, executor); }

CameraRgb electrons_of(const capture::SyntheticSource& source, Executor& executor) { return source.signal_e(executor); }
CameraRgb electrons_of(const capture::BurstSource& source, Executor& executor) { return source.signal_e(0, executor); }

/// Reports the plan of noise sources, that of frame 0 for a burst, and their cost if asked for.
void report_plan(const capture::SyntheticSource& source, bool explain, Executor& /*executor*/, SimulateOutcome& out) {
  out.plan = source.file_plan();
  if (explain) out.cost = source.measure_cost();
}
void report_plan(const capture::BurstSource& source, bool explain, Executor& executor, SimulateOutcome& out) {
  const auto sensor = source.exposed(0, executor);
  if (!sensor) return;  // write_frames() reports it
  out.plan = sensor->file_plan();
  if (explain) out.cost = sensor->measure_cost(nullptr);
}

class Simulation {
 public:
  Simulation(const SimulateArgs& args, SimulatedData* keep, const SimulationTaker& take)
      : args_(args),
        keep_(keep),
        take_(take),
        files_(files_of(args)),
        executor_(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8)) {}

  Result<SimulateOutcome> run() {
    if (const auto free = check_output_is_free(files_, args_); !free) return tl::make_unexpected(free.error());
    isp::StageClock clock(out_.times);
    auto sensor = isp::sensor_named(args_.sensor, args_.gain, args_.figures);
    if (!sensor) return tl::make_unexpected(sensor.error());
    auto response = isp::spectral_response(*sensor, args_.optics);
    if (!response) return tl::make_unexpected(response.error());
    const auto used = isp::check_given_figures(args_.figures, *sensor, args_.optics);
    if (!used) return tl::make_unexpected(used.error());
    out_.sensor = *sensor;
    if (const double time_s = args_.options.exposure.time_s; time_s > 0) {
      out_.saturation_cd_m2 = isp::saturation_luminance_cd_m2(sensor->model, *response, time_s);
    }
    auto scene = make_scene();
    if (!scene) return tl::make_unexpected(scene.error());
    clock.lap("scene");
    return args_.burst.is_burst()
               ? written(capture::BurstSource::of(*std::move(scene), *std::move(sensor), *std::move(response),
                                                  args_.options, args_.burst.options, executor_),
                         clock)
               : written(capture::SyntheticSource::of(*std::move(scene), *std::move(sensor), *std::move(response),
                                                      args_.options, executor_),
                         clock);
  }

 private:
  Result<capture::Scene> make_scene() {
    if (args_.scene.size_given) {  // reported before the scene is made
      const auto fits = check_memory(args_.scene.width, args_.scene.height);
      if (!fits) return tl::make_unexpected(fits.error());
    }
    auto scene = scene_of(args_.scene, args_.options.seed, executor_);
    if (!scene) return tl::make_unexpected(scene.error());
    out_.white_cd_m2 = scene->white_luminance_cd_m2;
    out_.warnings = scene->warnings;
    description_ = scene->scene.description;
    const SceneLinear& light = scene->scene.xyz_cd_m2;
    if (const auto fits = check_size(light); !fits) return tl::make_unexpected(fits.error());
    const auto fits = check_memory(light.width() / args_.scene.reduction, light.height() / args_.scene.reduction);
    if (!fits) return tl::make_unexpected(fits.error());
    return std::move(scene->scene);
  }

  /// Checks the size of an image, which has its own; --size is checked with the arguments.
  Result<void> check_size(const SceneLinear& picture) const {
    const int width = picture.width() / args_.scene.reduction, height = picture.height() / args_.scene.reduction;
    if (width >= min_side && height >= min_side) return {};
    const std::string reduced =
        args_.scene.reduction > 1 ? fmt::format(", reduced by {},", args_.scene.reduction) : std::string();
    return fail(ErrorCode::insufficient,
                fmt::format("the image{} has {} x {} pixels, but raw developers need at least {} x {}: enlarge it",
                            reduced, width, height, min_side, min_side));
  }

  /// Returns an error if less memory is available than frames and truths take that are kept in it.
  Result<void> check_memory(int width, int height) const {
    if (keep_ == nullptr) return {};
    const double truth_samples = has_truth(args_) ? 2 * 3 : 0;
    const double bytes_per_pixel =
        static_cast<double>(sizeof(std::uint16_t)) * args_.frames + sizeof(float) * truth_samples;
    const double bytes = bytes_per_pixel * width * height;
    const auto available = available_memory();
    if (!available || bytes <= *available) return {};
    return fail(ErrorCode::too_large,
                fmt::format("not enough memory for frames: {} of {} x {} pixels and their truth take {:.3g} GB, and "
                            "{:.3g} GB are available",
                            args_.frames, width, height, 1e-9 * bytes, 1e-9 * *available));
  }

  /// Writes everything of a source.
  template <class Source>
  Result<SimulateOutcome> written(const Result<Source>& source, isp::StageClock& clock) {
    clock.lap("exposure and plan");
    if (!source) return tl::make_unexpected(source.error());
    if (source->moved_pixels() > 0) {
      out_.warnings.push_back(fmt::format(
          "{} pixels have colours outside the spectral locus: they were moved towards white", source->moved_pixels()));
    }
    report_plan(*source, args_.explain, executor_, out_);
    if (const auto done = write_frames(*source); !done) return tl::make_unexpected(done.error());
    isp::StageClock finish(out_.times);
    if (const auto done = write_truth(*source); !done) return tl::make_unexpected(done.error());
    finish.lap("truth");
    return std::move(out_);
  }

  template <class Source>
  Result<void> write_frames(const Source& source) {
    Progress progress(args_.frames, !args_.quiet);
    isp::DngWriteOptions write{overwrite(), "lowlux " + version_number(), {}};
    double read_out_s = 0, write_s = 0;
    for (int i = 0; i < args_.frames; ++i) {
      std::vector<isp::StageTime> times;
      isp::StageClock clock(times);
      Result<RawFrame> frame = frame_of(source, static_cast<std::uint32_t>(i), executor_);
      if (!frame) return tl::make_unexpected(frame.error());
      clock.lap("readout");
      write.description = describe(*frame);
      if (!files_.frames[i].empty()) {
        if (auto done = isp::write_dng(*frame, files_.frames[i], write); !done) return done;
        out_.files.push_back(files_.frames[i]);
      }
      clock.lap("raw file");
      read_out_s += times[0].seconds;
      write_s += times[1].seconds;
      if (take_.frame) {
        if (auto taken = take_.frame(*frame, i, out_); !taken) return taken;
      }
      progress.advance(1, files_.frames[i]);
      if (keep_ != nullptr) keep_->frames.push_back(*std::move(frame));
    }
    out_.times.push_back({"readout", read_out_s});
    out_.times.push_back({"raw files", write_s});
    return {};
  }

  template <class Source>
  Result<void> write_truth(const Source& source) {
    isp::WriteOptions write;
    write.overwrite = overwrite();
    write.software = "lowlux " + version_number();
    if (!files_.truth.empty() || take_.truth || (keep_ != nullptr && has_truth(args_))) {
      SceneLinear truth = truth_of(source, executor_);
      to_relative_srgb(truth, out_.white_cd_m2, executor_);
      if (out_.white_cd_m2 > 0) write.white_luminance_cd_m2 = out_.white_cd_m2;
      write.exr.depth = fits_half(truth) ? isp::ExrOptions::Depth::half : isp::ExrOptions::Depth::full;
      auto done = write_picture(std::move(truth), OutputSpace::linear_srgb, files_.truth, write,
                                keep_ != nullptr ? &keep_->truth : nullptr, take_.truth);
      if (!done) return done;
    }
    if (!files_.truth_electrons.empty() || take_.truth_e || (keep_ != nullptr && has_truth(args_))) {
      write.white_luminance_cd_m2.reset();
      write.exr.depth = isp::ExrOptions::Depth::full;
      SceneLinear electrons{};
      electrons.plane = electrons_of(source, executor_).plane;
      auto done = write_picture(std::move(electrons), OutputSpace::camera, files_.truth_electrons, write,
                                keep_ != nullptr ? &keep_->truth_e : nullptr, take_.truth_e);
      if (!done) return done;
    }
    return write_burst_truth(source);
  }

  /// Writes a truth if it has a file.
  /// @param kept  where it goes then; null: nowhere
  Result<void> write_picture(SceneLinear truth, OutputSpace space, const std::string& file,
                             const isp::WriteOptions& options, std::optional<SceneLinear>* kept,
                             const std::function<Result<void>(const SceneLinear&)>& take) {
    Picture picture = std::move(truth);
    if (!file.empty()) {
      if (auto done = isp::write_picture(picture, space, {}, file, options, executor_); !done) return done;
      out_.files.push_back(file);
    }
    if (take) {
      if (auto taken = take(std::get<SceneLinear>(picture)); !taken) return taken;
    }
    if (kept != nullptr) *kept = std::get<SceneLinear>(std::move(picture));
    return {};
  }

  static Result<void> write_burst_truth(const capture::SyntheticSource& /*source*/) { return {}; }
  Result<void> write_burst_truth(const capture::BurstSource& source) {
    if (keep_ != nullptr && !args_.no_truth) keep_->burst_truth = burst_truth_json(args_, source, files_.frames);
    if (files_.burst_truth.empty()) return {};
    out_.files.push_back(files_.burst_truth);
    return isp::write_text(files_.burst_truth, burst_truth_json(args_, source, files_.frames), overwrite());
  }

  isp::Overwrite overwrite() const { return args_.force ? isp::Overwrite::yes : isp::Overwrite::no; }

  std::string describe(const RawFrame& frame) const {
    return fmt::format(
        "simulated: {}, white {:g} cd/m2, {:g} s, f/{:g}, {:g} C, {} photons, effects {}, seed {}, sensor {}{}{}",
        description_, out_.white_cd_m2, *frame.raw.info.exposure_s, args_.options.f_number,
        args_.options.exposure.temperature_c,
        args_.options.sampling == capture::PhotonSampling::physical ? "physical" : "published",
        args_.effects.empty() ? (args_.options.effects.tolerance ? "auto" : "all") : args_.effects.c_str(),
        args_.options.seed, args_.options.sensor_seed, args_.burst.is_burst() ? ", burst" : "",
        args_.options.lens_blur_px > 0 ? fmt::format(", lens blur {:g} px", args_.options.lens_blur_px) : "");
  }

  const SimulateArgs& args_;
  SimulatedData* keep_;
  const SimulationTaker& take_;
  SimulateFiles files_;
  PoolExecutor executor_;
  std::string description_;
  SimulateOutcome out_;
};

}  // namespace

Result<SimulateOutcome> simulate(const SimulateArgs& args, SimulatedData* keep, const SimulationTaker& take) {
  return Simulation(args, keep, take).run();
}

}  // namespace lowlux::cli
