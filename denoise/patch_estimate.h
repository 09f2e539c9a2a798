#pragma once

#include <optional>

#include "isp/base/matrix3.h"
#include "isp/model/colorimetry.h"

namespace lowlux::denoise {

/// What was measured on an evenly lit patch. Figures of three are those of R, G and B.
struct PatchMean {
  Vector3 charge_e{};                  // mean of y: pedestal removed, dark charge still in, signed
  Vector3 dark_e{};                    // mean dark charge, >= 0
  double noise_std_e = 0;              // read noise and quantisation
  Vector3 pixels{1, 1, 1};             // N, > 0; a Bayer mosaic of n cells has {n, 2 n, n}
  std::optional<Vector3> dark_pixels;  // M, > 0: the dark was measured on so many; absent: it is known exactly
};

/// Tristimulus values and their covariance, both in the unit of the matrix times e-.
struct XyzEstimate {
  isp::Xyz value;
  Matrix3 covariance{};
};

/// The patch's light with its covariance by plug-in: A (y - d), A diag(V) A^T with
///     V_k = (max(y_k, 0) + sigma^2) / N_k [+ (d_k + sigma^2) / M_k]
/// isp::chroma_crb tells the same of a patch whose true signal is known.
XyzEstimate xyz_estimate(const Matrix3& camera_to_xyz, const PatchMean& patch);

/// The linear forms whose ratios u' and v' are: u' = 4 X / W, v' = 9 Y / W, W = X + 15 Y + 3 Z.
inline constexpr Vector3 u_form{4, 0, 0};
inline constexpr Vector3 v_form{0, 9, 0};
inline constexpr Vector3 weight_form{1, 15, 3};

constexpr double dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Cov(a . x, b . x) = a^T C b of a vector x with covariance C.
constexpr double covariance_of(const Vector3& a, const Matrix3& c, const Vector3& b) { return dot(a, c * b); }

}  // namespace lowlux::denoise
