#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "capture/synthetic/synthetic_source.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/scenes/simulated_camera.h"
#include "isp/bench/stages/simulation_stages.h"
#include "isp/metrics/statistics.h"
#include "isp/model/sensor/noise_budget.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/model/spectrum/spectral_response.h"
#include "isp/pipeline/plan/plan_develop.h"

namespace lowlux::isp {
namespace {

/// Names a sensor of the table and the camera whose filters it gets; an empty name is the sensor's own.
struct BenchSensor {
  std::string_view name;
  std::string_view camera;
};
constexpr std::array sensors{BenchSensor{thesis_sensor, ""},
                             BenchSensor{"GSENSE4040BSI", "Nikon_D5100"},
                             BenchSensor{"HWK4123_low_gain", "Canon_EOS_R6"},
                             BenchSensor{"HWK4123_high_gain", "Sony_ILCE-7SM3"},
                             BenchSensor{"QHY600_high_gain_mode_60", "Fujifilm_X-T4"},
                             BenchSensor{"QSI_532", "Panasonic_DC-GX9"}};
constexpr double white_cd_m2 = 100;  // that fills a pixel in 1 s

NamedSensor sensor_of(const BenchSensor& sensor) {
  SensorFigures figures;
  if (!sensor.camera.empty()) figures.camera = sensor.camera;
  if (sensor.name == thesis_sensor) {  // eight bits of its own would be coarser than its dark charge
    figures.system_gain_dn_per_e = 0.4;
    figures.bits = 12;
    figures.black_level_dn = 64;
    figures.white_level_dn = 4095;
    figures.quantisation = Quantisation::round;
  }
  return sensor_named(sensor.name, "", figures).value();  // cannot fail for entries of the table
}

/// Describes one frame: light, exposure, and the dark charge that follows.
struct Draw {
  double mean_e;  // mean of the signal, over the pixels
  Exposure exposure;
  std::size_t picture;
  std::uint64_t seed;
};

class Draws {
 public:
  explicit Draws(std::uint64_t seed) : engine_(seed), seed_(seed << 20) {}
  Draw next(std::size_t pictures) {
    Draw out{.mean_e = log_uniform(3, 300),
             .exposure = {.time_s = log_uniform(0.05, 60), .temperature_c = 5 + 30 * uniform()},
             .picture = static_cast<std::size_t>(uniform() * static_cast<double>(pictures)),
             .seed = ++seed_};
    return out;
  }

 private:
  double uniform() { return std::uniform_real_distribution<double>()(engine_); }
  double log_uniform(double low, double high) { return low * std::pow(high / low, uniform()); }
  std::mt19937_64 engine_;
  std::uint64_t seed_;
};

/// Returns the mean of R, G and B over the darkest fiftieth of the boxes of 16 x 16 pixels.
Vector3 darkest_of(const CameraRgb& signal_e) {
  constexpr int box = 16;
  std::vector<Vector3> means;
  for (int top = 0; top + box <= signal_e.height(); top += box) {
    for (int left = 0; left + box <= signal_e.width(); left += box) {
      Vector3 sum{};
      for (std::size_t c = 0; c < 3; ++c) {
        for (int i = 0; i < box * box; ++i) {
          sum[c] += static_cast<double>(signal_e.plane[c].at(left + i % box, top + i / box));
        }
      }
      means.push_back(sum);
    }
  }
  std::ranges::sort(means, {}, [](const Vector3& m) { return m[0] + 2 * m[1] + m[2]; });
  Vector3 out{};
  for (std::size_t i = 0; i <= means.size() / 50; ++i) {
    for (std::size_t c = 0; c < 3; ++c) out[c] += means[i][c];
  }
  return out;
}

/// Describes by how much the darkest parts of the pictures deviate from neutral, on which the estimate's standard error
/// rests.
Result<std::string> spread_of_dark_colours(const std::vector<BenchPicture>& pictures, Executor& executor) {
  const NamedSensor sensor = sensor_of(sensors[1]);
  const Result<SpectralResponse> response = spectral_response(sensor, {2, white_cd_m2});
  if (!response) return tl::make_unexpected(response.error());
  double tint = 0, temperature = 0;
  for (const BenchPicture& picture : pictures) {
    const auto source =
        capture::SyntheticSource::of(bench_scene(picture, 1), sensor, *response, {.exposure = {.time_s = 1}}, executor);
    if (!source) return tl::make_unexpected(source.error());
    const Vector3 dark = darkest_of(source->signal_e(executor));
    const Vector3 neutral = source->frame(0, executor).colour.as_shot_neutral.value_or(Vector3{1, 1, 1});
    const double red = std::log(dark[0] / neutral[0]), green = std::log(dark[1] / neutral[1]),
                 blue = std::log(dark[2] / neutral[2]);
    tint += std::pow(red - 2 * green + blue, 2) / 6;
    temperature += std::pow(red - blue, 2) / 2;
  }
  const auto n = static_cast<double>(pictures.size());
  return fmt::format(
      "The darkest fiftieth of the blocks of these images deviates from neutral by {:.2f} between green and the other "
      "two and by {:.2f} between red and blue (rms of natural logarithms); the standard error assumes 0.17 and 0.4",
      std::sqrt(tint / n), std::sqrt(temperature / n));
}

/// Simulates a picture so that its mean charge is as drawn.
Result<RawFrame> frame_of(const BenchPicture& picture, const NamedSensor& sensor, const Draw& draw,
                          Executor& executor) {
  const Result<SpectralResponse> response = spectral_response(sensor, {2, white_cd_m2});
  if (!response) return tl::make_unexpected(response.error());
  capture::SyntheticOptions options{.exposure = draw.exposure, .seed = draw.seed, .sensor_seed = draw.seed};
  const auto probe = capture::SyntheticSource::of(bench_scene(picture, 1), sensor, *response, options, executor);
  if (!probe) return tl::make_unexpected(probe.error());
  const Plane<float>& rate = probe->light().e_per_s;
  double sum = 0;
  for (std::size_t i = 0; i < rate.size(); ++i) sum += static_cast<double>(rate.data()[i]);
  const double per_cd_m2 = draw.exposure.time_s * sum / static_cast<double>(rate.size());
  const auto source =
      capture::SyntheticSource::of(bench_scene(picture, draw.mean_e / per_cd_m2), sensor, *response, options, executor);
  if (!source) return tl::make_unexpected(source.error());
  return source->frame(0, executor);
}

/// Holds what became of the frames of one sensor.
struct Tally {
  int frames = 0, matter = 0, used = 0, used_where_it_matters = 0, refused = 0, not_expected = 0, worse = 0;
  std::vector<double> relative_errors;  // relative errors of the estimates that were used
  std::vector<double> relative_standard_errors;
  double deviation_squares = 0;  // sum of squared errors, in standard errors
  Series estimates;              // over the truth

