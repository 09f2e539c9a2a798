// Noise of single pictures, simulated at four levels, against the sensor's own figures: behind a lens that spreads each
// point over a Gaussian, behind a sharper one and without any; both methods, and time against accuracy when samples are
// left out. Tuned on the first four pictures; the other four are for the figures only.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <vector>

#include "calib/picture/picture_noise.h"
#include "isp/base/executor.h"
#include "tests/bench/measure/measure.h"
#include "tests/sensor_bench/picture_raw.h"
#include "tests/sensor_bench/sensor_bench.h"

namespace {

using namespace lowlux;

struct Tally {
  int cases = 0;
  int refused = 0;
  int gain_missed = 0;    // by more than 10 %
  int offset_missed = 0;  // by more than 10 % and three standard errors
  double gain_square = 0;
  double ms = 0;
  double megapixels = 0;
};

struct Row {
  const test::PictureLight& light;
  const SensorModel& sensor;
  double mean_e = 0;
  bool print = true;
  std::uint64_t seed = 7;
};

void measure(const Row& row, const calib::PictureNoiseOptions& options, Executor& executor, Tally& tally) {
  const SensorModel& sensor = row.sensor;
  const RawDn raw = test::take_picture(row.light, sensor, {.mean_green_e = row.mean_e, .seed = row.seed}, executor);
  const double black = sensor.black_level_dn;
  const double start_ms = test::wall_ms();
  const auto found = calib::fit_picture_noise(raw, {black, black, black, black}, options, executor);
  tally.ms += test::wall_ms() - start_ms;
  tally.megapixels += 1e-6 * static_cast<double>(raw.dn.size());
  ++tally.cases;
  if (!found) {
    ++tally.refused;
    if (row.print)
      std::printf("%-15s %5g  refused: %s\n", row.light.name.c_str(), row.mean_e, found.error().message.c_str());
    return;
  }
  const double gain = sensor.system_gain_dn_per_e, read_dn = gain * sensor.read_noise_e;
  const double offset = read_dn * read_dn + 1.0 / 12;
  const double a = found->gain_dn_per_e.value / gain - 1, b = found->offset_dn2.value / offset - 1;
  const double b_error = found->offset_dn2.standard_error / offset;
  tally.gain_missed += std::abs(a) > 0.1 ? 1 : 0;
  tally.offset_missed += std::abs(b) > 0.1 && std::abs(b) > 3 * b_error ? 1 : 0;
  tally.gain_square += a * a;
  if (!row.print) return;
  std::printf("%-15s %5g  a %+6.1f %% +- %4.1f   b %+6.1f %% +- %5.1f   chi2 %4.2f  flat %4.2f  fine/coarse %4.2f\n",
              row.light.name.c_str(), row.mean_e, 100 * a, 100 * found->gain_dn_per_e.standard_error / gain, 100 * b,
              100 * b_error, found->reduced_chi_square, found->flat_fraction, found->traces.fine_to_coarse);
}

void print(const char* what, const Tally& t) {
  std::printf(
      "%s: %d cases, %d refused, a off by > 10 %% in %d, b by > 10 %% and 3 s.e. in %d, rms of a %.1f %%, "
      "%.0f ms/MP\n",
      what, t.cases, t.refused, t.gain_missed, t.offset_missed,
      100 * std::sqrt(t.gain_square / std::max(t.cases - t.refused, 1)), t.ms / t.megapixels);
}

using Lights = std::vector<test::PictureLight>;

Lights lights_behind(double lens_sigma_px, Executor& executor) {
  Lights out;
  for (const char* name : test::clean_pictures) {
    out.push_back(test::value_of(test::picture_light(name, executor, lens_sigma_px)));
  }
  return out;
}

struct Run {
  const char* what = "";
  const Lights& lights;
  SensorModel sensor;
  calib::PictureNoiseOptions options{};
  bool rows = false;
  std::uint64_t seed = 7;
};

void run(const Run& r, Executor& executor) {
  Tally tally;
  for (const auto& light : r.lights) {
    for (const double mean_e : {4.0, 10.0, 25.0, 100.0}) {
      measure({light, r.sensor, mean_e, r.rows, r.seed}, r.options, executor, tally);
    }
  }
  print(r.what, tally);
}

}  // namespace

int lowlux::test::measure_picture_noise(Arguments& arguments) {
  arguments.end();
  PoolExecutor executor(1);
  using calib::PictureNoiseMethod;
  SensorModel clipping = test::modern_small();
  clipping.name = "clipped at black";
  clipping.black_level_dn = 0;
  clipping.system_gain_dn_per_e = 1.6;
  clipping.read_noise_e = 2.2;
  const std::initializer_list<SensorModel> sensors{test::modern_small(), test::modern_large(), clipping};
  for (const double sigma_px : {0.9, 0.6, 0.0}) {
    const Lights lights = lights_behind(sigma_px, executor);
    std::printf("\nlens of sigma %g px\n", sigma_px);
    for (const SensorModel& sensor : sensors) {
      std::printf("\n%s\n", sensor.name.c_str());
      run({"ponomarenko", lights, sensor, {}, true}, executor);
      if (sigma_px == 0.6) continue;
      run({"foi", lights, sensor, {.method = PictureNoiseMethod::foi}}, executor);
    }
  }
  const Lights lights = lights_behind(0.9, executor);
  std::printf("\nlens of sigma 0.9 px, other draws\n");
  for (const std::uint64_t seed : {8, 9}) {
    for (const SensorModel& sensor : sensors) run({sensor.name.c_str(), lights, sensor, {}, false, seed}, executor);
  }
  std::printf("\nlens of sigma 0.9 px, modern small, fewer samples\n");
  for (const std::int64_t samples : {4000, 2000, 1000}) {
    std::printf("%6d ", static_cast<int>(samples));
    run({"ponomarenko", lights, test::modern_small(), {.max_samples = samples}}, executor);
  }
  return 0;
}
