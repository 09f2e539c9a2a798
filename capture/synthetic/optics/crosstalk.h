#pragma once

#include <span>

#include "isp/base/plane.h"

namespace lowlux::capture {

/// Crosstalk of a sensor: the fraction c of SensorModel, and the light-shielded columns at the left, which have none.
struct Crosstalk {
  double fraction = 0;
  int masked_columns = 0;
};

/// Computes a part of a row of the charge rate after optical crosstalk: of the light of a pixel, a fraction c goes to
/// each of its four neighbours and 1 - 4 c stays,
///     out(x, y) = in(x, y) + c * sum over neighbours n of (in(n) - in(x, y)).
/// Where there is no neighbour, at the borders of the frame and of its light-shielded columns, the fraction stays in
/// the pixel: the sum over the frame stays the same. Each photon, or its electron, goes its own way: counts stay
/// independent and Poisson distributed.
/// @param rate     rate of the frame [e-/s]
/// @param x0, y    of the first pixel
/// @param rate_out its pixels from x0 on [e-/s]
void mix_neighbours(const PlaneView<const float>& rate, const Crosstalk& crosstalk, int x0, int y,
                    std::span<float> rate_out);

}  // namespace lowlux::capture
