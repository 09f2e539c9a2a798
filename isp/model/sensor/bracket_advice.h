#pragma once

#include <limits>
#include <span>
#include <vector>

#include "isp/base/result.h"

/// Predicts how many frames, of one exposure or of several, show highlights and shadows of a scene once merged.
namespace lowlux::isp {

/// Describes a scene by one raw of it, in electrons of a green pixel at the gain of the raw.
struct BracketScene {
  double exposure_s = 0;
  double darkest_e = 0;           // mean signal that 90 % of the scene exceeds
  bool darkest_is_black = false;  // the raw does not show the darkest tenth; darkest_e is what it would just show
  double dark_charge_e = 0;       // mean, in this exposure; grows with the time
  double noise_variance_e2 = 0;   // noise variance of reading and quantisation
  double saturation_e = 0;        // charge up to which a merge uses a pixel fully, dark charge included
  double highlight_fraction = 0;  // charge of the brightest lamps over that limit in their channel; may be above 1
  double saturated_fraction = 0;  // fraction of the pixels beyond that limit
};

/// Holds the input of advise_bracket().
struct BracketRequest {
  BracketScene scene;
  double snr = 100;  // required ratio of powers in the darkest tenth (isp/model/sensor/noise_budget.h)
  double longest_exposure_s = std::numeric_limits<double>::infinity();
};

/// Describes frames of one exposure.
struct BracketExposure {
  double exposure_s = 0;
  int frames = 1;
};

/// Holds the proposed frames of a merge.
struct BracketAdvice {
  std::vector<BracketExposure> exposures;  // shortest first; several are a bracket
  double snr = 0;                          // ratio of powers in the darkest tenth of the merged raw
  double raw_snr = 0;                      // signal-to-noise ratio of the darkest tenth in the raw itself
  double frames_like_raw = 0;              // frames of its exposure that would reach the requested ratio; whole
  double highlight_exposure_s = 0;         // in which the brightest lamps reach the limit of saturation
  double shadow_exposure_s = 0;            // in which a single frame shows the darkest tenth with the requested ratio

  bool is_bracket() const { return exposures.size() > 1; }
};

/// Returns the signal-to-noise ratio of a pixel in the mean of frames weighted by their inverse variance, a ratio of
/// powers:
///     SNR = sum over frames of (m r)^2 / (r (m + d) + sigma^2),    r = exposure time / scene.exposure_s,
/// of the frames in which its charge r (m + d) is at most scene.saturation_e.
/// @param signal_e  m, in the exposure of the raw
double merged_snr(const BracketScene& scene, std::span<const BracketExposure> exposures, double signal_e);

/// Proposes exposures at the gain of the raw. The longest of equal frames is limited by the brightest lamps, by
/// longest_exposure_s, or by the requested ratio; their number follows from it. A bracket has its shortest exposure
/// there, its longest where one frame reaches the requested ratio, and steps of equal ratio between them, of at most
/// 4 EV, so that a level that just saturates one exposure has the requested ratio in the shorter ones together. It is
/// proposed where it takes fewer frames than equal ones.
/// Errors: a figure that is not finite and positive (invalid_argument; dark charge and noise may be 0), more than 9999
/// frames (insufficient).
Result<BracketAdvice> advise_bracket(const BracketRequest& request);

}  // namespace lowlux::isp
