#pragma once

#include "isp/base/matrix3.h"
#include "isp/render/colour_table.h"

namespace lowlux::reference {

/// Passes one pixel through a ColourTable, in double.
/// @param noise_to_signal  for a table by noise
Vector3 through_colour_table(const isp::ColourTable& table, const Vector3& rgb, double noise_to_signal = 0);

}  // namespace lowlux::reference
