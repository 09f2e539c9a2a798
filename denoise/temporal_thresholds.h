#pragma once

#include <array>

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

}  // namespace lowlux::denoise
