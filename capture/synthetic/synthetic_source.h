#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "capture/synthetic/exposed_scene.h"
#include "capture/synthetic/scene.h"
#include "capture/synthetic/sensor_sim.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/model/sensor/noise_source_plan.h"
#include "isp/model/sensor/sensor_db.h"

namespace lowlux::capture {

/// Choice of the simulated effects: those required by a tolerance, or those given.
struct NoiseSourceChoice {
  std::optional<isp::Tolerance> tolerance;                   // set: the planner decides
  isp::NoiseSourceSet effects = isp::NoiseSourceSet::all();  // used without a tolerance
};

struct SyntheticOptions {
  isp::Exposure exposure;
  double f_number = 2;
  BayerPhase phase = BayerPhase::rggb;
  int masked_columns = 0;  // light-shielded, left of the image; even
  PhotonSampling sampling = PhotonSampling::physical;
  NoiseSourceChoice effects;
  std::uint64_t seed = 1;         // of the noise: frames of one seed and index have the same noise, for any scene
  std::uint64_t sensor_seed = 1;  // of the fixed pattern: selects the specimen of the sensor
};

/// A camera in front of a scene. Values common to all frames are computed once, by of().
class SyntheticSource {
 public:
  /// Makes a source. Errors: an invalid exposure; a mean charge beyond the sampler's limit without a full well to bound
  /// it; point sources with published sampling, or more photons in one of its bins than the sampler's limit; masked
  /// columns that are odd, negative or more than 4096; a tolerance that is not above 0, or with published sampling,
  /// which the planner does not support; an f-number outside 0.5..1000; point sources without position or spread.
  static Result<SyntheticSource> of(Scene scene, isp::NamedSensor sensor, SpectralResponse response,
                                    const SyntheticOptions& options, Executor& executor);

  /// Returns frame number `index`: the same scene and fixed pattern, its own noise. Any index, in any order. A file
  /// holds the converter's integer codes, which cost no time: quantisation and clipping that the planner would leave
  /// out are kept (file_plan). For a caller that leaves them out, see Storage.
  RawFrame frame(std::uint32_t index, Executor& executor) const;

  /// Returns a frame in DN as floats, before storage: the output of the converter.
  Plane<float> frame_dn(std::uint32_t index, Executor& executor) const;

  /// Return the noise-free truth: mean signal electrons of R, G, B at every pixel, and the scene's XYZ [cd/m2].
  CameraRgb signal_e(Executor& executor) const;
  SceneLinear xyz_cd_m2() const;

  /// Return the effects simulated by frame_dn() and by frame().
  const isp::NoiseSourcePlan& plan() const { return plan_; }
  const isp::NoiseSourcePlan& file_plan() const { return file_plan_; }
  const Plane<float>& rate_e_per_s() const { return rate_.e_per_s; }
  std::int64_t moved_pixels() const { return rate_.moved_pixels; }
  const isp::Developing& developing() const { return developing_; }
  EffectCost measure_cost() const;

 private:
  /// Storage of codes: code = round(scale * (dn + offset_dn)). Differs from 1 and 0 only if a caller leaves
  /// quantisation or clipping out: then 16 bits keep the fractions, and the pedestal is raised to keep negative values.
  struct Storage {
    int scale = 1;
    double offset_dn = 0;
    bool codes = true;  // the readout gives integer codes
  };

  SyntheticSource(Scene scene, isp::NamedSensor sensor, SpectralResponse response, const SyntheticOptions& options);
  Result<void> expose(Executor& executor);
  /// Returns the largest mean of a block's pixels, fixed pattern included [e-].
  double largest_mean_e(const isp::BlockLevel& block, isp::NoiseSourceSet kept) const;
  Result<void> check_means(const std::vector<isp::BlockLevel>& blocks) const;
  Result<void> check_photons(Executor& executor) const;
  void choose_storage();
  std::optional<NoiseProfile> noise_profile() const;
  template <class Code>
  void read_out_frame(std::uint32_t index, const isp::NoiseSourcePlan& plan, Executor& executor,
                      PlaneView<Code> out) const;
  SensorFrame sensor_frame(std::uint32_t index, const PhotonRows* photons) const;
  std::optional<PhotonRows> photon_rows() const;
  Plane<std::uint16_t> stored_codes(std::uint32_t index, Executor& executor) const;
  RawFrame described(Plane<std::uint16_t> codes) const;

  Scene scene_;
  isp::NamedSensor sensor_;
  SpectralResponse response_;
  SyntheticOptions options_;
  std::unique_ptr<isp::LiftTable> table_;  // for scenes whose spectra are lifted
  CameraColour colour_;
  ChargeRate rate_;
  isp::Developing developing_;
  isp::NoiseSourcePlan plan_;
  isp::NoiseSourcePlan file_plan_;
  Storage storage_;
};

}  // namespace lowlux::capture
