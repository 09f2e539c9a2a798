#pragma once

#include <cstdint>

#include "isp/base/image.h"
#include "isp/base/matrix3.h"
#include "isp/base/plane.h"
#include "isp/model/colorimetry.h"

namespace lowlux::denoise {

/// The chromaticity behind one that dark current has desaturated, as far as it can be told: Eq. 4.23 undone, then
/// shrunk towards a neutral by the confidence w,
///     c = c0 + w (Delta_c - c0),   Delta_c = n_c + (I_c - n_c) / alpha
/// The gain is w / alpha. With w = 1 it is the exact inverse.
/// @param measured, dark  I_c and n_c
/// @param alpha           the signal's share in S = X + Y + Z, 0..1
/// @param confidence      w, 0..1
/// @return the neutral where alpha is not positive or nothing finite comes out: dark alone says nothing of the light
isp::Xy resaturate_xy(const isp::Xy& measured, const isp::Xy& dark, double alpha, double confidence,
                      const isp::Xy& neutral);

/// What is known of a finished picture in which dark current was left. For raw data subtract_dark() is the better way.
struct Resaturation {
  isp::Xyz dark;                            // the black point, in the picture's unit; X + Y + Z >= 0
  isp::Xy neutral = isp::white_d65;         // of the picture; inside the gamut
  double chroma_noise = 0;                  // std of X - x0 S and of Y - y0 S of a pixel, in the picture's unit, >= 0
  double prior_std = 0.065;                 // sigma_p of x and of y, natural scenes: 0.04 in u'v' times 0.34 / 0.21
  int radius = 4;                           // alpha is that of the mean of 2 radius + 1 squared pixels, 0..64
  Matrix3 xyz_to_rgb = identity3();         // the gamut: no channel below 0
  PlaneView<const std::uint8_t> saturated;  // empty, or not 0 where a pixel is: left as it is, and out of the means
};

/// A picture in XYZ with its dark undone: each pixel keeps its luminance Y and gets the chromaticity resaturate_xy()
/// tells, with
///     S_Delta = mean S - S_n,   alpha = S_Delta / mean S,   w = S_Delta^2 sigma_p^2 / (S_Delta^2 sigma_p^2 + v_r)
/// so that the gain never exceeds mean S sigma_p / (2 sqrt(v_r)). What leaves the gamut is moved along the line to the
/// neutral of the same luminance until no channel is below 0; no channel is clipped by itself. Where S_Delta, S or Y is
/// not positive a pixel becomes neutral. Pixels with a value that is not finite are left as they are.
/// @param in, out  three planes of equal size; they may be the same
void resaturate(const RgbView<const float>& in, const Resaturation& how, const RgbView<float>& out);

}  // namespace lowlux::denoise
