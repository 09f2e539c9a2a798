#pragma once

#include <array>
#include <optional>

#include "isp/base/matrix3.h"
#include "isp/merge/frame.h"

namespace lowlux::merge {

/// Largest width of a PSF that is fitted [px].
inline constexpr double max_psf_sigma_px = 6;

/// Holds the start values of a fit, and its prior.
struct PsfStart {
  double x_px = 0;
  double y_px = 0;
  double sigma_px = 1.2;  // also the prior of the width: a factor of exp(+-0.35), one standard deviation
  PerSite<double> background_e{};
};

/// Result of a fit.
struct PsfFit {
  double x_px = 0;
  double y_px = 0;
  double sigma_px = 0;
  Matrix3 covariance{};            // covariance of x, y [px] and ln sigma
  std::array<double, 3> flux_e{};  // R, G, B
  std::array<double, 3> flux_variance_e2{};
  std::array<double, 3> background_e{};
  double significance = 0;  // root of the sum of flux^2 / variance at this place and width, as without the star
  double chi_square = 0;    // with the variance that fits of other PSFs are allowed
  double chi_square_limit = 0;
  int sites = 0;    // with a value
  int missing = 0;  // without
};

/// Fits a Gaussian PSF, integrated over the pixels, to all sites within 3 sigma of the start, rounded up, and one more:
///     mean of site (i, j) = background_c + flux_c E_i E_j,
///     E_i = (erf((i + 1/2 - x) / (sqrt 2 sigma)) - erf((i - 1/2 - x) / (sqrt 2 sigma))) / 2.
/// Background and flux are those of the site's colour c. Weighted least squares with the variance of the model (not of
/// the data, which would favour what is dark by chance): iteratively reweighted Gauss-Newton on x, y and ln sigma,
/// where the linear parameters are eliminated (Golub and Pereyra, SIAM J. Numer. Anal. 10, 1973). Standard errors are
/// those of this model.
/// @return nullopt if the fit does not converge within 1.5 + sigma / 2 px of its start, or too little is measured
std::optional<PsfFit> fit_psf(const FrameView& frame, const PsfStart& start);

}  // namespace lowlux::merge
