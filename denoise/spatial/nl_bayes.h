#pragma once

#include "denoise/spatial/passes.h"

/// Non-local Bayes on the finest pyramid levels, after M. Lebrun, A. Buades, J.-M. Morel, "A nonlocal Bayesian image
/// denoising algorithm", SIAM J. Imaging Sci. 6(3), 2013 (its second step), joint over the four planes.
namespace lowlux::denoise {

/// Levels estimated by nl_bayes(), at most; never the coarsest, whose blocks keep the mean.
inline constexpr int nl_bayes_levels = 4;

/// Filters value[1] and `noisy` of the finest levels into value[0] of level 0, recomposed, and `residual`.
/// @param frame  its memory made for Level::best; run_pass(frame, 1, ..) has been
void nl_bayes(const PassFrame& frame);

}  // namespace lowlux::denoise
