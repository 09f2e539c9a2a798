#pragma once

#include "denoise/spatial/passes.h"

/// Non-local Bayes on the finest pyramid levels, after M. Lebrun, A. Buades, J.-M. Morel, "A nonlocal Bayesian image
/// denoising algorithm", SIAM J. Imaging Sci. 6(3), 2013 (its second step), joint over the four planes.
namespace lowlux::denoise {

/// Maximum number of levels estimated by nl_bayes(); never the coarsest, whose blocks keep the mean.
inline constexpr int nl_bayes_levels = 4;

/// Filters value[1] and `noisy` of the finest levels into value[0] of level 0, recomposed, and `residual`.
/// @param frame  memory made for Level::best, after run_pass(frame, 1, ..)
void nl_bayes(const PassFrame& frame);

}  // namespace lowlux::denoise
