#pragma once

#include <array>

#include "isp/base/executor.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// Describes how much brighter shadows become and how much darker lights, and where neither may happen.
struct LocalTone {
  float share = 0;                                     // 0..1: 0 changes nothing
  std::array<float, 3> luminance{0.25f, 0.5f, 0.25f};  // luminance of a unit of each channel; 1 is shown as white
  float limit = 1;                                     // scene-linear value after exposure that it is: tone_limit
};

/// CIE L* that the noise of an even area may have where local tone makes it brighter.
inline constexpr double local_tone_noise = 2;

/// Makes dark areas of linear RGB brighter and bright ones darker, in place, and keeps their detail.
///
/// Every channel of a pixel is multiplied by 2^e, so that colours stay. With l = log2((max(Y, 0) + n) limit / 0.18),
/// where Y is the luminance and n the standard deviation of its noise, B is what remains of l without detail: a guided
/// filter of l by itself (He, Sun and Tang, IEEE TPAMI 35, 2013) on means of 4 x 4 pixels, whose coefficients are
/// interpolated between their centres,
///     B = a l + b,   a = v / (v + 0.25),   b = (1 - a) m
/// for the mean m and the variance v of l in a square of 1/20 of the longer side; a and b are means over such a square,
/// too. B = 0 is middle grey. Then
///     e = min(share t / (1 + t / 6), M),   t = -B,      in the shadows
///     e = -share B (1 - B / W),            B = 0..W,    in the lights,   W = log2(limit / 0.18)
/// Even areas keep their order for every share, and middle grey, black and white stay. M is the largest lift at which
/// the noise of an even area of that luminance stays below local_tone_noise in CIE L*, after the standard tone curve
/// too: gain_within_noise_limit. It is the largest M of a cell and its neighbours, and n is at most the geometric mean
/// of the noise over such a square: noise reduction leaves more noise next to lamps, where less lift would be seen as a
/// dark disc. The result does not depend on the number of threads.
/// @param variance  variance of the noise of Y, one value for each cell of 4 x 4 pixels: ceil(height / 4) x ceil(width
/// / 4);
///                  without data the noise is unknown: nothing is limited, and n = 2^-12 of middle grey
void apply_local_tone(const LocalTone& how, PlaneView<const float> variance, const RgbView<float>& rgb,
                      Executor& executor);

}  // namespace lowlux::isp
