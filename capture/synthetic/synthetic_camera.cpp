#include "capture/synthetic/synthetic_camera.h"

#include <algorithm>
#include <string>
#include <utility>

#include "capture/synthetic/optics/lens_blur.h"
#include "isp/base/text.h"
#include "isp/model/colour/camera_colour.h"
#include "isp/model/colour/camera_matrix.h"
#include "isp/model/sensor/photon.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::capture {
namespace {

/// Returns the camera RGB of a white, its largest channel 1; all 0 without light.
Vector3 neutral_of(const SpectralResponse& response, const Spectrum& white) {
  Vector3 out = isp::electron_rate(response, white);
  const double largest = *std::max_element(out.begin(), out.end());
  if (!(largest > 0)) return {};
  for (double& channel : out) channel /= largest;
  return out;
}

/// Returns matrices for A and D65 fitted to the camera's sensitivities, and the neutral of the scene's white.
Result<CameraColour> colour_of(const isp::NamedSensor& sensor, const SpectralResponse& response,
                               const Spectrum& white) {
  const auto sensitivity = *isp::camera_sensitivity(sensor.camera);
  CameraColour colour;
  for (const char* light : {"A", "D65"}) {
    auto calibration = isp::fit_calibration(sensitivity, *isp::light_named(light), isp::ForwardMatrix::fit);
    if (!calibration) return tl::make_unexpected(calibration.error());
    colour.calibrations.push_back(*calibration);
  }
  colour.as_shot_neutral = neutral_of(response, white);
  if (!(*std::ranges::min_element(*colour.as_shot_neutral) > 1e-6) ||
      !isp::white_of_neutral(colour, *colour.as_shot_neutral)) {
    // A light that leaves a channel dark (or no light), or whose camera RGB the matrices map to no colour of a light,
    // as narrow bands of blue, gives no white balance: daylight replaces it.
    colour.as_shot_neutral = neutral_of(response, *isp::radiance_of(*isp::light_named("D65"), 1));
  }
  colour.source = CameraColour::Source::file_tags;
  return colour;
}

Result<void> check_options(const SensorModel& sensor, const SyntheticOptions& options) {
  if (options.masked_columns < 0 || options.masked_columns > 4096 || options.masked_columns % 2 != 0) {
    return fail(ErrorCode::invalid_argument, "masked columns are an even number between 0 and 4096");
  }
  if (const auto& t = options.effects.tolerance; t && (!(t->delta_e > 0) || !(t->relative_variance > 0))) {
    return fail(ErrorCode::invalid_argument, "a tolerance must be above 0: use the effects all to leave none out");
  }
  if (options.sampling == PhotonSampling::published && options.effects.tolerance) {
    return fail(ErrorCode::invalid_argument,
                "the planner supports physical sampling only: name the effects of published sampling");
  }
  if (options.sampling == PhotonSampling::published && sensor.crosstalk > 0 &&
      options.effects.effects.has(isp::Effect::crosstalk)) {
    return fail(ErrorCode::invalid_argument,
                "published photon sampling does not support crosstalk: leave it out of the effects");
  }
  if (!(options.lens_blur_px >= 0) || !(options.lens_blur_px <= max_lens_blur_px)) {
    return fail(ErrorCode::invalid_argument,
                "the blur of the lens must lie between 0 and 10 px, found " + number_text(options.lens_blur_px, 6));
  }
  if (options.sampling == PhotonSampling::published && options.simulated_blur_px() > 0) {
    return fail(ErrorCode::invalid_argument,
                "published photon sampling does not support lens-blur: leave it out of the effects");
  }
  if (!(options.f_number >= 0.5) || !(options.f_number <= 1000)) {
    return fail(ErrorCode::invalid_argument, "the f-number must lie between 0.5 and 1000");
  }
  return {};
}

}  // namespace

Result<SyntheticCamera> make_camera(isp::NamedSensor sensor, const SpectralResponse& response, const Spectrum& white,
                                    const SyntheticOptions& options) {
  if (const auto good = isp::check_sensor(sensor.model); !good) return tl::make_unexpected(good.error());
  if (const auto good = isp::check_exposure(options.exposure); !good) return tl::make_unexpected(good.error());
  if (const auto good = check_options(sensor.model, options); !good) return tl::make_unexpected(good.error());
  auto colour = colour_of(sensor, response, white);
  if (!colour) return tl::make_unexpected(colour.error());
  const auto seen = isp::white_of_neutral(*colour, *colour->as_shot_neutral);
  const auto to_xyz =
      seen ? isp::camera_to_xyz(*colour, seen->xy, isp::white_d65) : Result<Matrix3>(tl::make_unexpected(seen.error()));
  if (!to_xyz) return tl::make_unexpected(to_xyz.error());
  // The ISO speed at which the frame's exposure, f-number and saturation agree (isp/model/sensor/scene_luminance.h).
  const double saturation_cd_m2 = isp::saturation_luminance_cd_m2(sensor.model, response, 1);
  const double iso = 78 * options.f_number * options.f_number / (0.65 * saturation_cd_m2);
  return SyntheticCamera{std::move(sensor), options, *std::move(colour), *to_xyz, iso};
}

}  // namespace lowlux::capture
