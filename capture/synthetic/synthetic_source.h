#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "capture/synthetic/exposed_scene.h"
#include "capture/synthetic/exposed_sensor.h"
#include "capture/synthetic/photon_rows.h"
#include "capture/synthetic/scene.h"
#include "capture/synthetic/synthetic_camera.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/model/sensor/noise_source_plan.h"
#include "isp/model/sensor/sensor_db.h"

namespace lowlux::capture {

/// A camera in front of a scene. Values common to all frames are computed once, by of().
class SyntheticSource {
 public:
  /// Makes a source. Errors: those of make_camera and ExposedSensor::of; point sources without position or spread; with
  /// published sampling, point sources, or more photons in one bin of wavelengths than the sampler's limit.
  static Result<SyntheticSource> of(Scene scene, isp::NamedSensor sensor, SpectralResponse response,
                                    const SyntheticOptions& options, Executor& executor);

  /// Returns frame number `index`: the same scene and fixed pattern, its own noise. See ExposedSensor::frame.
  RawFrame frame(std::uint32_t index, Executor& executor) const;

  /// Returns a frame in DN as floats, before storage: the output of the converter.
  Plane<float> frame_dn(std::uint32_t index, Executor& executor) const;

  /// Return the noise-free truth, with the blur of the lens if that is simulated, and without crosstalk: mean signal
  /// electrons of R, G, B at every pixel, and the scene's XYZ [cd/m2].
  CameraRgb signal_e(Executor& executor) const;
  SceneLinear xyz_cd_m2(Executor& executor) const;

  /// Return the effects simulated by frame_dn() and by frame().
  const isp::NoiseSourcePlan& plan() const { return sensor_->plan(); }
  const isp::NoiseSourcePlan& file_plan() const { return sensor_->file_plan(); }
  const SensorLight& light() const { return sensor_->light(); }
  std::int64_t moved_pixels() const { return moved_pixels_; }
  const isp::Developing& developing() const { return sensor_->developing(); }
  EffectCost measure_cost() const;

 private:
  SyntheticSource(Scene scene, SpectralResponse response, const SyntheticOptions& options);
  Result<void> check_photons(Executor& executor) const;
  std::optional<PhotonRows> photon_rows() const;
  SensorLight exposed_light(Executor& executor);

  Scene scene_;
  SpectralResponse response_;
  SyntheticOptions options_;
  std::unique_ptr<isp::LiftTable> table_;  // for scenes whose spectra are lifted
  std::int64_t moved_pixels_ = 0;
  std::optional<ExposedSensor> sensor_;  // set by of()
};

}  // namespace lowlux::capture
