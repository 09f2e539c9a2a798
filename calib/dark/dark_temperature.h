#pragma once

#include <array>
#include <span>
#include <vector>

#include "calib/dark/dark_figures.h"
#include "calib/dark/dark_stack.h"
#include "isp/base/estimate.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Computes currents, temperature law and chromaticity.
/// @param temperature_c  rising; one entry, without meaning, if not `stated`
/// @param slopes_dn      slopes of R, G, B at each temperature [DN/s]
void put_currents(std::span<const double> temperature_c, std::span<const std::array<Estimate, 3>> slopes_dn,
                  bool stated, const Estimate& gain_dn_per_e, DarkSeries& out);

/// Returns the system gain [DN/e-] from darks alone: dark charge is Poisson distributed as photons are, so that the
/// temporal variance rises with the mean by K. One K for all sites; each has its own noise at no charge. Row noise is
/// the same in all groups and cancels.
/// @param groups  groups of one gain setting
/// Errors: fewer than two groups; a single frame of a setting; so little dark charge that the standard error would be
/// above 5 %.
Result<Estimate> gain_of_darks(std::span<const DarkGroup> groups);

}  // namespace lowlux::calib
