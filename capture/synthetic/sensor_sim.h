#pragma once

#include <cstdint>
#include <optional>

#include "capture/synthetic/photon_rows.h"
#include "isp/base/cfa.h"
#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/base/sensor.h"
#include "isp/model/sensor/amplifier_glow.h"
#include "isp/model/sensor/noise_source_plan.h"

namespace lowlux::capture {

/// Inputs of one readout of a sensor.
struct SensorFrame {
  const SensorModel& sensor;
  isp::Exposure exposure;
  BayerPhase phase = BayerPhase::rggb;
  PlaneView<const float> rate_e_per_s;  // height x width, see charge_rate; without the blur of the lens
  const PhotonRows* photons = nullptr;  // set: published photon sampling, else physical
  std::uint64_t seed = 0;               // seed of the noise that is drawn for each frame
  std::uint64_t pattern_seed = 0;       // seed of the fixed pattern: PRNU, DSNU, hot pixels, columns
  std::uint32_t frame = 0;
  int masked_columns = 0;                       // at the left: light-shielded, without crosstalk
  PlaneView<const float> blurred_e_per_s = {};  // rates with the blur of the lens, of equal size; empty: without blur

  bool has_lens_blur() const { return blurred_e_per_s.data != nullptr; }
};

/// Reads out the frame in DN, as floats in the form the plan keeps: integers where quantisation is kept, signed values
/// where clipping is not. The same for every number of threads and every processor.
/// @param plan blocks of isp::effect_block over rate_e_per_s, row by row
/// @param dn   as large as rate_e_per_s
void read_out(const SensorFrame& frame, const isp::NoiseSourcePlan& plan, Executor& executor, PlaneView<float> dn);

/// Reads out the frame as codes, for a plan whose regions all keep quantisation and clipping.
void read_out(const SensorFrame& frame, const isp::NoiseSourcePlan& plan, Executor& executor,
              PlaneView<std::uint16_t> dn);

/// Returns the amplifier glow of the frame.
isp::AmplifierGlow glow_of(const SensorFrame& frame);

/// Time of reading out with all effects, and the time saved by each effect that the plan leaves out [ms per frame],
/// measured on up to 128 rows and scaled to the frame; nullopt for effects the plan keeps everywhere or the sensor does
/// not have.
struct EffectCost {
  double all_ms = 0;
  std::array<std::optional<double>, isp::effect_count> saved_ms;
};
EffectCost measure_cost(const SensorFrame& frame, const isp::NoiseSourcePlan& plan);

}  // namespace lowlux::capture
