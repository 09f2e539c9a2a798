#pragma once

#include <array>
#include <vector>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/bench/scenes/denoise_scene.h"

namespace lowlux::isp {

/// The same multi-scale DCT behind a variance-stabilising transform: f of each raw value with its dark (Anscombe), the
/// denoiser at `level` on noise of standard deviation 1, the exact unbiased inverse (Makitalo & Foi 2013), then the
/// dark off. The denoiser is not told of the signal in its values: they are scaled by 1e6, beside whose square their
/// mean is below 1e-3 as a variance. Chroma starts at the level that the whole picture's q = s / sqrt(s + d + sigma^2)
/// asks for, and is not drawn towards neutral, which stabilised values do not have.
/// @param white_gain  of the stabilised colours
/// @param signal_e  as large as the shot
void gat_denoise(denoise::Denoiser& denoiser, const DenoiseShot& shot, denoise::Level level,
                 const std::array<double, 3>& white_gain, PlaneView<float> signal_e, Executor& executor);

}  // namespace lowlux::isp

namespace lowlux::denoise {

/// The generalised Anscombe transform of y = Poisson(lambda) + Normal(0, sigma^2), whose standard deviation is about 1:
///     f(y) = 2 sqrt(max(y + 3/8 + sigma^2, 0))
/// (Anscombe 1948; Starck, Murtagh & Bijaoui 1998). It holds from a total of about 4 e- up, or with a read noise of
/// about 1 e-; below, electrons are told apart or lost below the root's domain.
/// @param charge_e      y [e-]: pedestal removed, dark charge still in, signed. Clamping it at 0 first would bias it
/// @param noise_std_e   sigma [e-], >= 0: read noise and quantisation
double gat_forward(double charge_e, double noise_std_e);

/// E[f(y)] for a mean lambda >= 0 [e-], to about 1e-10 where lambda + sigma^2 < 300 e-^2; from there on to the first
/// order in 1 / (lambda + sigma^2), an error below 5e-4 e-.
double gat_mean(double poisson_mean_e, double noise_std_e);

/// lambda from D, an estimate of E[f(y)], to first order: D^2/4 - 1/8 - sigma^2, at least 0. Bias up to 0.25 e- without
/// read noise (0.22 e- at 0.1 e-), up to 0.05 e- from sigma = 1 e- on.
double gat_inverse_asymptotic(double stabilised, double noise_std_e);

/// lambda from D in closed form, at least 0 (Makitalo & Foi, IEEE TIP 20 (2011) 2697, Eq. 10; the term in sigma: 22
/// (2013) 91, Eq. 6):
///     D^2/4 + sqrt(3/2)/(4 D) - 11/(8 D^2) + 5 sqrt(3/2)/(8 D^3) - 1/8 - sigma^2
/// Bias within 0.05 e-. 0 below D = 2 sqrt(3/8), where the polynomial is of no use.
double gat_inverse_closed_form(double stabilised, double noise_std_e);

/// lambda against E[f(y)] for one sigma: what the exact unbiased inverse looks up.
struct GatTable {
  double noise_std_e = 0;
  std::vector<double> stabilised;  // rising, from E[f] at lambda = 0; empty where the asymptotic form serves throughout
  std::vector<double> mean_e;      // lambda at these places
  std::vector<double> slope_e;     // d lambda / dD there, for the cubic between them
};

/// The table for a read noise sigma >= 0 [e-], finite: about 400 places, even in log(lambda), up to lambda + sigma^2 =
/// 300.
GatTable gat_table(double noise_std_e);

/// The exact unbiased inverse: the lambda whose E[f(y)] is D. 0 for D <= E[f] at lambda = 0; asymptotic beyond the
/// table. Rises monotonically; bias below 1e-3 e-. Exact only where all samples that were averaged to D share one
/// lambda.
double gat_inverse_exact(const GatTable& table, double stabilised);

}  // namespace lowlux::denoise
