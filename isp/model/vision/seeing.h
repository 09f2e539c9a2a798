#pragma once

#include "isp/base/result.h"

namespace lowlux::isp {

/// Describes the losses of photons between cornea and photopigment, each a fraction 0..1 except the density.
struct RetinalPath {
  double transmittance = 1;             // tau, of the media in front of the retina
  double guided = 1;                    // f, the fraction that enters receptors
  double optical_density = 0;           // D, of the photopigment, decadic; >= 0
  double isomerisation_efficiency = 1;  // gamma, isomerisations per absorbed photon
};

/// Returns the isomerisations per photon at the cornea: alpha = tau f (1 - 10^-D) gamma (thesis Eq. 2.5).
/// Errors: a fraction outside 0..1, a density that is negative or not a number.
Result<double> isomerisations_per_photon(const RetinalPath& path);

/// Describes a flash and the eye that looks at it.
struct Flash {
  double photons = 0;                    // N, mean at the cornea
  double isomerisations_per_photon = 1;  // alpha
  double dark_isomerisations = 0;        // D, mean number without light in the same time
};

/// Returns the probability of seeing: that at least `threshold` isomerisations happen, their number being a Poisson
/// variable of mean x = alpha N + D (thesis Eq. 2.1 to 2.7). It is the regularised lower incomplete gamma function
/// P(threshold, x), here with full precision also where it is tiny, unlike 1 - sum of Poisson terms.
/// @param threshold  K >= 1
/// Errors: a figure of the flash that is negative or not finite; a threshold below 1.
Result<double> frequency_of_seeing(const Flash& flash, int threshold);

/// Returns the mean number of isomerisations at which a flash is seen with a given probability: the inverse of
/// frequency_of_seeing. @param probability  strictly between 0 and 1
/// Errors: a probability or threshold outside its range.
Result<double> isomerisations_seen_with(double probability, int threshold);

/// Returns the contrast sensitivity of the eye, 1 over the smallest visible modulation (Barten, Proc. SPIE 5294 (2003)
/// 231-238, Eq. 11):
///     S = 5200 exp(-0.0016 u^2 (1 + 100/L)^0.08) / sqrt((1 + 144/X^2 + 0.64 u^2) (63/L^0.83 + 1/(1 - exp(-0.02 u^2))))
/// @param cycles_per_degree  u > 0
/// @param luminance_cd_m2    L; the result is 0 where it is not above 0, and where it is not a number
/// @param field_deg          X > 0, the side of the field of view
double barten_sensitivity(double cycles_per_degree, double luminance_cd_m2, double field_deg);

/// Returns the smallest modulation visible at 2 cycles per degree in a field of 10 degrees, scaled to 0.41 % at 100
/// cd/m2 (Wanat & Mantiuk 2014), at most 0.999.
double threshold_contrast(double luminance_cd_m2);

/// Returns threshold_contrast as half the logarithm of the ratio of the brightest to the darkest, log10((1 + M) / (1 -
/// M)) / 2.
double threshold_log_contrast(double luminance_cd_m2);

}  // namespace lowlux::isp
