#pragma once

#include <array>

#include "isp/base/executor.h"
#include "isp/base/image.h"

namespace lowlux::isp {

inline constexpr double min_sharpening_px = 0.3;
inline constexpr double max_sharpening_px = 1.5;

/// Describes the blur that lens, filter and pixels left, and what is to be left as it is.
struct CaptureSharpening {
  float blur_px = 0.6f;                                // standard deviation of the Gaussian, 0.3 to 1.5
  std::array<float, 3> luminance{0.25f, 0.5f, 0.25f};  // weights of the channels
  std::array<float, 3> saturation{1, 1, 1};            // pixels near a value from 0.95 of it on are not sharpened,
                                                       // those around them gradually
};

/// Sharpens the luminance of linear RGB in place, as far as it exceeds the noise.
///
/// With H the Gaussian, Y the luminance, the detail that is given back is
///     D = 1.5 H ((1 - H) + (1 - H)^2 + (1 - H)^3) Y
/// The sum is van Cittert's inverse of H up to (1 - H)^4; the factor H leaves out what H took nearly all of, because
/// there is more error of demosaicing than detail. A wave that H left with 0.9, 0.8, 0.5, 0.3, 0.1 of its contrast
/// has 1.03, 1.04, 0.83, 0.51, 0.14 of it. Each pixel gets g D in all channels, so that colour differences stay. g =
/// max(0, 1 - 3 N / S) is a Wiener gain: S is the mean of D^2 over 7 x 7 pixels, N what noise of the stated variance
/// makes of it if it is independent from pixel to pixel. Noise reduction leaves coarser noise, of which D has less: g
/// is then too small rather than too large. A negative g D is limited so that no channel is lowered below three
/// quarters of its least value within 2 pixels, where this is positive, else below that value: there are no dark lines
/// next to lamps and edges. The result does not depend on the number of threads.
/// @param variance  variance of the noise of Y, one value for each cell of 4 x 4 pixels: ceil(height / 4) x ceil(width
/// / 4)
void sharpen_capture(const CaptureSharpening& how, PlaneView<const float> variance, const RgbView<float>& rgb,
                     Executor& executor);

/// Returns the sum of the squared coefficients of D: the variance of D for independent noise of variance 1.
double detail_noise_gain(float blur_px);

}  // namespace lowlux::isp
