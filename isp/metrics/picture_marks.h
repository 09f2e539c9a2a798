#pragma once

#include "isp/base/plane.h"

/// Measures of marks that processing leaves in an image: meshes, ripples, beads.
namespace lowlux::isp {

/// Root mean square amplitude of all spectral lines of a period, with the number of amplitudes.
struct PeriodicLines {
  double amplitude = 0;           // over that of white noise of the plane's own variance; 0 for a constant plane
  double absolute = 0;            // amplitude times that standard deviation, in units of the plane
  double degrees_of_freedom = 0;  // the square has a standard deviation of sqrt(2 / this) for white noise
};

/// Computes the lines of a period p. For white noise the expectation of the squared amplitude is 1. By Parseval's
/// theorem it follows from the means m_ij of the p x p classes of pixels of equal column and row modulo p, of n pixels
/// each: n sum (m_ij - m)^2 / (p^2 - 1) / s^2.
/// @param plane  complete periods count; at least two in each direction
/// @param period_px  at least 2
/// @param without_px  a divisor of the period, whose lines are left out; 1: none
PeriodicLines periodic_lines(const PlaneView<const float>& plane, int period_px, int without_px = 1);

/// Root mean square of an error near some pixels and far from them.
struct RingError {
  double ring = 0;    // at distances of ring_inner_px to ring_outer_px; not a number if there are none
  double far = 0;     // at distances beyond ring_far_px
  double mean = 0;    // mean of the error itself, in the ring
  double pixels = 0;  // number of pixels of the ring
};
inline constexpr int ring_inner_px = 2, ring_outer_px = 12, ring_far_px = 24;

/// Computes the error around the pixels that a mask marks (other than 0); distances are Euclidean.
RingError ring_error(const PlaneView<const float>& error, const PlaneView<const float>& mask);

/// Returns the root mean square amplitude of beads, of a period of 2 px down the columns: of (e(y - 1) - 2 e(y) +
/// e(y + 1)) / 4, which is +-1 for e(y) = (-1)^y, 0 for what is linear in y, and sqrt(6) / 4 times the deviation of
/// white noise. Not a number below three rows.
double bead_amplitude(const PlaneView<const float>& error);

}  // namespace lowlux::isp
