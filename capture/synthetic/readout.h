#pragma once

#include <cstdint>
#include <limits>
#include <span>

#include "isp/base/random/random.h"
#include "isp/base/sensor.h"

namespace lowlux::capture {

/// Parameters of the conversion of a row's charge to codes. Disabled steps cost no time.
struct ReadoutParameters {
  float full_well_e = std::numeric_limits<float>::infinity();  // infinite: no saturation
  float read_noise_e = 0;                                      // standard deviation, 0..1e6; 0: none
  float gain_dn_per_e = 1;
  float black_dn = 0;
  float max_dn = 65535;  // the largest code: an integer, at least 0
  Quantisation quantisation = Quantisation::round;
  bool photon_noise = true;  // false: the mean itself is collected
  bool quantise = true;      // false: fractions of codes are kept
  bool clip = true;          // to 0..max_dn; false: signed and without limit
};

/// Charge of the pixels (x0 + i, y). The spans have the same length, except that the last two may be empty.
struct RowCharge {
  std::span<const float> mean_e;    // expected, signal plus dark charge; as poisson_row takes it
  std::span<const float> steady_e;  // collected without photon noise
  std::span<const float> offset_e;  // added after collection, signed: row and column noise
};

/// Reads out one row of a sensor.
///     n [e-] = min(Poisson(mean_e) + steady_e, full_well_e)
///     e [e-] = n + read_noise_e * z + offset_e,  z standard normal
///     v [DN] = black_dn + gain_dn_per_e * e, then quantised (to nearest: halves to even), then clipped
/// The electrons are word 0 and z is word 1 of each pixel, so that the row may be computed in segments of any size.
/// Float arithmetic in this order; the bits are the same on every processor. If v is NaN (because a charge or offset
/// is), clipping gives 0.
/// @param dn as long as mean_e
void read_out_row(const DrawStream& stream, std::uint32_t x0, std::uint32_t y, const RowCharge& charge,
                  const ReadoutParameters& parameters, std::span<float> dn);

/// Reads out one row as 16-bit codes: `quantise` and `clip` are on, and max_dn is at most 65535.
void read_out_row(const DrawStream& stream, std::uint32_t x0, std::uint32_t y, const RowCharge& charge,
                  const ReadoutParameters& parameters, std::span<std::uint16_t> dn);

}  // namespace lowlux::capture
