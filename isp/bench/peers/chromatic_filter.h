#pragma once

#include "isp/base/image.h"

namespace lowlux::isp {

/// Square windows with sides of 2 r + 1 pixels.
struct ChromaticWindows {
  int chroma_radius = 0;
  int luminance_radius = 0;
};

/// Applies the chromatic filter of Lucchese and Mitra (IEEE TIP 13 (2004) 534-548) with square windows: the
/// chromaticity of a pixel becomes the mean of its window's, each weighted by its stimulus S = X + Y + Z, which is the
/// chromaticity of the window's mean light; its luminance is filtered separately:
///     out = mean(RGB over the one window) / mean(Y over it) * mean(Y over the other)
/// Where the mean luminance of the first window is not positive, there is no chromaticity: neutral. The input light
/// keeps its offset: dark charge desaturates, whatever the window.
/// @param linear  linear Rec. 709, finite
/// @param windows  radii 0 and above; at the borders windows are cut
SceneLinear chromatic_filtered(const RgbView<const float>& linear, const ChromaticWindows& windows);

}  // namespace lowlux::isp
