#pragma once

#include "isp/base/matrix3.h"

namespace lowlux::isp {

inline constexpr double bound_sigmas = 5;      // standard deviations of a bound
inline constexpr double channel_pixels = 256;  // pixels of R or B in a block; G has twice as many

/// Describes what effects that move light between pixels add to the signal s of the R, G and B pixels of a block, here
/// d, as means over the pixels. v is count_change_variance_e2() of a pixel.
struct MovedLight {
  Vector3 mean_e{}, moved_e{};                // d, |d|
  Vector3 variance_e2{}, more_contrast_e2{};  // variance of d, and what d adds to the variance of s, often negative
  Vector3 count_variance_e2{};                // v
  Vector3 squares_by_signal_e3{};             // d^2 s
  Vector3 counts_by_signal_e3{};              // v s
  Vector3 counts_by_contrast_e4{};            // v (s - mean of s)^2

  bool moves() const { return moved_e[0] + moved_e[1] + moved_e[2] > 0; }
};

/// Describes the detail of a block: means over its R, G and B pixels, of signal s.
struct Contrast {
  Vector3 variance_e2{};   // (s - mean of s)^2
  Vector3 by_signal_e3{};  // s (s - mean of s)^2
};

/// Bounds the variance of the change of what is read of a Poisson count whose mean rises from `less_e` by d to
/// `more_e`, with the same random number [e-^2]. The count changes by a variance of d, as for photons that are added,
/// and of no more than 1/4 + d^2 / (4 less_e), because the quantile of a number moves by d and a part of its deviation,
/// and is rounded. Codes round it again: where a code is `step_e` > 1 e-, 1 e- more changes one count in `step_e` by a
/// code.
/// @param step_e charge of a code, 1 / K
double count_change_variance_e2(double less_e, double more_e, double step_e);

/// Describes the noise of one channel of a block.
struct BlockNoise {
  double variance_e2 = 0;  // variance of a pixel, all effects
  double signal_e = 0;     // mean, and variance of its photon noise
  double pixels = 0;       // number of pixels that are neither saturated nor black
  double step_e = 0;       // charge of a code
  double floor_e2 = 0;     // changes of variance below this do not count
};

/// Holds bounds on the change of one channel of a block by moved light that is left out, in addition to the change of
/// its mean: the scatter of the mean, and the change of the variance of the pixels, relative to the least that is seen.
struct MovedChange {
  double scatter_e = 0;
  double relative_variance = 0;
  double sigmas = bound_sigmas;  // bound in standard deviations of the noise of the block's mean
};

/// Predicts the change of channel `c` by light that moves. The bounds are five standard deviations, weighted by the
/// noise of the pixels that change. Where fewer than 16 counts or codes of a channel change, they are discrete events,
/// as many as one block in a million has.
MovedChange moved_change(const MovedLight& moved, const Contrast& contrast, int c, const BlockNoise& noise);

/// Returns the number of pixels of a kind that a channel of a block may hold: exceeded once in a million.
double count_in_block(double fraction);

}  // namespace lowlux::isp
