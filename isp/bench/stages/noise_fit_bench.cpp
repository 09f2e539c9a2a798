#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "calib/flat/pair_statistics.h"
#include "calib/flat/photon_transfer.h"
#include "calib/picture/picture_noise.h"
#include "capture/synthetic/synthetic_source.h"
#include "isp/base/sensor.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/scenes/simulated_camera.h"
#include "isp/bench/stages/simulation_stages.h"
#include "isp/metrics/statistics.h"

namespace lowlux::isp {
namespace {

constexpr std::array fractions_of_full{0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6};  // of flats: levels of light
constexpr Exposure flat_exposure{.time_s = 0.01, .temperature_c = 20};             // of flats and of darks

/// Relative errors of values that were measured many times.
struct FitErrors {
  double gain_square = 0, stated_square = 0, noise_square = 0;
  int fits = 0, refused = 0;

  double gain() const { return std::sqrt(gain_square / fits); }
  double told() const { return std::sqrt(stated_square / fits); }
  double noise() const { return std::sqrt(noise_square / fits); }
};

constexpr const char* gain_error = "relative error of the system gain, rms";

AccuracyTiming timing_of(const BenchOptions& options) { return {.rounds = options.quick ? 2 : 5}; }

// Photon transfer follows.

/// Numbers of frames, and of their pixels.
struct FlatAmount {
  int side;
  int pairs;  // pairs of darks, and of each level of light
  int seeds;
};

std::vector<FlatAmount> flat_amounts(bool quick) {
  if (quick) return {{64, 1, 12}, {128, 1, 8}, {128, 4, 4}};
  return {{64, 1, 100}, {64, 4, 40}, {128, 1, 60}, {256, 1, 30}, {256, 4, 10}, {512, 1, 10}};
}

/// Frames of one photon transfer measurement: pairs of darks, then pairs of flats, level by level.
struct FlatFrames {
  std::vector<RawDn> frames;
  int pairs;

