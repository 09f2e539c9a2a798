#include "tests/sensor_bench/sensor_bench.h"

#include <cmath>

#include "isp/base/executor.h"
#include "isp/model/sensor/noise_source_plan.h"

namespace lowlux::test {

RawDn SensorBench::frame(const isp::Exposure& exposure, std::uint32_t index) const {
  Plane<float> rate(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double light = 1 - shading * (static_cast<double>(x) / width - 0.5);
      rate.at(x, y) = static_cast<float>(light * rate_e_per_s[static_cast<int>(colour_at(phase, x, y))]);
    }
  }
  isp::NoiseSourcePlan plan;
  plan.regions.resize(1);  // one region that keeps every effect
  const auto blocks = [](int pixels) { return (pixels + isp::effect_block - 1) / isp::effect_block; };
  plan.region_of_block.assign(static_cast<std::size_t>(blocks(width)) * blocks(height), 0);
  RawDn raw;
  raw.dn = Plane<std::uint16_t>(width, height);
  InlineExecutor executor;
  capture::read_out({.sensor = sensor,
                     .exposure = exposure,
                     .phase = phase,
                     .rate_e_per_s = rate.view(),
                     .seed = seed,
                     .pattern_seed = seed,
                     .frame = index},
                    plan, executor, raw.dn.view());
  raw.phase = phase;
  raw.active = raw.default_crop = {0, 0, width, height};
  raw.white_dn = {sensor.white_level_dn, sensor.white_level_dn, sensor.white_level_dn};
  raw.info.make = "Bench";
  raw.info.model = sensor.name;
  raw.info.exposure_s = exposure.time_s;
  raw.info.temperature_c = exposure.temperature_c;
  return raw;
}

SensorModel thesis_like() {
  return {.name = "thesis-like",
          .system_gain_dn_per_e = 0.0266,
          .read_noise_e = 4,
          .full_well_e = 9000,
          .bits = 8,
          .black_level_dn = 8.3,
          .white_level_dn = 255,
          .quantisation = Quantisation::floor,
          .dark_current_e_per_s = {195, 230, 218}};
}

SensorModel modern_small() {
  return {.name = "modern small",
          .system_gain_dn_per_e = 0.47,
          .read_noise_e = 1.5,
          .full_well_e = 7900,
          .bits = 12,
          .black_level_dn = 256.3,
          .white_level_dn = 4095,
          .dark_current_e_per_s = {0.6, 0.8, 0.7},
          .prnu = 0.008};
}

SensorModel modern_large() {
  return {.name = "modern large",
          .system_gain_dn_per_e = 0.251,
          .read_noise_e = 3.5,
          .full_well_e = 60000,
          .bits = 14,
          .black_level_dn = 512,
          .white_level_dn = 16383,
          .dark_current_e_per_s = {0.05, 0.06, 0.05},
          .prnu = 0.005};
}

SensorModel column_noise_sensor() {
  return {.name = "column noise",
          .system_gain_dn_per_e = 1.1,
          .read_noise_e = 2.5,
          .full_well_e = 3300,
          .bits = 12,
          .black_level_dn = 300.4,
          .white_level_dn = 4095,
          .dark_current_e_per_s = {8, 10, 9},
          .row_noise_e = 0.8,
          .column_noise_e = 1.5};
}

SensorModel hot_sensor() {
  return {.name = "hot",
          .system_gain_dn_per_e = 0.8,
          .read_noise_e = 2,
          .full_well_e = 15000,
          .bits = 14,
          .black_level_dn = 512.2,
          .white_level_dn = 16383,
          .dark_current_e_per_s = {4, 5, 4.5},
          .prnu = 0.01,
          .dsnu = 0.2,
          .hot_pixel_fraction = 0.002,
          .hot_pixel_current_e_per_s = 300};
}

SensorModel range_limited() {
  return {.name = "range limited",
          .system_gain_dn_per_e = 4,
          .read_noise_e = 1.2,
          .full_well_e = 15000,
          .bits = 12,
          .black_level_dn = 200,
          .white_level_dn = 4095,
          .dark_current_e_per_s = {0.5, 0.5, 0.5}};
}

}  // namespace lowlux::test
