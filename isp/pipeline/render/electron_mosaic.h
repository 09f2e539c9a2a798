#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/pipeline/plan/levels.h"

namespace lowlux::isp {

/// Subtracts black from the active area of a Bayer or monochrome frame: the dark frame, or the black point.
void subtract_black(const RawDn& raw, const RawLevels& levels, PlaneView<float> out, Executor& executor);
/// Subtracts black from a crop of the active area whose corner is at an even column and row.
void subtract_black(const RawDn& raw, const RawLevels& levels, const Rect& part, PlaneView<float> out,
                    Executor& executor);

/// Returns the active area of a Bayer frame in electrons as measured, dark charge included, defects repaired, signed.
/// Precondition: levels.electrons_at_white.
/// @param memory  reused where it has the size
RawElectrons raw_electrons(const RawFrame& frame, const RawLevels& levels, Plane<float> memory, Executor& executor);
/// Converts a crop of the active area, its corner at an even column and row, to electrons as measured, dark charge
/// included, signed. Defects within two pixels of its border are repaired from the neighbours that are known.
void raw_electrons(const RawFrame& frame, const RawLevels& levels, const Rect& part, PlaneView<float> out,
                   Executor& executor);

/// Returns values of the active area's sites in the order of the sites of a crop of it.
PerSite<float> of_crop(const PerSite<double>& active, const Rect& crop);

/// Returns the value of a white pixel of each site in the mosaic without dark charge: electrons, or 1 where it is in
/// fractions of white.
inline PerSite<double> units_at_white(const RawLevels& levels) {
  return levels.electrons_at_white ? light_at_white_e(levels) : PerSite<double>{1, 1, 1, 1};
}

/// Returns the white-balance gain of each site of a crop of the active area, divided by the site's value at white.
PerSite<float> site_gains(const RawDn& raw, const std::array<float, 3>& white_gain,
                          const PerSite<double>& units_at_white, const Rect& crop);
}  // namespace lowlux::isp
