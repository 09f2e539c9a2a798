#pragma once

#include <optional>
#include <span>
#include <vector>

#include "isp/base/result.h"
#include "isp/base/spectrum.h"

namespace lowlux::isp {

inline constexpr double planck_j_s = 6.62607015e-34;      // h, exact in the SI since 2019
inline constexpr double light_speed_m_per_s = 299792458;  // c, exact

/// Returns the energy h c / lambda of one photon [J]; wavelength_nm > 0.
double photon_energy_j(double wavelength_nm);

/// Returns the bin width of each node of a spectrum [nm]: half the distance to each of its neighbours. The sum of value
/// times width is integrate(spectrum). The steps may be unequal; the two ends have half a step.
std::vector<double> bin_widths_nm(const Spectrum& spectrum);

/// Returns the photons of a radiance: lambda L / (h c) at each node (thesis Eq. 3.2, 4.3).
/// @param radiance  [W m-2 sr-1 nm-1]
/// @return [photons s-1 m-2 sr-1 nm-1] at the same nodes
/// Errors: a negative radiance, a wavelength that is not positive, a quotient beyond double.
Result<Spectrum> photon_radiance(const Spectrum& radiance);

/// Returns a spectral power divided by its integral, so that the integral is 1 [nm-1].
/// Errors: a negative value; no power at all; an integral beyond double.
Result<Spectrum> normalised(const Spectrum& power);

/// Holds the mean counts of photons, one for each node of a spectrum, all independent Poisson variables.
struct PhotonMeans {
  std::vector<double> wavelengths_nm;
  std::vector<double> widths_nm;
  std::vector<double> photons;  // x_i, as many; 0 is allowed, also for all but one
};

/// Returns the photons of a source in a time: x_i = F T s_i lambda_i dlambda_i / (h c), with s the normalised power
/// (thesis Eq. 3.5).
/// @param power       relative spectral power, any scale
/// @param power_w     F, over all wavelengths [W], >= 0
/// @param exposure_s  T, >= 0
/// Errors: those of normalised(); power_w or exposure_s negative or not finite; a wavelength that is not positive; a
/// mean beyond double.
Result<PhotonMeans> mean_photons(const Spectrum& power, double power_w, double exposure_s);

/// Returns the normalised spectrum estimated from counted photons: s_i = (X_i / lambda_i) / (dlambda_i sum_j X_j /
/// lambda_j), so that the sum of s_i dlambda_i is 1. (Thesis Eq. 3.7 prints dlambda inside the sum, and then it is
/// not.)
/// @param counts  X_i >= 0 of the bins of `means`, as many
/// @return [nm-1]; nullopt if there is no photon: then there is no spectrum
std::optional<Spectrum> estimated_spectrum(const PhotonMeans& means, std::span<const double> counts);

/// Returns the distance of two spectra on the same nodes (thesis Eq. 3.8): sqrt(sum of dlambda (a - b)^2) [nm-1/2 for
/// spectra in nm-1].
double spectral_distance(const Spectrum& a, const Spectrum& b);

/// Returns the expectation of the squared distance between estimated and true normalised spectrum, to first order in
/// 1/photons:
///     E[D^2] = sum_i Var(p_i) / dlambda_i,  p_i = w_i / W, w_i = x_i / lambda_i, W = sum w_i,
///     Var(p_i) = (x_i / lambda_i^2 (1 - 2 p_i) + p_i^2 sum_j x_j / lambda_j^2) / W^2
/// @return [nm-1]; nullopt if all means are 0
std::optional<double> expected_squared_distance(const PhotonMeans& means);

}  // namespace lowlux::isp