  void add(const DarkCharge& found, double truth_e, double mean_e) {
    ++frames;
    const bool matters = truth_e > 0.1 * mean_e;
    matter += matters ? 1 : 0;
    if (found.state != DarkCharge::State::estimated) {
      found.state == DarkCharge::State::unknown ? ++refused : ++not_expected;
      return;
    }
    ++used;
    estimates.x.push_back(truth_e);
    estimates.y.push_back(*found.mean_e);
    used_where_it_matters += matters ? 1 : 0;
    const double error = *found.mean_e - truth_e;
    relative_errors.push_back(error / truth_e);
    relative_standard_errors.push_back(*found.standard_error_e / truth_e);
    deviation_squares += std::pow(error / *found.standard_error_e, 2);
    worse += std::fabs(error) > truth_e ? 1 : 0;
  }
};

double median_of_sizes(std::vector<double> values) {
  for (double& value : values) value = std::fabs(value);
  return median(std::move(values));
}

std::vector<BenchCell> row_of(const std::string& name, const Tally& t) {
  return {name,
          1.0 * t.frames,
          1.0 * t.matter,
          1.0 * t.used,
          1.0 * t.used_where_it_matters,
          1.0 * t.refused,
          1.0 * t.not_expected,
          100 * median(t.relative_errors),
          100 * median_of_sizes(t.relative_errors),
          100 * median(t.relative_standard_errors),
          t.used > 0 ? std::sqrt(t.deviation_squares / t.used) : std::numeric_limits<double>::quiet_NaN(),
          1.0 * t.worse};
}

}  // namespace

Result<BenchOutcome> run_dark_estimate_bench(const BenchOptions& options) {
  PoolExecutor executor(options.threads);
  const auto pictures = read_bench_pictures(options, 0, 0, options.quick ? 2 : 0, executor);
  if (!pictures) return tl::make_unexpected(pictures.error());
  const int frames = options.quick ? 4 : 50;
  int worse = 0;
  BenchOutcome out;
  out.table.columns = {"sensor",
                       "frames",
                       "dark above 10 % of light",
                       "estimated",
                       "of those above 10 %",
                       "refused",
                       "not expected",
                       "median bias [%]",
                       "median error [%]",
                       "median standard error [%]",
                       "rms error / standard error",
                       "error above dark"};
  out.plots = {{.id = "estimates",
                .title = "Dark charge estimated from the frame itself",
                .x_label = "true dark charge [e-]",
                .y_label = "estimate [e-]",
                .x_scale = AxisScale::logarithmic,
                .y_scale = AxisScale::logarithmic,
                .caption = "Each point is a frame whose estimate is used."}};
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    const NamedSensor sensor = sensor_of(sensors[s]);
    Draws draws(s + 1);
    Tally tally;
    for (int i = 0; i < frames; ++i) {
      const Draw draw = draws.next(pictures->size());
      const Result<RawFrame> frame = frame_of((*pictures)[draw.picture], sensor, draw, executor);
      if (!frame) return tl::make_unexpected(frame.error());
      const Result<DevelopPlan> plan = plan_develop(*frame, {.denoise = {.mode = DenoiseChoice::Mode::off}}, executor);
      if (!plan) return tl::make_unexpected(plan.error());
      const std::array<double, 3> dark = dark_mean_e(sensor.model, draw.exposure);
      tally.add(plan->dark, (dark[0] + 2 * dark[1] + dark[2]) / 4, draw.mean_e);
      options.advance(1.0 / static_cast<double>(sensors.size()) / frames, std::string(sensors[s].name));
    }
    out.table.rows.push_back(row_of(std::string(sensors[s].name), tally));
    out.plots.front().series.push_back(
        {std::string(sensors[s].name), tally.estimates.x, tally.estimates.y, Mark::points});
    worse += tally.worse;
  }
  const Result<std::string> spread = spread_of_dark_colours(*pictures, executor);
  if (!spread) return tl::make_unexpected(spread.error());
  out.findings = {check_of("dark-estimate/harm", "every estimate is closer to the dark charge than 0 is", "0",
                           std::to_string(worse), worse == 0)};
  out.remarks = {
      "Each frame is an image in a light that makes 3 to 300 e- in the mean over its pixels, exposed for 0.05 to 60 s "
      "at 5 to 35 C (log-uniform, temperature uniform), with the sensor's own dark current, tagged pedestal and no "
      "masked pixels; errors are of the mean dark charge that develop would subtract",
      *spread};
  return out;
}

}  // namespace lowlux::isp
