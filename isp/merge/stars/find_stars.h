#pragma once

#include "isp/base/executor.h"
#include "isp/merge/frame.h"
#include "isp/merge/stars/star.h"

namespace lowlux::merge {

/// Holds the options of find_stars().
struct StarOptions {
  double psf_sigma_px = 1.2;      // 0.5..4: expected width of a star; a factor of 1.5 costs a tenth of the snr
  double false_stars_per_mp = 1;  // 1e-3..1e3: at most so many are expected in a frame of noise alone
  int max_stars = 1000;           // at least 1: the brightest by snr
};

/// Finds the stars of a mosaic and measures place, width and flux of each.
///
/// 1. Scores z = (signal - background) / standard deviation, with the background of background.h; 0 where a site is
///    missing. Where the sites on both sides of a gap are bright, the gap is the core of a saturated star and takes the
///    score of the brighter side.
/// 2. Matched filter: the scores with a Gaussian of psf_sigma_px integrated over pixels, divided by its norm. White
///    noise stays of variance 1, whatever the colours of the background.
/// 3. Candidates are maxima of 3 x 3 sites above detection_limit(false_stars_per_mp / 1e6), which regards the skewness
///    of few photons, with nothing as bright in most directions around.
/// 4. Each is fitted with a Gaussian PSF (psf_fit.h). Its start and prior of the width is psf_sigma_px, or the median
///    width of the brightest, where at least 5 have an snr above 10. Stars are those of which more is left without
///    their brightest site than 3 standard deviations (hot pixels leave nothing), that the PSF describes (other PSFs
///    may differ by 20 % of the value and 5 % of the peak), and whose width is within half to twice the median of the
///    frame.
///
/// Frames of less than 16 x 16 sites have no stars. Same result for any executor.
/// @note Sources that stand still on the sensor or on the ground and look like stars are listed like stars.
StarField find_stars(const FrameView& frame, const StarOptions& options, Executor& executor);

}  // namespace lowlux::merge
