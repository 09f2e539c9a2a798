#pragma once

#include "isp/base/dark_frame.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::isp {

/// Returns the black point that a dark frame represents: its sites' means, with pedestal and dark charge in one, or of
/// bias frames the pedestal.
/// Errors: a frame that is not a mosaic or has floating-point samples (unsupported), a dark frame of another size than
/// the active area (invalid_argument), white not above black (malformed).
Result<BlackPoint> black_of(const RawDn& raw, const DarkFrame& dark);

/// Subtracts the dark frame from the active area, pixel by pixel: value = (dn - dark) / (white - mean dark of the
/// site), signed, nothing clipped. A saturated pixel does not hold the sum of light and dark, so there the site's mean
/// is subtracted: a hot pixel within a highlight leaves no dark dot.
/// @param black  black_of(raw, dark)
/// @param out    active height x width
void to_fraction(const RawDn& raw, const DarkFrame& dark, const BlackPoint& black, PlaneView<float> out,
                 Executor& executor);
/// Subtracts the dark frame from a region of the active area whose corner is at an even column and row.
/// @param out  `part` height x width
void to_fraction(const RawDn& raw, const DarkFrame& dark, const BlackPoint& black, const Rect& part,
                 PlaneView<float> out, Executor& executor);

/// Returns the active area with the dark frame subtracted and the sites' means left in, rounded to integer codes, for
/// measurements on a frame before processing. Images are developed from the output of to_fraction.
RawFrame measurable_without_dark(const RawFrame& frame, const DarkFrame& dark, const BlackPoint& black,
                                 Executor& executor);

}  // namespace lowlux::isp
