#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "isp/base/sensor.h"
#include "isp/model/sensor/exposure_advice.h"

/// Chooses exposure time and gain of a camera by the model of advise_exposure(), for the light that a frame shows.
namespace lowlux::isp {

/// Lists the lamps whose flicker an exposure averages out: none, those of mains of 50 or 60 Hz, or of either.
enum class Mains : std::uint8_t { off, hz50, hz60, either };

/// Describes the exposure times that a camera can be set to: min_s + n step_s up to max_s.
struct ExposureTimes {
  double min_s = 0;  // above 0
  double max_s = 0;
  double step_s = 0;  // 0: every time
};

/// Describes one gain of a camera.
struct GainStep {
  double factor = 1;  // analogue gain
  SensorModel sensor;
};

/// Holds what a frame shows of the light, for a pixel of the channel with most signal.
struct MeteredLight {
  double midtone_e_per_s = 0;    // where the signal-to-noise ratio is evaluated; 0 and below count as just above 0
  double highlight_e_per_s = 0;  // rate that must not clip
};

/// Holds the limits of an exposure.
struct ExposureLimits {
  ExposureTimes times;
  double longest_s = 0;                                         // by motion blur and frame rate
  double max_factor = std::numeric_limits<double>::infinity();  // largest gain; the lowest gain is always allowed
  Mains mains = Mains::off;
  /// Upper limit of the fraction of clipped pixels, 1e-9..0.5: so many pixels of the fullest channel may exceed, noise
  /// included, the full well or the range without metering_headroom. Of all pixels fewer clip.
  double clipped_fraction = 1e-3;
  double temperature_c = 20;  // temperature of the sensor, for its dark current
};

/// Holds an exposure time and a gain of a camera.
struct ExposureSetting {
  double exposure_s = 0;
  std::size_t gain = 0;  // index in the gains of the camera
};

/// Holds a setting and the signal-to-noise ratio that is predicted for it.
struct ExposureChoice {
  ExposureSetting setting;
  double snr = 0;  // signal-to-noise ratio of the mid tone, a ratio of powers (isp/model/sensor/noise_budget.h)
  ExposureLimit limit = ExposureLimit::motion;
  bool clips = false;  // the highlight clips in the shortest exposure, too
};

/// Part of the converter's range that a highlight does not use, so that a meter sees how bright it is.
inline constexpr double metering_headroom = 0.03;

/// Returns the longest time that the camera can be set to and that is at most `longest_s`; the shortest of the camera
/// if there is none. A time of at least half a period of the mains is a whole number of them, up to half a step:
///     t = n / (2 f),  f = 50 Hz or 60 Hz.
/// For mains of either frequency it is n/110 s or n/20 s, whichever is longer: the flicker that is left of either is at
/// most a tenth, |sin(pi F t) / (pi F t)| <= 0.1 for F = 100 Hz and 120 Hz.
double allowed_time_s(double longest_s, const ExposureLimits& limits);

/// Returns the number of half periods of the mains in a second: 100, 120, 110 for either, 0 without mains.
double flicker_hz(Mains mains);

/// Returns the setting with the best signal-to-noise ratio of the mid tone under the limits. Each gain is evaluated at
/// the longest allowed time in which the highlight, dark charge included, reaches neither the full well nor the code
/// (1 - metering_headroom) of the converter's range, as saturation_limits() states. Among gains within half a percent
/// of the best the lowest is chosen, for its headroom. Allocates nothing.
/// @param gains  at least one, by rising factor; sensors that check_sensor() accepts
ExposureChoice choose_exposure(const MeteredLight& light, std::span<const GainStep> gains,
                               const ExposureLimits& limits);

/// Returns whether a setting need not be left for `best`: it is within the limits, up to 1.5 % of the highlight's
/// charge, and its signal-to-noise ratio, a ratio of powers, is smaller by at most the fraction `tolerance`.
bool is_good(const ExposureSetting& setting, const MeteredLight& light, std::span<const GainStep> gains,
             const ExposureLimits& limits, const ExposureChoice& best, double tolerance);

/// Returns the mid tone's signal-to-noise ratio in one frame, a ratio of powers, whether the highlight clips or not.
double midtone_snr(const ExposureSetting& setting, const MeteredLight& light, std::span<const GainStep> gains,
                   const ExposureLimits& limits);

/// Returns the largest mean charge of a highlight that the limits allow at a gain.
double highlight_limit_e(const GainStep& gain, const ExposureLimits& limits);

/// Returns the dark electrons per second of the channel with most of them.
double dark_e_per_s(const GainStep& gain, const ExposureLimits& limits);

}  // namespace lowlux::isp
