// What accuracy costs in time, for each estimator of a camera's figures: root mean square error against the simulated
// truth over several seeds, the standard error the estimator itself reports, and the processor time of the estimate
// (reading frames from files excluded). Errors fall with the root of the pixels, time grows with them.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "calib/chart/colour_fit.h"
#include "calib/dark/dark_series.h"
#include "calib/dark/dark_stack.h"
#include "calib/dark/dark_temperature.h"
#include "calib/flat/pair_statistics.h"
#include "calib/flat/photon_transfer.h"
#include "calib/profile/gain_profile.h"
#include "capture/synthetic/fixed_pattern.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/spectrum/cie_data.h"
#include "tests/bench/measure/measure.h"
#include "tests/sensor_bench/sensor_bench.h"

namespace {

using namespace lowlux;
using namespace test;

/// Errors of one estimator at one cost.
struct Row {
  double squares = 0, reported = 0, ms = 0;
  int n = 0;
  void add(const Estimate& found, double truth) {
    squares += (found.value - truth) * (found.value - truth);
    reported += found.standard_error;
    ++n;
  }
  void print(const char* estimator, const std::string& cost, const char* unit, int runs) const {
    std::printf("%-26s %-34s %11.4g %11.4g %-6s %9.2f\n", estimator, cost.c_str(), std::sqrt(squares / n), reported / n,
                unit, ms / runs);
  }
};

template <class Work>
auto timed(double& ms, const Work& work) {
  const double start = cpu_ms();
  auto out = work();
  ms += cpu_ms() - start;
  return out;
}

std::string pixels_text(int side) { return std::to_string(side / 2 * (side / 2)) + " pixels a site"; }

/// Black of masked pixels: 200 e- of dark charge, 4 e- of read noise.
void black_rows(int seeds) {
  SensorModel sensor = modern_small();
  sensor.read_noise_e = 4;
  sensor.system_gain_dn_per_e = 2;
  sensor.full_well_e = 1800;
  sensor.dark_current_e_per_s = {200, 200, 200};
  for (const int side : {64, 144, 448, 1024}) {
    Row row;
    for (int seed = 1; seed <= seeds; ++seed) {
      const SensorBench bench{
          .sensor = sensor, .width = side, .height = side, .seed = static_cast<std::uint64_t>(seed)};
      const RawDn frame = bench.frame({1, 20}, 0);
      const auto found = timed(row.ms, [&] { return calib::measure_black(frame); });
      for (const Estimate& level : found->level_dn) {
        row.add({(level.value - sensor.black_level_dn) / 2 - 200, level.standard_error / 2}, 0);
      }
    }
    row.print("black, one frame", pixels_text(side), "e-", seeds);
  }
}

std::vector<calib::DarkGroup> darks(const SensorBench& bench, int frames, double& ms) {
  std::vector<calib::DarkGroup> out;
  std::uint32_t index = 0;
  for (const double time_s : {0.0, 20.0, 60.0}) {
    calib::DarkStack stack;
    for (int i = 0; i < frames; ++i) {
      const RawDn frame = bench.frame({time_s, 20}, index++);
      timed(ms, [&] { return stack.add(frame); });
    }
    out.push_back(timed(ms, [&] { return std::move(*stack.group()); }));
  }
  return out;
}

void dark_rows(int seeds) {
  const SensorModel sensor = modern_small();
  const Estimate gain{sensor.system_gain_dn_per_e, 0};
  for (const auto& [side, frames] : {std::pair(128, 2), std::pair(128, 8), std::pair(512, 2), std::pair(512, 8)}) {
    Row current, system_gain;
    for (int seed = 1; seed <= seeds; ++seed) {
      const SensorBench bench{
          .sensor = sensor, .width = side, .height = side, .seed = static_cast<std::uint64_t>(seed)};
      double stacking_ms = 0;
      const auto groups = darks(bench, frames, stacking_ms);
      const auto found = timed(current.ms, [&] { return calib::fit_dark_series(groups, gain); });
      current.ms += stacking_ms;
      for (int k = 0; k < 3; ++k) {
        current.add(found->currents[0].current_e_per_s[k], sensor.dark_current_e_per_s[k]);
      }
      const auto of_darks = timed(system_gain.ms, [&] { return calib::gain_of_darks(groups); });
      system_gain.ms += stacking_ms;
      if (of_darks) system_gain.add(*of_darks, sensor.system_gain_dn_per_e);
    }
    const std::string cost = pixels_text(side) + ", 3 x " + std::to_string(frames) + " darks";
    current.print("dark current", cost, "e-/s", seeds);
    if (system_gain.n > 0) system_gain.print("system gain of darks", cost, "DN/e-", seeds);
  }
}

void transfer_rows(int seeds) {
  const SensorModel sensor = modern_small();
  const double fill = isp::saturation_charge_e(sensor);
  for (const auto& [side, levels] : {std::pair(64, 6), std::pair(256, 6), std::pair(256, 24), std::pair(512, 24)}) {
    Row gain, read_noise;
    for (int seed = 1; seed <= seeds; ++seed) {
      SensorBench bench{.sensor = sensor, .width = side, .height = side, .seed = static_cast<std::uint64_t>(seed)};
      std::vector<calib::PairStatistics> dark_pairs, flats;
      std::uint32_t index = 0;
      const auto pair = [&](double time_s) {
        const RawDn a = bench.frame({time_s, 20}, index), b = bench.frame({time_s, 20}, index + 1);
        index += 2;
        return timed(gain.ms, [&] { return *calib::measure_pair(a, b); });
      };
      for (int i = 0; i < 4; ++i) dark_pairs.push_back(pair(0));
      bench.rate_e_per_s = {fill, fill, fill};
      for (int i = 1; i <= levels; ++i) flats.push_back(pair(0.65 * i / levels));
      const auto found = timed(gain.ms, [&] { return calib::fit_photon_transfer(dark_pairs, flats); });
      gain.add(found->system_gain_dn_per_e, sensor.system_gain_dn_per_e);
      read_noise.add(*found->read_noise_e, sensor.read_noise_e);
    }
    read_noise.ms = gain.ms;
    const std::string cost = pixels_text(side) + ", " + std::to_string(levels) + " levels";
    gain.print("system gain of flats", cost, "DN/e-", seeds);
    read_noise.print("read noise of flats", cost, "e-", seeds);
  }
}

/// Pixels 8 standard deviations of one frame above the others: share of them that is found, and of those found that
/// are.
void hot_rows() {
  SensorModel sensor = modern_small();
  sensor.hot_pixel_fraction = 0.002;
  sensor.hot_pixel_current_e_per_s = 100;
  std::printf("\n%-26s %-34s %11s %11s %-6s %9s\n", "finder", "cost", "recall", "precision", "", "cpu ms");
  for (const int frames : {2, 4, 16}) {
    const SensorBench bench{.sensor = sensor, .width = 512, .height = 512};
    std::vector<calib::DarkGroup> groups;
    double ms = 0;
    std::uint32_t index = 0;
    for (const double time_s : {0.0, 10.0}) {
      calib::DarkStack stack;
      for (int i = 0; i < frames; ++i) {
        const RawDn frame = bench.frame({time_s, 20}, index++);
        timed(ms, [&] { return stack.add(frame); });
      }
      groups.push_back(timed(ms, [&] { return std::move(*stack.group()); }));
    }
    const auto found = timed(ms, [&] { return *calib::fit_dark_series(groups, {sensor.system_gain_dn_per_e, 0}); });
    double truth = 0, both = 0;
    for (int y = 0; y < bench.height; ++y) {
      std::vector<float> charge(bench.width, 0);
      std::vector<std::uint32_t> scratch(bench.width);
      capture::add_hot_pixels({bench.seed, 0, static_cast<std::uint32_t>(y)}, sensor.hot_pixel_fraction,
                              sensor.hot_pixel_current_e_per_s * 10, charge, scratch);
      for (int x = 0; x < bench.width; ++x) {
        const double dark_e = 10 * sensor.dark_current_e_per_s[static_cast<int>(colour_at(bench.phase, x, y))];
        if (charge[x] <= 8 * std::sqrt(dark_e + sensor.read_noise_e * sensor.read_noise_e + 0.38)) continue;
        ++truth;
        both += std::ranges::any_of(found.hot, [&](const calib::HotPixel& hot) { return hot.x == x && hot.y == y; });
      }
    }
    const std::string cost = "512 x 512, 2 x " + std::to_string(frames) + " darks";
    std::printf("%-26s %-34s %11.4f %11.4f %-6s %9.2f\n", "hot pixels", cost.c_str(), both / truth,
                both / static_cast<double>(found.hot.size()), "", ms);
  }
}

/// A linear camera and a ColorChecker under D65: mean CIEDE2000 of noise-free patches under a matrix fitted to noisy
/// ones.
void colour_rows(int seeds) {
  const Spectrum light = *isp::light_named("D65");
  const auto references = *calib::chart_reference(light);
  const Matrix3 to_camera{{{0.83, 0.32, -0.12}, {-0.42, 1.23, 0.21}, {-0.04, 0.16, 0.67}}};
  const auto white = *isp::xyz_of(isp::white_d65);
  std::printf("\n%-26s %-34s %11s %11s %-6s %9s\n", "fit", "cost", "mean error", "left out", "unit", "cpu ms");
  for (const double relative : {0.03, 0.01, 0.003}) {
    double error = 0, left_out = 0, ms = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
      std::mt19937_64 engine(static_cast<std::uint64_t>(seed));
      std::normal_distribution<double> normal(0, relative);
      std::vector<calib::ColourSample> clean, noisy;
      for (std::size_t i = 0; i < references.size(); ++i) {
        const Vector3 camera = to_camera * isp::vector_of(references[i]);
        const std::size_t column = i % 6, row = i / 6;
        const double x = static_cast<double>(column) / 2.5 - 1, y = static_cast<double>(row) / 1.5 - 1;
        clean.push_back({camera, references[i], x, y});
        const Vector3 off{camera[0] * (1 + normal(engine)), camera[1] * (1 + normal(engine)),
                          camera[2] * (1 + normal(engine))};
        noisy.push_back({off, references[i], x, y});
      }
      const calib::ColourFitOptions options{.white = white};
      const auto fit = timed(ms, [&] { return *calib::fit_colour(noisy, options); });
      error += calib::summary_of(calib::colour_errors(fit, clean, white)).mean / seeds;
      left_out += calib::summary_of(*calib::cross_validated(noisy, options)).mean / seeds;
    }
    char cost[40];
    std::snprintf(cost, sizeof cost, "24 patches known to %.1f %%", 100 * relative);
    std::printf("%-26s %-34s %11.3f %11.3f %-6s %9.2f\n", "colour matrix", cost, error, left_out, "dE00", ms / seeds);
  }
}

}  // namespace

int lowlux::test::measure_calibration(Arguments& arguments) {
  const int seeds = arguments.option("--seeds", 8, 4);
  arguments.end();
  std::printf("%-26s %-34s %11s %11s %-6s %9s\n", "estimator", "cost", "rms error", "reported", "unit", "cpu ms");
  black_rows(seeds);
  dark_rows(seeds);
  transfer_rows(seeds);
  hot_rows();
  colour_rows(seeds);
  return 0;
}
