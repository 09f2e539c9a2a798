#pragma once

#include "isp/base/dark_frame.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::isp {

/// The black point that a dark frame stands for: its sites' means, pedestal and dark charge in one. Errors: a frame
/// that is no mosaic (unsupported), of another size than its active area (invalid_argument), white not above black
/// (malformed).
Result<BlackPoint> black_of(const RawDn& raw, const DarkFrame& dark);

/// Takes the dark frame off the active area, pixel by pixel: value = (dn - dark) / (white - mean dark of the site),
/// signed, nothing clipped. A saturated pixel tells no sum of light and dark, so there the site's mean is taken off:
/// a hot pixel within a highlight leaves no dark dot.
/// @param black  black_of(raw, dark)
/// @param out    active height x width
void to_fraction(const RawDn& raw, const DarkFrame& dark, const BlackPoint& black, PlaneView<float> out,
                 Executor& executor);
/// The same of a part of the active area, its corner at an even column and row.
/// @param out  part height x width
void to_fraction(const RawDn& raw, const DarkFrame& dark, const BlackPoint& black, const Rect& part,
                 PlaneView<float> out, Executor& executor);

/// The active area with the dark frame off and the sites' means left in, in whole codes: for what is measured on a
/// frame before a pixel is touched. What pictures are made of is to_fraction.
RawFrame measurable_without_dark(const RawFrame& frame, const DarkFrame& dark, const BlackPoint& black,
                                 Executor& executor);

}  // namespace lowlux::isp
