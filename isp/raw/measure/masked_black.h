#pragma once

#include <optional>
#include <string>

#include "isp/base/frame.h"

namespace lowlux::isp {

/// Holds the black point measured on light-shielded pixels, or the reason why they cannot be used.
struct MaskedBlack {
  std::optional<BlackPoint> black;
  Rect region;          // region of the readout that was used, in readout pixels
  std::string refusal;  // set when `black` is absent
};

/// Measures pedestal plus dark on the masked pixels of one frame, per CFA site and so per row parity.
///
/// The largest of the masked rectangles next to the active area is used, columns before rows: only columns share the
/// read-out of every active row. Its outer 4 and inner 12 pixels are left out (edge effects, stray light). The value
/// per site is the mean of the samples within 5 standard deviations (from the median absolute deviation) of the median,
/// which removes 6e-7 of a normal distribution. Where the gain is known, samples up to 6 e- above that are kept: a dark
/// charge of less than an electron is in few pixels, which the deviation does not show. At 0.05 e- over 0.15 e- of read
/// noise the symmetric cut would remove 92 % of it. The standard error includes row and column noise:
///     se^2 = var(row means) / rows + var(column means) / columns - var(sample) / samples
/// Borders that a source does not declare as masked are refused when there is no tag to check them by, when they are
/// constant (padding), when their level differs from the tag by more than 16 standard deviations of a pixel and 0.5 %
/// of the range, or when their row profile follows that of the neighbouring active columns.
/// @param gain_dn_per_e  the system gain; 0 where it is not known
MaskedBlack measure_masked_black(const RawDn& raw, double gain_dn_per_e = 0);

}  // namespace lowlux::isp
