#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "capture/synthetic/exposed_scene.h"
#include "capture/synthetic/photon_rows.h"
#include "capture/synthetic/sensor_sim.h"
#include "capture/synthetic/synthetic_camera.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/model/sensor/noise_source_plan.h"

namespace lowlux::capture {

/// The sensor of a camera under one charge rate for one exposure time: plans the noise sources, and reads frames out.
/// The functions that take `photons` need it for published sampling, and a null pointer otherwise.
class ExposedSensor {
 public:
  /// Plans the noise sources of an exposure.
  /// @param light light of the image, without the masked columns
  /// Errors: a mean charge beyond the sampler's limit without a full well to bound it.
  static Result<ExposedSensor> of(SyntheticCamera camera, SensorLight light);

  /// Returns frame number `index`. Any index, in any order. Effects that cost no time are kept although the planner
  /// would leave them out (file_plan): quantisation and clipping, and the blur of the lens, which is in the truth. For
  /// a caller that leaves the converter out, see Storage.
  RawFrame frame(std::uint32_t index, const PhotonRows* photons, Executor& executor) const;

  /// Returns a frame in DN as floats, before storage: the output of the converter.
  Plane<float> frame_dn(std::uint32_t index, const PhotonRows* photons, Executor& executor) const;

  /// Return the effects simulated by frame_dn() and by frame().
  const isp::NoiseSourcePlan& plan() const { return plan_; }
  const isp::NoiseSourcePlan& file_plan() const { return file_plan_; }
  const SensorLight& light() const { return light_; }  // with the masked columns
  const isp::Developing& developing() const { return developing_; }
  EffectCost measure_cost(const PhotonRows* photons) const;

 private:
  /// Storage of codes: code = round(scale * (dn + offset_dn)). Differs from 1 and 0 only if a caller leaves
  /// quantisation or clipping out: then 16 bits keep the fractions, and the pedestal is raised to keep negative values.
  struct Storage {
    int scale = 1;
    double offset_dn = 0;
    bool codes = true;  // the readout gives integer codes
  };

  ExposedSensor(SyntheticCamera camera, SensorLight light);
  std::vector<isp::BlockLevel> plan_effects();
  /// Returns the largest mean of a block's pixels, fixed pattern included [e-].
  double largest_mean_e(const isp::BlockLevel& block, isp::NoiseSourceSet kept) const;
  Result<void> check_means(const std::vector<isp::BlockLevel>& blocks) const;
  void choose_storage();
  /// Returns the effects that the tags of a file describe.
  isp::NoiseSourceSet described_effects() const;
  std::optional<NoiseProfile> noise_profile() const;
  SensorFrame sensor_frame(std::uint32_t index, const PhotonRows* photons) const;
  Plane<std::uint16_t> stored_codes(std::uint32_t index, const PhotonRows* photons, Executor& executor) const;
  RawFrame described(Plane<std::uint16_t> codes) const;

  SyntheticCamera camera_;
  SensorLight light_;
  isp::Developing developing_;
  isp::NoiseSourcePlan plan_;
  isp::NoiseSourcePlan file_plan_;
  Storage storage_;
};

}  // namespace lowlux::capture