  Result<calib::PhotonTransfer> fit() const {
    std::vector<calib::PairStatistics> all;
    all.reserve(frames.size() / 2);
    for (std::size_t i = 0; i < frames.size(); i += 2) {
      auto pair = calib::measure_pair(frames[i], frames[i + 1]);
      if (!pair) return tl::make_unexpected(pair.error());
      all.push_back(*std::move(pair));
    }
    const auto darks = std::span(all).first(static_cast<std::size_t>(pairs));
    return calib::fit_photon_transfer(darks, std::span(all).subspan(darks.size()));
  }
};

FlatFrames take_flats(const FlatAmount& amount, std::uint64_t seed) {
  InlineExecutor one;
  EvenLight light{.sensor = bench_camera().model, .exposure = flat_exposure};
  light.width = light.height = amount.side;
  light.seed = seed;
  FlatFrames out{{}, amount.pairs};
  out.frames.reserve(2 * (fractions_of_full.size() + 1) * static_cast<std::size_t>(amount.pairs));
  const auto add_pairs = [&](double charge_e) {
    light.rate_e_per_s.fill(charge_e / flat_exposure.time_s);
    for (int i = 0; i < 2 * amount.pairs; ++i) {
      out.frames.push_back(even_frame(light, static_cast<std::uint32_t>(out.frames.size()), one));
    }
  };
  add_pairs(0);
  for (const double share : fractions_of_full) add_pairs(share * saturation_charge_e(light.sensor));
  return out;
}

/// Returns the temporal noise of darks of flat_exposure [e-].
double dark_noise_e(const SensorModel& s) {
  return std::sqrt(s.read_noise_e * s.read_noise_e + s.row_noise_e * s.row_noise_e + dark_mean_e(s, flat_exposure)[1]);
}

void add(FitErrors& errors, const calib::PhotonTransfer& found, const SensorModel& s) {
  const auto& gain = found.system_gain_dn_per_e;
  errors.gain_square += std::pow(gain.value / s.system_gain_dn_per_e - 1, 2);
  errors.stated_square += std::pow(gain.standard_error / s.system_gain_dn_per_e, 2);
  errors.noise_square += std::pow(found.read_noise_e.value().value / dark_noise_e(s) - 1, 2);  // darks are dithered
  ++errors.fits;
}

/// Checks the fit's standard error. A root mean square of n normal deviates has the relative standard error sqrt(1 / (2
/// n)).
Finding stated_error_finding(const std::string& id, const FitErrors& errors) {
  const double ratio = errors.gain() / errors.told(), allowed = confidence_errors * std::sqrt(0.5 / errors.fits);
  return check_of("noise-fit/" + id,
                  "the error of the gain equals the standard error of the fit, within five of its own standard errors",
                  fmt::format("1 +- {:.2g}", allowed), fmt::format("{:.3g}", ratio), std::fabs(ratio - 1) <= allowed);
}

Result<void> measure_flats(const BenchOptions& options, StageRows& rows, std::vector<Finding>& findings) {
  const SensorModel sensor = bench_camera().model;
  AccuracyGroup group{"photon transfer", gain_error, {}};
  const std::vector<FlatAmount> amounts = flat_amounts(options.quick);
  std::vector<std::vector<double>> figures;
  figures.reserve(amounts.size());
  for (const FlatAmount& amount : amounts) {
    FitErrors errors;
    auto flats = std::make_shared<FlatFrames>();
    for (int seed = 1; seed <= amount.seeds; ++seed) {
      *flats = take_flats(amount, static_cast<std::uint64_t>(seed));
      const auto found = flats->fit();
      if (!found) return tl::make_unexpected(found.error());
      add(errors, *found, sensor);
    }
    const std::string name =
        fmt::format("{0} x {0} px, {1} pair{2}", amount.side, amount.pairs, amount.pairs > 1 ? "s" : "");
    findings.push_back(stated_error_finding(fmt::format("told-{}-{}", amount.side, amount.pairs), errors));
    figures.push_back({errors.noise(), errors.told(), 0, 1.0 * errors.fits});
    group.levels.push_back({name, errors.gain(), [flats] { (void)flats->fit(); }, 1});
    options.advance(0.5 / static_cast<double>(amounts.size()), name);
  }
  rows.add(group, std::move(figures), timing_of(options));
  return {};
}

// Single images follow.

/// One raw frame of an image, and the sensor's contribution to its light.
struct NoisyPicture {
  RawDn raw;
  PerSite<double> black_dn{};  // dark charge included
};

Result<std::vector<NoisyPicture>> take_pictures(const std::vector<BenchPicture>& pictures, const BenchLight& light,
                                                int frames, Executor& executor) {
  const NamedSensor camera = bench_camera();
  const double dark_e = dark_mean_e(camera.model, light.exposure())[1];
  std::vector<NoisyPicture> out;
  out.reserve(pictures.size() * static_cast<std::size_t>(frames));
  for (const BenchPicture& picture : pictures) {
    const auto source = capture::SyntheticSource::of(bench_scene(picture, light.white_cd_m2), camera, bench_response(),
                                                     {.exposure = light.exposure()}, executor);
    if (!source) return tl::make_unexpected(source.error());
    for (int i = 0; i < frames; ++i) {
      NoisyPicture shot{source->frame(static_cast<std::uint32_t>(i), executor).raw};
      shot.black_dn.fill(camera.model.black_level_dn + camera.model.system_gain_dn_per_e * dark_e);
      out.push_back(std::move(shot));
    }
  }
  return out;
}

/// Returns the noise of a pixel without light [e-], including patterns of the dark, which one frame cannot separate
/// from noise.
double lightless_noise_e(const SensorModel& s, const Exposure& exposure) {
  const double dark_e = dark_mean_e(s, exposure)[1];
  return std::sqrt(s.read_noise_e * s.read_noise_e + s.row_noise_e * s.row_noise_e +
                   s.column_noise_e * s.column_noise_e + dark_e + std::pow(s.dsnu * dark_e, 2));
}

FitErrors errors_in(const std::vector<NoisyPicture>& shots, double lightless_e, const calib::PictureNoiseOptions& how) {
  const double k = bench_camera().model.system_gain_dn_per_e;
  InlineExecutor one;
  FitErrors errors;
  for (const NoisyPicture& shot : shots) {
    const auto found = calib::fit_picture_noise(shot.raw, shot.black_dn, how, one);
    if (!found) {
      ++errors.refused;
      continue;
    }
    errors.gain_square += std::pow(found->gain_dn_per_e.value / k - 1, 2);
    errors.stated_square += std::pow(found->gain_dn_per_e.standard_error / k, 2);
    const double noise_e = std::sqrt(std::max(0.0, found->offset_dn2.value - quantisation_dn2)) / k;
    errors.noise_square += std::pow(noise_e / lightless_e - 1, 2);
    ++errors.fits;
  }
  return errors;
}

struct PictureWay {
  std::string name;
  calib::PictureNoiseOptions how;
};

std::vector<PictureWay> picture_ways(bool quick) {
  using calib::PictureNoiseMethod;
  if (quick)
    return {{"blocks, all", {PictureNoiseMethod::ponomarenko, 400'000}},
            {"details, all", {PictureNoiseMethod::foi, 400'000}}};
  return {{"blocks, 1000", {PictureNoiseMethod::ponomarenko, 1000}},
          {"blocks, all", {PictureNoiseMethod::ponomarenko, 400'000}},
          {"details, 30000", {PictureNoiseMethod::foi, 30'000}},
          {"details, all", {PictureNoiseMethod::foi, 400'000}}};
}

/// Measures a light's images by each method; methods for which no image was suitable are reported in the remarks.
Result<void> measure_pictures(const std::vector<BenchPicture>& pictures, const BenchLight& light,
                              const BenchOptions& options, StageRows& rows, std::vector<std::string>& remarks) {
  PoolExecutor executor(options.threads);
  auto taken = take_pictures(pictures, light, options.quick ? 1 : 3, executor);
  if (!taken) return tl::make_unexpected(taken.error());
  const auto shots = std::make_shared<const std::vector<NoisyPicture>>(*std::move(taken));
  const double lightless_e = lightless_noise_e(bench_camera().model, light.exposure());
  AccuracyGroup group{fmt::format("one image, {}", light.name), gain_error, {}};
  const std::vector<PictureWay> ways = picture_ways(options.quick);
  std::vector<std::vector<double>> figures;
  figures.reserve(ways.size());
  for (const PictureWay& way : ways) {
    const FitErrors errors = errors_in(*shots, lightless_e, way.how);
    if (errors.fits == 0) {
      remarks.push_back(fmt::format("{}, {}: refused of all {} frames", light.name, way.name, errors.refused));
      continue;
    }
    figures.push_back({errors.noise(), errors.told(), 1.0 * errors.refused, 1.0 * errors.fits});
    const auto fit_first = [shots, how = way.how] {
      InlineExecutor one;
      (void)calib::fit_picture_noise(shots->front().raw, shots->front().black_dn, how, one);
    };
    group.levels.push_back({way.name, errors.gain(), fit_first, 1});
  }
  rows.add(group, std::move(figures), timing_of(options));
  return {};
}

}  // namespace

Result<BenchOutcome> run_noise_fit_bench(const BenchOptions& options) {
  InlineExecutor one;
  const auto pictures =
      options.quick ? read_bench_pictures(options, 448, 320, 1, one) : read_bench_pictures(options, 768, 512, 0, one);
  if (!pictures) return tl::make_unexpected(pictures.error());
  StageRows rows{.further = {"error of the dark noise", "stated standard error of the gain", "refused", "measured"}};
  std::vector<Finding> findings;
  std::vector<std::string> left_out;
  if (const auto done = measure_flats(options, rows, findings); !done) return tl::make_unexpected(done.error());
  const auto lights = std::span(bench_lights).first(options.quick ? 1 : 2);  // the last light contains little but noise
  for (const BenchLight& light : lights) {
    const auto done = measure_pictures(*pictures, light, options, rows, left_out);
    if (!done) return tl::make_unexpected(done.error());
    options.advance(0.5 / static_cast<double>(lights.size()), light.name);
  }
  BenchOutcome out = outcome_of("noise-fit", rows, TimeOf::whole);
  out.findings = std::move(findings);
  out.remarks = {fmt::format("The truth is that of the simulated sensor: {}. Errors are relative RMS errors over this "
                             "number of measurements; dark noise is all temporal noise without light",
                             bench_camera().model.name),
                 fmt::format("Photon transfer: pairs of flats at {} light levels up to {:g} of full well, and darks; "
                             "each measurement has new noise and a new fixed pattern",
                             fractions_of_full.size(), fractions_of_full.back()),
                 fmt::format("One image: {} images, {} frames of each; very fine texture increases the gain, which the "
                             "standard error does not include; the time is that of the first image",
                             name_of(options.pictures), options.quick ? 1 : 3),
                 "Times are those of one measurement on frames in memory; memcpy copies a megapixel of floats",
                 timing_remark(timing_of(options), 1)};
  std::ranges::move(left_out, std::back_inserter(out.remarks));
  return out;
}

}  // namespace lowlux::isp
