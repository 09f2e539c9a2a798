#pragma once

#include <span>

#include "denoise/lines/line_noise.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/pipeline/plan/levels.h"

namespace lowlux::isp {

/// Subtracts black from a crop of the active area of a Bayer or monochrome frame, its corner at an even column and row:
/// the dark frame, or the black point.
void subtract_black(const RawDn& raw, const RawLevels& levels, const Rect& part, PlaneView<float> out,
                    Executor& executor);

/// Returns the active area of a Bayer frame in electrons as measured, dark charge included, defects repaired, signed.
/// Precondition: levels.electrons_at_white.
RawElectrons raw_electrons(const RawFrame& frame, const RawLevels& levels, Executor& executor);
/// Converts a crop of the active area, its corner at an even column and row, to electrons as measured, dark charge
/// included, signed. Defects within two pixels of its border are repaired from the neighbours that are known.
void raw_electrons(const RawFrame& frame, const RawLevels& levels, const Rect& part, PlaneView<float> out,
                   Executor& executor);

/// Subtracts the offsets of rows and columns from a crop of the active area.
void subtract_lines(std::span<const denoise::LineOffsets> lines, const Rect& part, PlaneView<float> raw_e);

/// Returns values of the active area's sites in the order of the sites of a crop of it.
PerSite<float> of_crop(const PerSite<double>& active, const Rect& crop);

/// Returns the white-balance gain of each site of a crop of the active area, divided by the site's value at white.
PerSite<float> site_gains(const RawDn& raw, const std::array<float, 3>& white_gain, const PerSite<double>& at_white,
                          const Rect& crop);
}  // namespace lowlux::isp
