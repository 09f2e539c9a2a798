#pragma once

#include <array>

#include "isp/base/executor.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// Rebuilds saturated channels of white-balanced camera RGB in place, from the channels that are not saturated and from
/// the colour of the light around.
///
/// A channel counts as saturated from 0.95 of its level on, gradually up to 0.99, because demosaicing and noise
/// reduction move values. The colour of the light, the logarithms of R / G and B / G, is taken from pixels without a
/// saturated channel in cells of 4 x 4 pixels that hold a saturated one or lie next to such a cell, with more weight
/// the nearer all of their channels are to saturation. Where no such pixel is near, wider means fill in (a pyramid over
/// the cells), and where there is none, neutral. Then
///     estimate of c = mean over the other channels k that are not saturated of value_k colour_c / colour_k
/// or, if all are saturated, the least light of that colour that saturates all. No value is lowered. Values of pixels
/// without a saturated channel keep their bits. The result does not depend on the number of threads.
/// @param saturation  the value of each channel at which the sensor saturates, above 0
void reconstruct_highlights(const RgbView<float>& rgb, const std::array<float, 3>& saturation, Executor& executor);

}  // namespace lowlux::isp
