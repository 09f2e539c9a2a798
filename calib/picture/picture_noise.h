#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "calib/picture/flat_samples.h"
#include "isp/base/cfa.h"
#include "isp/base/estimate.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Details that are taken for noise: see block_samples and detail_samples.
enum class PictureNoiseMethod : std::uint8_t { ponomarenko, foi };

/// Holds the options of fit_picture_noise().
struct PictureNoiseOptions {
  PictureNoiseMethod method = PictureNoiseMethod::ponomarenko;  // foi is biased by texture more easily
  std::int64_t max_samples =
      400'000;  // 1..1e7; of blocks (128 pixels of the raw each, 256 in red and blue) or details (8, 16)
};

/// Noise of one ordinary image,
///     variance = gain * (mean - black) + offset + contrast_squared * (mean - black)^2      [DN^2], before clipping
/// `offset` holds all noise without light: K^2 sigma_r^2, row noise, quantisation (step^2 / 12), and K^2 times the dark
/// charge where `black` holds that charge; where black is the pedestal alone, dark charge counts as signal.
/// contrast_squared holds what is proportional to the light: PRNU, grain, texture as fine as pixels. Its prior is small
/// (1.5 %), so that gain and offset keep what the data do not require it to hold, and are less certain by it. DSNU, and
/// noise in the scene itself that is not proportional to its light, cannot be distinguished from noise in one frame and
/// count as such. Standard errors are those of the scatter of the samples, and of the contrast; texture finer than the
/// details that detect it raises the gain without being visible in them (calib/README.md has figures).
struct PictureNoise {
  Estimate gain_dn_per_e;
  Estimate offset_dn2;
  double covariance = 0;  // covariance of gain and offset
  double reduced_chi_square = 0;
  int degrees_of_freedom = 0;
  double darkest_dn = 0;  // range of the means of the fitted samples, above black, as read
  double brightest_dn = 0;
  double flat_fraction = 0;  // fraction of the samples
  bool converged = false;
  RawTraces traces;
  bool under_dithered = false;       // the darkest samples scatter by less than half a code step
  double darkest_noise_steps = 0;    // their standard deviation, with quantisation subtracted, in code steps
  std::vector<std::string> reasons;  // for doubting the result, one line each; empty: none found
  double contrast_squared = 0;       // at least 0
  double prior_ratio = 1;  // factor of both figures by which a prior was above all noise of the image; 1: it was not
};

/// Fits gain and offset to the active area: one of each for all sites, each colour measured on its own pixels. Clipping
/// at the smallest code in use and at white is modelled (noise_line.h).
/// @param black_dn black levels of each site
/// Errors: a layout other than Bayer or monochrome; floating-point samples; black that is not below white; options
/// outside their range; fewer than 100 samples; more than 90 % of the pixels clipped; too few flat samples; levels too
/// similar to separate gain from offset (a gain that is not positive, or known to less than 15 %); an offset below 0 by
/// three standard errors; a reduced chi square above 5.
Result<PictureNoise> fit_picture_noise(const RawDn& raw, const PerSite<double>& black_dn,
                                       const PictureNoiseOptions& options, Executor& executor);

/// Fits gain and offset where the image alone does not separate them, with a prior (noise_line.h): what the image does
/// not show stays as the prior has it. Standard errors include the prior's. `reasons` are those of the image.
/// Detail only adds to the variance of the quietest samples (quiet_ratio). Where they have less than 0.7 of the line's
/// variance, because the raw was denoised before or its gain is far from the prior, gain and offset are multiplied by
/// what they have (`prior_ratio`, at least 0.001). Where the samples follow no straight line, the line is the prior's,
/// multiplied likewise.
/// Errors: those of fit_picture_noise but for levels, flat samples, an offset below 0 and the reduced chi square.
Result<PictureNoise> fit_picture_noise(const RawDn& raw, const PerSite<double>& black_dn, const NoisePrior& prior,
                                       const PictureNoiseOptions& options, Executor& executor);

/// Comparison of one channel of a file's noise profile with the noise of the image.
struct NoiseAgreement {
  double gain_dn_per_e = 0;  // gain of the profile, in the units of PictureNoise
  double offset_dn2 = 0;
  double gain_ratio = 0;  // measured to the profile's; 0 where the profile's is 0
  double offset_ratio = 0;
  double chi_square = 0;  // chi square of the two differences, 2 degrees of freedom
  bool agrees = false;    // chi square below 11.8 (three standard errors), or both within 10 %
};

/// Compares the profile's R, G and B with the image's one line.
/// @param range_dn white less black, above 0
std::array<NoiseAgreement, 3> compare_with(const NoiseProfile& profile, const PictureNoise& noise, double range_dn);

}  // namespace lowlux::calib
