#pragma once

#include <cstdint>
#include <span>

#include "capture/synthetic/scene.h"
#include "isp/base/cfa.h"
#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/sensor.h"
#include "isp/model/spectrum/spectral_lift.h"

namespace lowlux::capture {

/// Mean electrons per second under each pixel's own filter, height x width.
struct SensorLight {
  Plane<float> e_per_s;          // without the blur of the lens
  Plane<float> blurred_e_per_s;  // with it; empty: there is none
};

/// Returns the light that three colours give to a mosaic, with and without the blur of a lens.
/// @param blur_px see LensBlur; above 0
SensorLight light_through_lens(CameraRgb e_per_s, BayerPhase phase, double blur_px, Executor& executor);

/// Effect of a scene's light in a sensor, before any noise.
struct ChargeRate {
  Plane<float> e_per_s;           // height x width: mean electrons per second under each pixel's own filter
  std::int64_t moved_pixels = 0;  // number whose colour no light can have; moved towards white until one can
};

/// Computes patches and points by the integrals of their spectra, lifted colours by the table.
/// @param table table of the response; may be null for a scene of patches
ChargeRate charge_rate(const Scene& scene, const SpectralResponse& response, const isp::LiftTable* table,
                       BayerPhase phase, Executor& executor);

/// Computes the charge rate under all three filters at every pixel: the noise-free truth of a demosaiced,
/// black-subtracted frame [e- per s].
/// @param moved_pixels if not null, set to ChargeRate::moved_pixels
CameraRgb charge_rate_rgb(const Scene& scene, const SpectralResponse& response, const isp::LiftTable* table,
                          Executor& executor, std::int64_t* moved_pixels = nullptr);

/// The functions below add points at their positions: to charge rates under each pixel's own filter, under all three
/// filters at every pixel [e- per s], and to colours as XYZ [cd/m2].
/// @param lights radiances at 1 cd/m2, see Scene::point_lights
void add_points(std::span<const PointSource> points, std::span<const Spectrum> lights, const SpectralResponse& response,
                BayerPhase phase, Plane<float>& e_per_s);
void add_points(std::span<const PointSource> points, std::span<const Spectrum> lights, const SpectralResponse& response,
                CameraRgb& e_per_s);
void add_points(std::span<const PointSource> points, std::span<const Spectrum> lights, SceneLinear& xyz_cd_m2);

}  // namespace lowlux::capture
