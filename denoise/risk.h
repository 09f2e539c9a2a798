#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "isp/base/estimate.h"

namespace lowlux::denoise {

/// Any denoiser: as many samples out as in, planes end to end if there are several. It must give the same for the same.
using Filter = std::function<void(std::span<const double> in, std::span<double> out)>;

/// How a filter's answer to a little more noise is probed.
struct RiskProbe {
  double step = 0.3;  // of the noise's standard deviation; at 1 hard thresholds mislead by factors
  int draws = 3;      // at least 2
  std::uint64_t seed = 0;
};

/// Mean squared error of a filter's output, per sample, estimated without the truth (Stein 1981; Ramani, Blu & Unser,
/// IEEE TIP 17 (2008) 1540, for black boxes):
///     mean((F(x) - x)^2) - mean(v) + 2 mean(n (F(x + eps n) - F(x))) / eps,   n ~ Normal(0, v)
/// Within 10 % where the error is at least 0.1 v; useless below 0.01 v, where an error of 1 % in v swamps it.
/// @param noisy     x, at least one sample, finite
/// @param variance  v of each sample's noise, >= 0: normal, independent. Not to be taken from the single noisy sample
/// @return the estimate, which may be negative; the standard error is that of the probe's draws alone
Estimate estimated_risk(std::span<const double> noisy, std::span<const double> variance, const Filter& filter,
                        const RiskProbe& probe = {});

/// The same without the approximation that the noise is normal, for y = Poisson(lambda) + Normal(0, sigma^2) [e-] and a
/// filter that estimates lambda (Luisier, Blu & Unser, IEEE TIP 20 (2011) 696, Theorem 1; N samples):
///     (1/N) [ |F(y)|^2 - 2 y.F-(y) + 2 sigma^2 div F-(y) + |y|^2 - 1.y ] - sigma^2,   F-_n(y) = F_n(y - e_n)
/// The divergence is taken by differences over +-step sigma. It filters the picture 3 N + 1 times: for small pictures.
/// @param charge_e     y: pedestal removed, dark charge still in; 1 to 65536 samples
/// @param noise_std_e  sigma, >= 0
double poisson_gaussian_risk(std::span<const double> charge_e, double noise_std_e, const Filter& filter,
                             double step = 0.3);

}  // namespace lowlux::denoise
