#pragma once

#include <array>
#include <cstddef>

#include "denoise/denoise_options.h"
#include "denoise/temporal/temporal_rows.h"

/// The noise model and the motion thresholds of TemporalMean and its kernels.

namespace lowlux::denoise {

/// Threshold of motion: a block has moved where a statistic of mean mu and variance var, assumed to be a gamma variable
/// of shape a = mu^2 / var, is above mu (1 - 1 / (9 a) + z / (3 sqrt(a)))^3 (E. B. Wilson, M. M. Hilferty, PNAS 17,
/// 1931), times `few` for the statistic of few degrees of freedom.
struct MotionThreshold {
  double z;    // normal quantile of the false alarm rate of one of the two statistics
  double few;  // factor that makes the threshold exact for chi-square of 3 degrees of freedom
};

/// Thresholds of a block by itself, and of one next to a block that moved.
struct MotionThresholds {
  MotionThreshold alone;
  MotionThreshold beside;
};

/// Returns thresholds at which a fraction `false_alarm` of the blocks of a still scene move, including those next to
/// others: the cube root of it is the rate b next to others, and the rate a by itself solves a + (b - a) (1 - (1 -
/// a)^8) = false_alarm.
/// @param false_alarm  1e-6..0.5
MotionThresholds motion_thresholds(double false_alarm);

/// Returns the threshold of a chi-square variable of 3 degrees of freedom.
double chi3_threshold(const MotionThreshold& at);

inline constexpr double largest_value_e = 1e9;  // limit of values, of either sign

rows::SiteNoise site_noise(const RawNoise& noise, BayerPhase phase);

/// Returns Var[y] [e-^2] of a raw value y of a colour (0, 1, 2: R, G, B) whose signal has this mean:
///     max(signal + dark + variance, variance / 2 + 0.3 dark + 0.02)
/// Means of a few sites scatter below 0: if they were limited there, the variance would be too large on average.
double variance_of(const rows::SiteNoise& noise, std::size_t colour, double signal_e);

}  // namespace lowlux::denoise
