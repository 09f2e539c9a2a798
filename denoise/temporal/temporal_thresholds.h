#pragma once

#include <array>
#include <cstddef>

#include "denoise/denoise_options.h"
#include "denoise/temporal/temporal_rows.h"

/// The noise model as TemporalMean and its kernels take it.

namespace lowlux::denoise {

/// When a block has moved: where a statistic of mean mu and variance var, taken for a gamma variable of shape
/// a = mu^2 / var, is above mu (1 - 1 / (9 a) + z / (3 sqrt(a)))^3 (E. B. Wilson, M. M. Hilferty, PNAS 17, 1931), times
/// `few` for that of few degrees of freedom.
struct MotionThreshold {
  double z;    // normal quantile of the false alarms of one of the two statistics
  double few;  // what makes the above exact for chi-square of 3 degrees of freedom
};

/// Of a block by itself, and of one beside such a block.
struct MotionThresholds {
  MotionThreshold alone;
  MotionThreshold beside;
};

/// Thresholds at which `false_alarm` of the blocks of a still scene move, those beside others included: the cube root
/// of it is the rate b beside others, and the rate a by itself solves a + (b - a) (1 - (1 - a)^8) = false_alarm.
/// @param false_alarm  1e-6..0.5
MotionThresholds motion_thresholds(double false_alarm);

inline constexpr double largest_value_e = 1e9;  // of either sign: where values end

rows::SiteNoise site_noise(const RawNoise& noise, BayerPhase phase);

/// Var[y] [e-^2] of a raw value of a colour (0, 1, 2: R, G, B) whose signal has this mean:
///     max(signal + dark + variance, variance / 2 + 0.3 dark + 0.02)
/// Means of some sites scatter below 0: were they limited there, the variance would be too large on the average.
double variance_of(const rows::SiteNoise& noise, std::size_t colour, double signal_e);

}  // namespace lowlux::denoise
