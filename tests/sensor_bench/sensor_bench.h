#pragma once

#include <array>
#include <cstdint>

#include "capture/synthetic/sensor_sim.h"
#include "isp/base/frame.h"
#include "isp/base/sensor.h"
#include "isp/model/sensor/noise_budget.h"

namespace lowlux::test {

/// A simulated sensor on an optical bench: even light of a known rate, exposed as told.
struct SensorBench {
  SensorModel sensor;
  int width = 512;
  int height = 512;
  BayerPhase phase = BayerPhase::grbg;
  std::array<double, 3> rate_e_per_s{};  // of R, G, B
  double shading = 0;                    // by how much the light falls from the left edge to the right, relative
  std::uint64_t seed = 1;

  RawDn frame(const isp::Exposure& exposure, std::uint32_t index) const;
};

/// Six sensors whose figures are known.
SensorModel thesis_like();          // 8 bits, 35 e- per code: its darks are under-dithered
SensorModel modern_small();         // 12 bits, small pixels, 1.5 e- read noise
SensorModel modern_large();         // 14 bits, large pixels
SensorModel column_noise_sensor();  // strong fixed columns and temporal rows
SensorModel hot_sensor();           // DSNU and hot pixels
SensorModel range_limited();        // its converter ends before its pixels are full

}  // namespace lowlux::test
