#pragma once

#include <cstdint>
#include <optional>

#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/matrix3.h"
#include "isp/base/plane.h"
#include "isp/model/colour/chroma_bound.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::denoise {

/// Estimates the chromaticity before desaturation by dark current: inverts Eq. 4.23, then shrinks the result towards a
/// neutral by the confidence w,
///     c = c0 + w (Delta_c - c0),   Delta_c = n_c + (I_c - n_c) / alpha
/// The gain is w / alpha. With w = 1 it is the exact inverse.
/// @param measured, dark  I_c and n_c
/// @param alpha           the signal's fraction of S = X + Y + Z, 0..1
/// @param confidence      w, 0..1
/// @return the neutral where alpha is not positive or the result is not finite: dark charge alone holds no information
/// about the light
isp::Xy resaturate_xy(const isp::Xy& measured, const isp::Xy& dark, double alpha, double confidence,
                      const isp::Xy& neutral);

/// Known properties of a finished image in which dark current was left. For raw data prefer subtract_dark().
struct Resaturation {
  isp::Xyz dark;                            // the black point, in the image's unit; X + Y + Z >= 0
  isp::Xy neutral = isp::white_d65;         // neutral of the image; inside the gamut
  double chroma_noise = 0;                  // std of X - x0 S and of Y - y0 S of a pixel, in the image's unit, >= 0
  double prior_std = 0.065;                 // sigma_p of x and of y, natural scenes: 0.04 in u'v' times 0.34 / 0.21
  int radius = 4;                           // alpha is that of the mean over (2 radius + 1)^2 pixels, 0..64
  Matrix3 xyz_to_rgb = identity3();         // the gamut: no channel below 0
  PlaneView<const std::uint8_t> saturated;  // empty, or not 0 where saturated: left as it is, and out of the means
};

/// Corrects an image in XYZ for its dark charge: each pixel keeps its luminance Y and gets the chromaticity of
/// resaturate_xy(), with
///     S_Delta = mean S - S_n,   alpha = S_Delta / mean S,   w = S_Delta^2 sigma_p^2 / (S_Delta^2 sigma_p^2 + v_r)
/// so that the gain never exceeds mean S sigma_p / (2 sqrt(v_r)). Colours outside the gamut are moved along the line to
/// the neutral of the same luminance until no channel is below 0; no channel is clipped by itself. Where S_Delta, S or
/// Y is not positive a pixel becomes neutral. Pixels with a value that is not finite are left as they are.
/// @param in, out  three planes of equal size; they may be the same
void resaturate(const RgbView<const float>& in, const Resaturation& how, const RgbView<float>& out);

/// Subtracts the mean dark charge from a mosaic, y - d, and keeps the sign: values below zero are data, and clipping
/// them would lift dark means by 0.4 standard deviations. In linear data this inverts Eq. 4.23 completely.
/// @param dark_e  dark of the four sites of the mosaic [e-]
void subtract_dark(PlaneView<const float> charge_e, const PerSite<double>& dark_e, PlaneView<float> signal_e);

/// Subtracts the mean dark charge from a mosaic in its own memory, and keeps the sign.
SignalElectrons subtract_dark(RawElectrons charge, const PerSite<double>& dark_e);

/// The weights of an intensity's sum. The law of desaturation has its own alpha for each.
enum class ShareWeights : std::uint8_t {
  xy,  // S = X + Y + Z
  uv,  // W = X + 15 Y + 3 Z
};

double intensity(const isp::Xyz& colour, ShareWeights weights);

/// Returns the signal's fraction of every measured pixel (Eq. 4.24), for display: where it is small, colour is that of
/// the dark charge.
///     alpha = s / (s + n),  s the mean of the signal's intensity over a square of 2 radius + 1 pixels
/// @param signal_xyz  dark already subtracted, signed
/// @param dark        in the same unit, of positive intensity or 0
/// @param saturated   empty, or nonzero where a pixel is saturated: it is excluded, as it is not the sum of signal and
/// dark
/// @return 0..1; 0 where s is not positive or no pixel of the square can be used. Values that are not finite are
/// excluded
Plane<float> alpha_map(const SceneLinear& signal_xyz, const isp::Xyz& dark, ShareWeights weights, int radius,
                       PlaneView<const std::uint8_t> saturated = {});

