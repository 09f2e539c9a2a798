#pragma once

#include <array>
#include <vector>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/bench/scenes/denoise_scene.h"

namespace lowlux::isp {

/// Applies this project's multi-scale DCT behind a variance-stabilising transform: f of each raw value with its dark
/// (Anscombe), the denoiser at `level` on noise of standard deviation 1, the exact unbiased inverse (Makitalo & Foi
/// 2013), then the dark subtracted. The denoiser does not use the signal in its values: they are scaled by 3e4,
/// and their mean, taken as a variance, is 3e-3 of the square of that at 2000 e-. Chroma starts at the level that q = s
/// / sqrt(s + d + sigma^2) of the entire image requires, and is not drawn towards neutral, which stabilised values do
/// not have.
/// @param white_gain  white gain of the stabilised colours
/// @param signal_e  as large as the shot
void gat_denoise(denoise::Denoiser& denoiser, const DenoiseShot& shot, denoise::Level level,
                 const std::array<double, 3>& white_gain, PlaneView<float> signal_e, Executor& executor);

}  // namespace lowlux::isp

namespace lowlux::denoise {

/// Returns the generalised Anscombe transform of y = Poisson(lambda) + Normal(0, sigma^2), whose standard deviation is
/// about 1:
///     f(y) = 2 sqrt(max(y + 3/8 + sigma^2, 0))
/// (Anscombe 1948; Starck, Murtagh & Bijaoui 1998). It holds from a total of about 4 e- up, or with a read noise of
/// about 1 e-; below, single electrons are distinguishable or fall below the root's domain.
/// @param charge_e      y [e-]: pedestal subtracted, dark charge still in, signed. Clamping it at 0 first would bias it
/// @param noise_std_e   sigma [e-], >= 0: read noise and quantisation
double gat_forward(double charge_e, double noise_std_e);

/// Returns E[f(y)] for a mean lambda >= 0 [e-], to about 1e-10 where lambda + sigma^2 < 300 e-^2; above that to the
/// first order in 1 / (lambda + sigma^2), an error below 5e-4 e-.
double gat_mean(double poisson_mean_e, double noise_std_e);

/// Returns lambda from D, an estimate of E[f(y)], to first order: D^2/4 - 1/8 - sigma^2, at least 0. The bias is up to
/// 0.25 e- without read noise (0.22 e- at 0.1 e-), up to 0.05 e- from sigma = 1 e- on.
double gat_inverse_asymptotic(double stabilised, double noise_std_e);

/// Returns lambda from D in closed form, at least 0 (Makitalo & Foi, IEEE TIP 20 (2011) 2697, Eq. 10; the term in
/// sigma: 22 (2013) 91, Eq. 6):
///     D^2/4 + sqrt(3/2)/(4 D) - 11/(8 D^2) + 5 sqrt(3/2)/(8 D^3) - 1/8 - sigma^2
/// The bias is within 0.05 e-. The result is 0 below D = 2 sqrt(3/8), where the polynomial is not valid.
double gat_inverse_closed_form(double stabilised, double noise_std_e);

/// Tabulates lambda against E[f(y)] for one sigma, for the exact unbiased inverse.
struct GatTable {
  double noise_std_e = 0;
  std::vector<double> stabilised;  // rising, from E[f] at lambda = 0; empty where the asymptotic form is always used
  std::vector<double> mean_e;      // lambda at these nodes
  std::vector<double> slope_e;     // d lambda / dD at the nodes, for the cubic between them
};

/// Returns the table for a read noise sigma >= 0 [e-], finite: about 400 nodes, even in log(lambda), up to
/// lambda + sigma^2 = 300.
GatTable gat_table(double noise_std_e);

/// Returns the exact unbiased inverse: the lambda whose E[f(y)] is D. It is 0 for D <= E[f] at lambda = 0 and
/// asymptotic beyond the table. It rises monotonically; its bias is below 1e-3 e-. It is exact only where all samples
/// that were averaged to D have the same lambda.
double gat_inverse_exact(const GatTable& table, double stabilised);

}  // namespace lowlux::denoise
