#pragma once

#include <cstdint>
#include <optional>

#include "capture/synthetic/photon_rows.h"
#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/base/sensor.h"
#include "isp/base/spectrum.h"
#include "isp/model/sensor/noise_source_plan.h"
#include "isp/model/sensor/sensor_db.h"

namespace lowlux::capture {

/// Choice of the simulated effects: those required by a tolerance, or those given.
struct NoiseSourceChoice {
  std::optional<isp::Tolerance> tolerance;                   // set: the planner decides
  isp::NoiseSourceSet effects = isp::NoiseSourceSet::all();  // used without a tolerance
};

/// Holds the options of a simulated camera.
struct SyntheticOptions {
  isp::Exposure exposure;
  double f_number = 2;
  BayerPhase phase = BayerPhase::rggb;
  int masked_columns = 0;   // light-shielded, left of the image; even
  double lens_blur_px = 0;  // standard deviation of the lens's point spread function, see LensBlur; 0: no blur
  PhotonSampling sampling = PhotonSampling::physical;
  NoiseSourceChoice effects;
  std::uint64_t seed = 1;         // seed of the noise: frames of one seed and index have the same noise, for any scene
  std::uint64_t sensor_seed = 1;  // seed of the fixed pattern: selects the specimen of the sensor

  /// Returns the blur of the lens in frames and in their truth: none if it is not among the effects.
  double simulated_blur_px() const {
    return effects.tolerance || effects.effects.has(isp::Effect::lens_blur) ? lens_blur_px : 0;
  }
};

/// A camera without a scene: its sensor, its options, and what its files state about colour and speed.
struct SyntheticCamera {
  isp::NamedSensor sensor;
  SyntheticOptions options;
  CameraColour colour;    // matrices for A and D65 fitted to the sensitivities, and the neutral of `white`
  Matrix3 camera_to_xyz;  // matrix of white-balanced camera RGB, for that neutral
  double iso = 0;         // speed at which exposure, f-number and saturation agree (ISO 12232)
};

/// Makes a camera whose white balance is that of a white.
/// @param white radiance of a white diffuser in the scene
/// Errors: an invalid sensor or exposure; masked columns that are odd, negative or more than 4096; a tolerance that is
/// not above 0, or with published sampling, which the planner does not support; crosstalk or lens blur with published
/// sampling; a lens blur outside 0..max_lens_blur_px; an f-number outside 0.5..1000.
Result<SyntheticCamera> make_camera(isp::NamedSensor sensor, const SpectralResponse& response, const Spectrum& white,
                                    const SyntheticOptions& options);

}  // namespace lowlux::capture
