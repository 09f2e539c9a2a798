#pragma once

namespace lowlux::calib {

/// Holds the noise of a camera at one setting, and how well both figures are known. An uncertainty is a factor: the
/// exponential of the standard deviation of the figure's logarithm, so that the true value lies within
/// value / factor to value * factor in two of three cases. 1: not stated.
struct NoiseFigures {
  double gain_dn_per_e = 0;  // EMVA 1288 system gain K, above 0
  double read_noise_e = 0;   // standard deviation of a pixel without charge, without quantisation; at least 0
  double gain_factor = 1;    // uncertainties, at least 1
  double read_noise_factor = 1;
};

}  // namespace lowlux::calib
