#pragma once

#include "denoise/patch_estimate.h"
#include "isp/model/chroma_bound.h"
#include "isp/model/colorimetry.h"

namespace lowlux::denoise {

/// Colours before anything is measured: normal about a neutral, with one standard deviation in u' and in v'.
struct ChromaPrior {
  isp::UvPrime neutral;
  double std = 0.04;  // sigma_p, that of natural scenes; > 0. Smaller is greyer and calmer
};

/// A colour as far as it is known.
struct ShrunkChroma {
  isp::UvPrime uv;
  double confidence = 0;  // w, 0: the prior's neutral, 1: the measurement's own ratio; below 0.5 it is unrecoverable
};

/// Posterior mean of a chromaticity. With r = N - c0 W (N the numerators of u'v', W their denominator, c0 the neutral)
/// taken for normal about 0 with variance sigma_p^2 W^2, and observed with variance v_r:
///     c = c0 + w r / W,   w = W+^2 sigma_p^2 / (W+^2 sigma_p^2 + v_r),   W+ = max(W, 0)
/// v_r is the mean of the two components' variances. Never further than |r| sigma_p / (2 sqrt(v_r)) from the neutral;
/// the neutral itself, w = 0, where W is not positive or anything is not finite.
ShrunkChroma shrunk_chroma(const XyzEstimate& estimate, const ChromaPrior& prior);

/// The same w from what isp::chroma_crb or isp::chroma_of_means predict: sigma_p^2 / (sigma_p^2 + (C_uu + C_vv) / 2).
/// It is 1/2 where the rss standard deviation is sqrt(2) sigma_p. 0 for covariances that are infinite or not numbers.
double chroma_confidence(const isp::UvCovariance& covariance, double prior_std);

/// The same in planes of luma L and a chroma difference: L+^2 rho^2 / (L+^2 rho^2 + residual variance).
/// @param luma               L [e-], signed; not positive gives 0
/// @param residual_variance  that of the chroma after denoising [e-^2], >= 0; 0 gives 1 in any light
/// @param rho                standard deviation of chroma / luma a priori: 1.5 is weak, 0.6 visibly greys shadows
double plane_confidence(double luma, double residual_variance, double rho);

}  // namespace lowlux::denoise
