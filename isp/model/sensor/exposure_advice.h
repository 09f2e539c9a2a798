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

/// A camera at one gain setting, behind its lens and under the light of the scene.
struct GainSetting {
  std::string name;  // as the camera calls it
  SensorModel sensor;
  Vector3 white_e_per_s{};  // electrons of R, G and B for a neutral of 1 cd/m2
};

/// What is to be photographed, and what must not happen to it.
struct AdviceRequest {
  std::vector<GainSetting> gains;  // of one camera; any order
  Matrix3 camera_to_xyz{};         // of electrons; its scale does not matter
  double midtone_cd_m2 = 0;        // whose signal-to-noise ratio and chromaticity count
  double highlight_cd_m2 = 0;      // what must not clip
  double clipped_share = 1e-3;     // of pixels of the highlight that noise may clip, 1e-9..0.5
  double longest_exposure_s = 0;   // what moves does not blur in it, see motion_limit_s
  double temperature_c = 20;       // of the sensor
  double patch_pixels = 256;       // of the patch whose chromaticity is judged: of R and of B, twice as many of G
  int frames = 1;                  // of equal exposure, averaged
  int curve_points = 25;           // exposure times of the curve, 2..10000
};

/// The exposure in which what moves blurs by so much: blur / speed.
/// @param speed_px_per_s, blur_px  above 0. Errors: they are not; a quotient beyond 1e6 s
struct Motion {
  double speed_px_per_s = 0;
  double blur_px = 1;
};
Result<double> motion_limit_s(const Motion& motion);

/// What keeps an exposure from being longer.
enum class ExposureLimit : std::uint8_t {
  motion,           // longest_exposure_s
  converter_range,  // the highlight reaches the largest code, at this gain
  full_well,        // the highlight fills the pixels, at any gain
};

/// What a pixel's variance is made of; in electrons of one frame.
enum class NoiseSource : std::uint8_t { photons, dark_current, read_noise, quantisation };

/// How good the mid tone is in an averaged pixel, and in a patch of them.
struct MidtoneQuality {
  double snr = 0;     // of the channel with most signal, a ratio of powers (isp/model/sensor/noise_budget.h)
  double uv_std = 0;  // of the patch's u'v', root of the summed variances: the bound (isp/model/colour/chroma_bound.h)
  double weight_snr = 0;  // of the patch; below about 5 the chromaticity scatters with heavy tails
};

/// One exposure at one gain.
struct AdvicePoint {
  std::size_t gain = 0;  // index in AdviceRequest::gains
  double exposure_s = 0;
  std::optional<MidtoneQuality> midtone;  // none where the mid tone itself clips
  double highlight_charge_share = 0;      // its fullest channel's mean charge, of the full well
  double highlight_code_share = 0;        // and of the charge at the largest code
  std::optional<ExposureLimit> exceeds;   // the first limit it goes beyond
};

/// The best one gain can do: its longest exposure, for everything gets better with light.
struct GainAdvice {
  AdvicePoint at;
  ExposureLimit limit = ExposureLimit::motion;  // what keeps it from being longer
  NoiseSource largest_noise = NoiseSource::photons;
  double largest_noise_share = 0;  // of the mid tone's variance, its channel with most signal
};

struct ExposureAdvice {
  std::size_t best = 0;           // index in gains
  std::vector<GainAdvice> gains;  // as many as, and in the order of, AdviceRequest::gains
  std::vector<AdvicePoint>
      curve;           // gain by gain, exposures rising in equal ratios from a tenth of the shortest advised
  std::string reason;  // why, one sentence without a final stop
};

/// Settings within this of the best [dB] count as equal: the lowest gain of them is taken, for its headroom.
inline constexpr double equal_quality_db = 0.1;

/// Signal-to-noise ratio as a ratio of powers, in dB: 10 log10.
double decibel(double snr);

/// The exposure and gain at which the mid tone has the best signal-to-noise ratio and the best-known chromaticity.
/// Both rise with the exposure, so that each gain is judged at its longest: the least of longest_exposure_s and the
/// times in which the highlight's charge m = (signal + dark) t reaches
///     m + z sqrt(m) = full well,  m + z sqrt(m + sigma_r^2) = charge at the largest code,
/// z the normal quantile of 1 - clipped_share. Of the gains that is the best whose larger loss is least: of SNR [dB]
/// against the best SNR of all, of 20 log10 of the chromaticity's standard deviation against the least of all.
/// Noise is that of photons, dark current, reading and quantisation; fixed pattern, row and column noise are not in it.
/// Errors: no gains; a sensor or figure that cannot be; a highlight darker than the mid tone; no light; a mid tone
/// without chromaticity; a highlight that clips in any time. The message says which, and what would help.
Result<ExposureAdvice> advise_exposure(const AdviceRequest& request);

/// What the model predicts for one setting, whether a limit allows it or not. `request` must be one that
/// advise_exposure() accepts; exposure_s > 0.
AdvicePoint predicted_point(const AdviceRequest& request, std::size_t gain, double exposure_s);

/// The errors of advise_exposure() that its request shows by itself.
Result<void> check_request(const AdviceRequest& request);

/// Why the best gain is the best: what limits its exposure, what its neighbours would lose, and what its noise is made
/// of. One sentence without a final stop.
/// @param losses_db  of each gain against the best of all [dB]
std::string advice_reason(const AdviceRequest& request, const ExposureAdvice& advice,
                          const std::vector<double>& losses_db);

}  // namespace lowlux::isp
