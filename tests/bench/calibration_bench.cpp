// What accuracy costs in time, for each estimator of a camera's figures: root mean square error against the simulated
// truth over several seeds, the standard error the estimator itself reports, and the processor time of the estimate
// (reading frames from files excluded). Errors fall with the root of the pixels, time grows with them.
//   calibration_bench [--seeds N, at least 4]
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <utility>
#include <vector>

#include "calib/black_figures.h"
#include "calib/dark_gain.h"
#include "calib/dark_series.h"
#include "calib/dark_stack.h"
#include "calib/pair_statistics.h"
#include "calib/photon_transfer.h"
#include "tests/sensor_bench/sensor_bench.h"

namespace {

using namespace lowlux;
using test::SensorBench;

double cpu_clock_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

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
  const double start = cpu_clock_ms();
  auto out = work();
  ms += cpu_clock_ms() - start;
  return out;
}

std::string pixels_text(int side) { return std::to_string(side / 2 * (side / 2)) + " pixels a site"; }

/// Black of masked pixels: 200 e- of dark charge, 4 e- of read noise.
void black_rows(int seeds) {
  SensorModel sensor = test::modern_small();
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
  const SensorModel sensor = test::modern_small();
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
  const SensorModel sensor = test::modern_small();
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

}  // namespace

int main(int argc, char** argv) {
  int seeds = 8;
  if (argc == 3 && std::string(argv[1]) == "--seeds") seeds = std::atoi(argv[2]);
  if (seeds < 4 || (argc != 1 && argc != 3)) {
    std::fprintf(stderr, "usage: calibration_bench [--seeds N, at least 4]\n");
    return 2;
  }
  std::printf("%-26s %-34s %11s %11s %-6s %9s\n", "estimator", "cost", "rms error", "reported", "unit", "cpu ms");
  black_rows(seeds);
  dark_rows(seeds);
  transfer_rows(seeds);
  return 0;
}
