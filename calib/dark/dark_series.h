#pragma once

#include <span>

#include "calib/dark/dark_figures.h"
#include "calib/dark/dark_stack.h"
#include "isp/base/estimate.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Fits mean = pedestal + K * current * time for each site, the pedestal being common to all temperatures.
/// Pixels more than 5 standard deviations from their site's median in any group are excluded from all; the effect on
/// the mean of a Poisson + normal distribution is computed (dark_fit.h) and corrected. Standard errors are those of the
/// fitted estimate computed pixel by pixel, so that patterns common to all groups count once, and cancel where they do.
/// @param groups  at least two exposure times at one temperature
/// @param gain    K [DN/e-] with its standard error, from fit_photon_transfer
/// Errors: groups of different cameras, sizes or gains; temperatures stated for only some groups; too few exposure
/// times; darks clipped at code 0; codes too coarse to give means (scatter below half a code); more than 5 % of the
/// pixels excluded; a mean that is not linear in time, or dark charge that changes by more than a tenth across the
/// frame: a light leak, or sensor glow.
Result<DarkSeries> fit_dark_series(std::span<const DarkGroup> groups, const Estimate& gain_dn_per_e);

}  // namespace lowlux::calib
