#pragma once

#include <optional>
#include <string>

#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/base/sensor.h"
#include "isp/base/spectrum.h"
#include "isp/model/sensor/sensor_db.h"

namespace lowlux::isp {

/// Describes the optics between scene and sensor.
struct Optics {
  double f_number = 2;
  /// If set, a perfect white under D65 of this luminance fills the sensor's most sensitive channel in 1 s, independent
  /// of pixels and lens.
  std::optional<double> white_luminance_cd_m2;
};

/// Gives the scale of the thesis: see Optics::white_luminance_cd_m2.
inline constexpr double thesis_white_luminance_cd_m2 = 100;
/// Gives the peak quantum efficiency of the most sensitive channel where no source states one. Only `published` photon
/// sampling depends on it: elsewhere the scale of a response is set by the charge that fills a pixel, or by a sourced
/// peak.
inline constexpr double assumed_peak_quantum_efficiency = 0.5;

/// Returns the response of the sensor behind a lens, with the filters of sensor.camera. The scale of its quantum
/// efficiency is the first of these that is known:
///     Optics::white_luminance_cd_m2;
///     an ISO speed S given by the user: white at L = 78 N^2 / (0.65 S t) saturates
///     (isp/model/sensor/scene_luminance.h); pixel pitch p and peak quantum efficiency: etendue = p^2 pi / (4 N^2) for
///     an ideal lens of f-number N; the ISO speed of the table's gain setting; thesis_white_luminance_cd_m2 for the
///     thesis' sensor.
/// A speed that is given holds for the sensor as it is, the last two for NamedSensor::published.
/// Errors: none of them is known (the message names what is missing); an unknown camera (near matches are offered); an
/// f-number, luminance, pixel pitch or ISO speed that is not positive or far outside the possible range, used or not.
Result<SpectralResponse> spectral_response(const NamedSensor& sensor, const Optics& optics);

/// Returns the electrons per second in a pixel of R, G and B at a radiance [W m-2 sr-1 nm-1], integrated over its
/// nodes.
Vector3 electron_rate(const SpectralResponse& response, const Spectrum& radiance);

/// Returns a light scaled to radiance: a perfect white diffuser under it has this luminance. nullopt if it has no
/// luminance, or one beyond double.
std::optional<Spectrum> radiance_of(const Spectrum& light, double luminance_cd_m2);

/// Returns the luminance [cd/m2] at which a white under D65 saturates the sensor in a time.
double saturation_luminance_cd_m2(const SensorModel& sensor, const SpectralResponse& response, double time_s);

}  // namespace lowlux::isp
