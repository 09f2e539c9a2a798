#pragma once

#include <cstddef>

#include "denoise/denoiser.h"
#include "denoise/temporal_rows.h"

/// The noise model as TemporalMean and its kernels take it.
namespace lowlux::denoise {

inline constexpr double largest_value_e = 1e9;  // of either sign: where values end

rows::SiteNoise site_noise(const RawNoise& noise, BayerPhase phase);

/// Var[y] [e-^2] of a raw value of a colour (0, 1, 2: R, G, B) whose signal has this mean:
///     max(signal + dark + variance, variance / 2 + 0.3 dark + 0.02)
/// Means of some sites scatter below 0: were they limited there, the variance would be too large on the average.
double variance_of(const rows::SiteNoise& noise, std::size_t colour, double signal_e);

}  // namespace lowlux::denoise
