#pragma once

#include <cstdint>
#include <optional>
#include <vector>

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
  /// @param rate_e_per_s of the image, without the masked columns
  /// Errors: a mean charge beyond the sampler's limit without a full well to bound it.
  static Result<ExposedSensor> of(SyntheticCamera camera, Plane<float> rate_e_per_s);

  /// Returns frame number `index`. Any index, in any order. A file holds the converter's integer codes, which cost no
  /// time: quantisation and clipping that the planner would leave out are kept (file_plan). For a caller that leaves
  /// them out, see Storage.
  RawFrame frame(std::uint32_t index, const PhotonRows* photons, Executor& executor) const;

  /// Returns a frame in DN as floats, before storage: the output of the converter.
  Plane<float> frame_dn(std::uint32_t index, const PhotonRows* photons, Executor& executor) const;

  /// Return the effects simulated by frame_dn() and by frame().
  const isp::NoiseSourcePlan& plan() const { return plan_; }
  const isp::NoiseSourcePlan& file_plan() const { return file_plan_; }
  const Plane<float>& rate_e_per_s() const { return rate_e_per_s_; }  // with the masked columns
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

  ExposedSensor(SyntheticCamera camera, Plane<float> rate_e_per_s);
  std::vector<isp::BlockLevel> plan_effects();
  /// Returns the largest mean of a block's pixels, fixed pattern included [e-].
  double largest_mean_e(const isp::BlockLevel& block, isp::NoiseSourceSet kept) const;
  Result<void> check_means(const std::vector<isp::BlockLevel>& blocks) const;
  void choose_storage();
  std::optional<NoiseProfile> noise_profile() const;
  SensorFrame sensor_frame(std::uint32_t index, const PhotonRows* photons) const;
  Plane<std::uint16_t> stored_codes(std::uint32_t index, const PhotonRows* photons, Executor& executor) const;
  RawFrame described(Plane<std::uint16_t> codes) const;

  SyntheticCamera camera_;
  Plane<float> rate_e_per_s_;
  isp::Developing developing_;
  isp::NoiseSourcePlan plan_;
  isp::NoiseSourcePlan file_plan_;
  Storage storage_;
};

}  // namespace lowlux::capture
