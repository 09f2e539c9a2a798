#pragma once

#include <array>

#include "isp/base/matrix3.h"

/// Equations of the fit of a PSF: see psf_fit.h.
namespace lowlux::merge {

inline constexpr int max_psf_radius = 13;  // of the sites of a fit
inline constexpr int max_psf_side = 2 * max_psf_radius + 1;

/// Integral of a Gaussian over each pixel of one axis, and its derivatives by the place and by ln sigma.
struct AxisProfile {
  std::array<double, max_psf_side> value{};
  std::array<double, max_psf_side> by_place{};
  std::array<double, max_psf_side> by_width{};

  /// @param count up to max_psf_side pixels from `first` on
  AxisProfile(int first, int count, double place, double sigma);
};

/// Weighted sums over the sites of one colour: of 1, the PSF E, its derivatives D and the signal.
struct ColourSums {
  double one = 0, e = 0, ee = 0, y = 0, ey = 0, yy = 0;
  Vector3 d{}, ed{}, yd{};
  Matrix3 dd{};  // lower triangle

  void add(double w, double psf, const Vector3& derivative, double signal) {
    one += w;
    e += w * psf;
    ee += w * psf * psf;
    y += w * signal;
    ey += w * psf * signal;
    yy += w * signal * signal;
    for (std::size_t a = 0; a < 3; ++a) {
      d[a] += w * derivative[a];
      ed[a] += w * psf * derivative[a];
      yd[a] += w * signal * derivative[a];
      for (std::size_t b = 0; b <= a; ++b) dd[a][b] += w * derivative[a] * derivative[b];
    }
  }
};

/// Background and flux of one colour, and how the flux depends on the shape.
struct ColourFit {
  double background = 0;
  double flux = 0;
  double flux_variance = 0;  // at a fixed shape
  Vector3 share{};           // the part of each derivative that is like the PSF
  bool measured = false;     // false: the sites show the background at best
};

/// Solves for background and flux.
ColourFit solve_colour(const ColourSums& sums);

/// Normal equations of x, y and ln sigma, the linear parameters eliminated.
struct ShapeEquations {
  Matrix3 normal{};
  Vector3 gradient{};

  void add(const ColourSums& sums, const ColourFit& fit);
};

}  // namespace lowlux::merge
