#pragma once

#include <cstdint>
#include <optional>

#include "capture/synthetic/photon_rows.h"
#include "isp/base/cfa.h"
#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/base/sensor.h"
#include "isp/model/sensor/effect_plan.h"

namespace lowlux::capture {

/// One readout of a sensor: everything but the random numbers' kernel.
struct SensorFrame {
  const SensorModel& sensor;
  isp::Exposure exposure;
  BayerPhase phase = BayerPhase::rggb;
  PlaneView<const float> rate_e_per_s;  // height x width, see charge_rate
  const PhotonRows* photons = nullptr;  // set: published photon sampling, else physical
  std::uint64_t seed = 0;               // of what is drawn anew for each frame
  std::uint64_t pattern_seed = 0;       // of what the sensor keeps: PRNU, DSNU, hot pixels, columns
  std::uint32_t frame = 0;
};

/// Reads out the frame in DN, floats that hold what the plan keeps: whole codes where quantisation is, signed values
/// where nothing clips. The same for every number of threads and every processor.
/// @param plan blocks of isp::effect_block over rate_e_per_s, row by row
/// @param dn   as large as rate_e_per_s
void read_out(const SensorFrame& frame, const isp::EffectPlan& plan, Executor& executor, PlaneView<float> dn);

/// The same as codes, where every region of the plan keeps quantisation and clipping.
void read_out(const SensorFrame& frame, const isp::EffectPlan& plan, Executor& executor, PlaneView<std::uint16_t> dn);

/// What each block gives to the sensor in a time, row by row: what the planner asks for. A block that a channel does
/// not reach (frames one pixel wide) has the mean of the others there.
std::vector<isp::BlockLevel> block_levels(PlaneView<const float> rate_e_per_s, BayerPhase phase, double time_s);

/// How long reading out takes with all effects, and without each that the plan leaves out [ms per frame], measured on
/// up to 128 rows and scaled to the frame; nullopt for effects the plan keeps everywhere or the sensor has not.
struct EffectCost {
  double all_ms = 0;
  std::array<std::optional<double>, isp::effect_count> saved_ms;
};
EffectCost measure_cost(const SensorFrame& frame, const isp::EffectPlan& plan);

}  // namespace lowlux::capture
