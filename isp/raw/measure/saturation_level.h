#pragma once

#include <algorithm>
#include <optional>

#include "isp/base/frame.h"

namespace lowlux::isp {

/// States the code at which the pixels of a sensor saturate, and how much it differs between pixels.
struct SaturationLevel {
  double mean_dn = 0;
  double std_dn = 0;

  /// Returns the code from which on a pixel counts as saturated: 1 % below the level at least, because corrections of
  /// black and lines move codes.
  double from_dn() const { return std::min(mean_dn - 3 * std_dn, 0.99 * mean_dn); }
};

/// Returns the level at which the sensor saturates, where a Bayer mosaic of codes shows that it does so below the white
/// level that its source states: at 0.75 to 0.99 of white above black. nullopt if the frame does not show it, or shows
/// that no level below white is that of saturation.
///
/// Saturated pixels have one code in common in all colours, and pixels of the same places in other colours do not. What
/// a frame must show (block: 4 x 4 pixels):
///   - a peak of codes with a standard deviation of at most 1/400 of the range, at least 5 times as frequent as the
///     codes below it, and above which at most 1 % of each colour's pixels of the peak lie;
///   - for two colours, at least 24 blocks each of which all pixels of that colour are in the peak, while all pixels of
///     another colour are clearly below it, and these others vary: their block means are as many as in 8 bins or more
///     of 1/64 of the range, if they were evenly distributed. Surfaces that are evenly lit do not vary in one colour
///     alone, and edges of surfaces do not keep one colour in all of a block;
///   - where the source states its noise, a standard deviation of at most half of that of light at this level, which
///     evenly lit surfaces have: in merged frames it can be as small as that of saturated pixels;
///   - blocks below the peak that are not neutral: the median of red / green or of blue / green differs from 1 by more
///     than 3 %. Otherwise the colours of everything agree, and the other evidence says little.
/// Of frames of more than 4 megapixels a part of the rows is examined.
std::optional<SaturationLevel> measure_saturation_below_white(const RawDn& raw, const BlackPoint& black,
                                                              const std::optional<NoiseProfile>& noise);

}  // namespace lowlux::isp
