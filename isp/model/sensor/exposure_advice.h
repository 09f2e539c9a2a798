#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/base/sensor.h"

namespace lowlux::isp {

/// Describes a camera at one gain setting, behind its lens and under the light of the scene.
struct GainSetting {
  std::string name;  // name that the camera uses
  SensorModel sensor;
  Vector3 white_e_per_s{};  // electrons of R, G and B for a neutral of 1 cd/m2
};

/// Describes the scene to be photographed and the limits of the exposure.
struct AdviceRequest {
  std::vector<GainSetting> gains;  // gain settings of one camera; any order
  Matrix3 camera_to_xyz{};         // for electrons; its scale does not matter
  double midtone_cd_m2 = 0;        // luminance at which signal-to-noise ratio and chromaticity are evaluated
  double highlight_cd_m2 = 0;      // luminance that must not clip
  double clipped_fraction = 1e-3;  // fraction of pixels of the highlight that noise may clip, 1e-9..0.5
  double longest_exposure_s = 0;   // longest exposure without motion blur, see motion_limit_s
  double temperature_c = 20;       // temperature of the sensor
  double patch_pixels = 256;  // pixels of the patch whose chromaticity is evaluated: of R and of B, twice as many of G
  int frames = 1;             // frames of equal exposure, averaged
  int curve_points = 25;      // exposure times of the curve, 2..10000
};

/// Describes a moving object and its allowed blur; the longest exposure is blur / speed.
/// @param speed_px_per_s, blur_px  above 0. Errors: they are not; a quotient beyond 1e6 s
struct Motion {
  double speed_px_per_s = 0;
  double blur_px = 1;
};
Result<double> motion_limit_s(const Motion& motion);

/// Lists the limits of an exposure.
enum class ExposureLimit : std::uint8_t {
  motion,           // longest_exposure_s
  converter_range,  // the highlight reaches the largest code, at this gain
  full_well,        // the highlight fills the pixels, at any gain
};

/// Lists the components of a pixel's variance; in electrons of one frame.
enum class NoiseSource : std::uint8_t { photons, dark_current, read_noise, quantisation };

/// Describes the quality of the mid tone in an averaged pixel, and in a patch of them.
struct MidtoneQuality {
  double snr = 0;         // ratio of powers in the channel with most signal (isp/model/sensor/noise_budget.h)
  double uv_std = 0;      // bound of the patch's u'v', root of summed variances (isp/model/colour/chroma_bound.h)
  double weight_snr = 0;  // ratio of the patch; below about 5 the distribution of the chromaticity has heavy tails
};

/// Describes one exposure at one gain.
struct AdvicePoint {
  std::size_t gain = 0;  // index in AdviceRequest::gains
  double exposure_s = 0;
  std::optional<MidtoneQuality> midtone;  // absent where the mid tone itself clips
  double highlight_charge_fraction = 0;   // mean charge of its fullest channel, as a fraction of the full well
  double highlight_code_fraction = 0;     // the same charge as a fraction of the charge at the largest code
  std::optional<ExposureLimit> exceeds;   // the first limit that is exceeded
};

/// Holds the best exposure of one gain: its longest, because all quality figures improve with light.
struct GainAdvice {
  AdvicePoint at;
  ExposureLimit limit = ExposureLimit::motion;  // limit of the exposure
  NoiseSource largest_noise = NoiseSource::photons;
  double largest_noise_fraction = 0;  // fraction of the mid tone's variance, in its channel with most signal
};

/// Holds the best exposure of each gain, and the best gain.
struct ExposureAdvice {
  std::size_t best = 0;           // index in gains
  std::vector<GainAdvice> gains;  // one for each of AdviceRequest::gains, in the same order
  std::vector<AdvicePoint>
      curve;           // gain by gain, exposures rising in equal ratios from a tenth of the shortest advised
  std::string reason;  // reason in one sentence without a final full stop
};

/// Settings within this of the best [dB] count as equal: the lowest gain of them is chosen, for its headroom.
inline constexpr double equal_quality_db = 0.1;

/// Returns a signal-to-noise ratio, a ratio of powers, in dB: 10 log10.
double decibel(double snr);

/// Returns the exposure and gain at which the mid tone has the best signal-to-noise ratio and the most precise
/// chromaticity. Both improve with the exposure, so that each gain is evaluated at its longest: the smallest of
/// longest_exposure_s and the times in which the highlight's charge m = (signal + dark) t reaches
///     m + z sqrt(m) = full well,  m + z sqrt(m + sigma_r^2) = charge at the largest code,
/// with z the normal quantile of 1 - clipped_fraction. The best gain is the one whose larger loss is smallest: of SNR
/// [dB] against the best SNR of all gains, and of 20 log10 of the chromaticity's standard deviation against the
/// smallest of all gains. Noise is that of photons, dark current, reading and quantisation; fixed pattern, row and
/// column noise are not included. Errors: no gains; an impossible sensor or figure; a highlight darker than the mid
/// tone; no light; a mid tone without chromaticity; a highlight that clips in any time. The message says which, and
/// what would help.
Result<ExposureAdvice> advise_exposure(const AdviceRequest& request);

/// Returns the model's prediction for one setting, whether a limit allows it or not. `request` must be one that
/// advise_exposure() accepts; exposure_s > 0.
AdvicePoint predicted_point(const AdviceRequest& request, std::size_t gain, double exposure_s);

/// Checks for the errors of advise_exposure() that follow from its request alone.
Result<void> check_request(const AdviceRequest& request);

/// Returns the reason for the best gain: the limit of its exposure, the losses of its neighbours, and the main
/// component of its noise. One sentence without a final full stop.
/// @param losses_db  losses of each gain against the best of all [dB]
std::string advice_reason(const AdviceRequest& request, const ExposureAdvice& advice,
                          const std::vector<double>& losses_db);

}  // namespace lowlux::isp
