#pragma once

#include <array>
#include <span>
#include <vector>

#include "calib/dark_series.h"
#include "isp/base/estimate.h"

namespace lowlux::calib {

/// Fills in currents, temperature law and chromaticity.
/// @param temperature_c  rising; one entry, without meaning, if not `stated`
/// @param slopes_dn      of R, G, B at each temperature [DN/s]
void put_currents(std::span<const double> temperature_c, std::span<const std::array<Estimate, 3>> slopes_dn,
                  bool stated, const Estimate& gain_dn_per_e, DarkSeries& out);

}  // namespace lowlux::calib
