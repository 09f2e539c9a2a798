#pragma once

#include <optional>
#include <span>

#include "isp/base/estimate.h"

namespace lowlux::calib {

/// Range of values within which a pixel is read, relative to black [DN].
struct ClipRange {
  double low_dn = 0;
  double high_dn = 0;
};

/// Mean and variance of pixels that receive about the same light, as read: clipping included.
struct NoisePoint {
  double mean_dn = 0;  // above black
  double variance_dn2 = 0;
  double degrees_of_freedom = 0;  // degrees of freedom of the variance; above 0
  ClipRange clip;
};

/// A noise model, variance = gain * mean + offset + contrast_squared * mean^2, of pixels that are not clipped. The last
/// term is proportional to the light and is not noise of the light: PRNU, grain and texture of the scene.
struct NoiseLine {
  Estimate gain_dn_per_e;
  Estimate offset_dn2;
  double covariance = 0;  // covariance of gain and offset
  double reduced_chi_square = 0;
  int degrees_of_freedom = 0;
  double contrast_squared = 0;  // at least 0
};

/// Returns the variance of pixels whose clipped mean is `mean_dn`, as read:
///     m, V: mean and variance of clamp(N(mu, gain mu + offset + contrast^2 mu^2)), mu such that m = mean_dn
/// (Foi et al., IEEE TIP 17(10), 2008, section IV, there as the functions E_m and S_m). Never below 0.
double read_variance_dn2(const NoiseLine& line, double mean_dn, const ClipRange& clip);

/// Returns the fraction of pixels whose clipped mean is `mean_dn` that is clipped, according to the line.
double clipped_fraction(const NoiseLine& line, double mean_dn, const ClipRange& clip);

/// Holds the prior of a line: before any point is measured, gain and offset are distributed log-normally about these
/// values, independent of each other.
struct NoisePrior {
  double gain_dn_per_e = 0;  // above 0, as the others
  double offset_dn2 = 0;
  double gain_log_std = 0;  // standard deviations of the natural logarithms
  double offset_log_std = 0;
};

/// Fits the most likely line by iterated weighted least squares. A point's variance is 2 V^2 / degrees of freedom, V
/// being that of the line and not the measured one, which would favour points with low measured values. Points that are
/// off by several standard deviations have less weight (Cauchy's weights). Standard errors are multiplied by
/// sqrt(reduced chi square) where that exceeds 1.
/// @param expected_contrast  0: contrast_squared is 0. Above 0: it is fitted too, and expected to lie within 0 and this
/// contrast's square (a normal prior, cut at 0); gain and offset are less certain by it, whether or not any is found
/// @return nullopt: fewer than three points, or means that do not separate gain from offset
std::optional<NoiseLine> fit_noise_line(std::span<const NoisePoint> points, double expected_contrast = 0);

/// Fits the line of the largest posterior probability: as above, with a prior on gain and offset, which separates them
/// where the points do not. Both stay above 0. Without points it is the prior's line.
NoiseLine fit_noise_line(std::span<const NoisePoint> points, double expected_contrast, const NoisePrior& prior);

}  // namespace lowlux::calib
