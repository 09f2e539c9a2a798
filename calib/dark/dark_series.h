#pragma once

#include <span>

#include "calib/dark/dark_figures.h"
#include "calib/dark/dark_stack.h"
#include "isp/base/estimate.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Fits mean = pedestal + K * current * time for each site, the pedestal being common to all temperatures.
/// Pixels that lie more than 5 standard deviations from their site's median in any group are left out of all; what that
/// does to the mean of a Poisson + normal law is computed (poisson_gauss.h) and taken back. Standard errors are those
/// of the fitted estimate made pixel by pixel, so that patterns common to all groups count once, and cancel where they
/// do.
/// @param groups  two exposure times at one temperature at least
/// @param gain    K [DN/e-] with its standard error, from fit_photon_transfer
/// Errors: groups of different cameras, sizes or gains; temperatures stated by some only; too few exposure times;
/// darks cut off at code 0; codes too coarse to give means (scatter below half a code); more than 5 % of the pixels
/// excluded; a mean that is not linear in time, or dark charge that changes by more than a tenth across the frame:
/// light gets in, or the sensor glows.
Result<DarkSeries> fit_dark_series(std::span<const DarkGroup> groups, const Estimate& gain_dn_per_e);

}  // namespace lowlux::calib