/// Measurements of an evenly lit patch. Vectors are R, G and B.
struct PatchMean {
  Vector3 charge_e{};                  // mean of y: pedestal removed, dark charge still in, signed
  Vector3 dark_e{};                    // mean dark charge, >= 0
  double noise_std_e = 0;              // read noise and quantisation
  Vector3 pixels{1, 1, 1};             // N, > 0; a Bayer mosaic of n cells has {n, 2 n, n}
  std::optional<Vector3> dark_pixels;  // M, > 0: number of pixels the dark was measured on; absent: it is known exactly
};

/// Tristimulus values and their covariance, both in the unit of the matrix times e-.
struct XyzEstimate {
  isp::Xyz value;
  Matrix3 covariance{};
};

/// Returns the tristimulus values of the patch's light with their plug-in covariance: A (y - d), A diag(V) A^T with
///     V_k = (max(y_k, 0) + sigma^2) / N_k [+ (d_k + sigma^2) / M_k]
/// isp::chroma_crb computes this for a patch whose true signal is known.
XyzEstimate xyz_estimate(const Matrix3& camera_to_xyz, const PatchMean& patch);

/// Linear forms whose ratios are u' and v': u' = 4 X / W, v' = 9 Y / W, W = X + 15 Y + 3 Z.
inline constexpr Vector3 u_form{4, 0, 0};
inline constexpr Vector3 v_form{0, 9, 0};
inline constexpr Vector3 weight_form{1, 15, 3};

constexpr double dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Returns Cov(a . x, b . x) = a^T C b of a vector x with covariance C.
constexpr double covariance_of(const Vector3& a, const Matrix3& c, const Vector3& b) { return dot(a, c * b); }

/// Prior distribution of colours: normal about a neutral, with one standard deviation in u' and in v'.
struct ChromaPrior {
  isp::UvPrime neutral;
  double std = 0.04;  // sigma_p, that of natural scenes; > 0. Smaller values give less colour and less chroma noise
};

/// A chromaticity estimate with its confidence.
struct ShrunkChroma {
  isp::UvPrime uv;
  double confidence = 0;  // w, 0: the prior's neutral, 1: the measurement's own ratio; below 0.5 it is unrecoverable
};

/// Returns the posterior mean of a chromaticity. With r = N - c0 W (N the numerators of u'v', W their denominator, c0
/// the neutral) assumed normal about 0 with variance sigma_p^2 W^2, and observed with variance v_r:
///     c = c0 + w r / W,   w = W+^2 sigma_p^2 / (W+^2 sigma_p^2 + v_r),   W+ = max(W, 0)
/// v_r is the mean of the two components' variances. The result is never further than |r| sigma_p / (2 sqrt(v_r)) from
/// the neutral; it is the neutral itself, w = 0, where W is not positive or any value is not finite.
ShrunkChroma shrunk_chroma(const XyzEstimate& estimate, const ChromaPrior& prior);

/// Returns the confidence w from the prediction of isp::chroma_crb or isp::chroma_of_means: sigma_p^2 / (sigma_p^2 +
/// (C_uu + C_vv) / 2). It is 1/2 where the rss standard deviation is sqrt(2) sigma_p. 0 for covariances that are
/// infinite or NaN.
double chroma_confidence(const isp::UvCovariance& covariance, double prior_std);

/// Returns the confidence w in planes of luma L and a chroma difference: L+^2 rho^2 / (L+^2 rho^2 + residual variance).
/// @param luma               L [e-], signed; not positive gives 0
/// @param residual_variance  that of the chroma after denoising [e-^2], >= 0; 0 gives 1 in any light
/// @param rho                standard deviation of chroma / luma a priori: 1.5 is weak, 0.6 visibly desaturates shadows
double plane_confidence(double luma, double residual_variance, double rho);

/// Returns means over squares of 2 radius + 1 pixels, cropped at the image's edges. NaN marks a pixel without a value:
/// NaN and infinities are excluded from the means, and the mean is NaN where a square holds no value. Every mean is
/// summed anew, so that large values leave no rounding error in others.
/// @param radius  0 (a copy) to 64
Plane<double> box_mean(const Plane<double>& values, int radius);

}  // namespace lowlux::denoise
