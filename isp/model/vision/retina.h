#pragma once

#include <array>
#include <cstdint>

#include "isp/base/result.h"
#include "isp/base/spectrum.h"
#include "isp/model/vision/mesopic.h"
#include "isp/model/vision/seeing.h"

/// Light at the retina: from luminance or spectral radiance to isomerisations in single receptors (thesis Eq. 2.3, 2.5
/// and 3.3), for a standard observer whose figures have a source each. Keys of sources: docs/references.md.
namespace lowlux::isp {

/// Describes the conditions under which the pupil adapts.
struct PupilConditions {
  double field_deg2 = 2827.4;  // area of the field the eye is adapted to; default: a circle of 60 degrees, chosen
  double age_years = 28.58;    // 20 to 83; default: the reference age of the formula
  int eyes = 2;                // adapted eyes, 1 or 2
};

/// Returns the diameter of the light-adapted pupil (watson-yellott-2012, Eq. 21):
///     D = D0 + (age - 28.58) (0.02132 - 0.009562 D0),  D0 = 7.75 - 5.75 F / (F + 2),  F = (L a e / 846)^0.41
/// with a the area of the field [deg2] and e 1 for two eyes, 0.1 for one. Luminances below 0 or not numbers count as 0.
/// Ages are limited to 20..83, the range of the formula.
double adapted_pupil_mm(double luminance_cd_m2, const PupilConditions& conditions = {});
/// Returns the area of a pupil of this diameter [mm2].
double pupil_area_mm2(double diameter_mm);

/// Returns the transmittance of the media in front of the retina without macular pigment (cie-203): Rayleigh scatter
/// and the absorption of the lens, which grows with age. 0.70 at 503 nm, 0.78 at 566 nm, at the default age.
/// @param wavelength_nm  300 to 800
double ocular_transmittance(double wavelength_nm, double age_years = 28.58);

/// Returns the photons that a radiance sends through a pupil: x A for each square degree (thesis Eq. 2.3).
/// @param radiance  [W m-2 sr-1 nm-1]
/// @return [photons s-1 deg-2 nm-1] at the same nodes
/// Errors: those of photon_radiance(); a pupil that is negative or not finite.
Result<Spectrum> corneal_photons(const Spectrum& radiance, double pupil_mm2);

/// Returns the photons of 1 troland of monochromatic light at the cornea [photons s-1 deg-2]. 0 where the observer
/// does not respond. 4.57e5 for scotopic trolands at 507 nm, 1.25e6 for photopic ones at 555 nm.
double photons_per_photopic_td(double wavelength_nm);
double photons_per_scotopic_td(double wavelength_nm);

/// Lists the classes of receptors.
enum class Receptor : std::uint8_t { l_cone, m_cone, s_cone, rod };
inline constexpr std::array all_receptors{Receptor::l_cone, Receptor::m_cone, Receptor::s_cone, Receptor::rod};

/// Describes receptors of one class: cones of the fovea's centre, rods of the ring at 20 degrees where they are
/// densest.
struct ReceptorFigures {
  RetinalPath path;         // at the wavelength of peak sensitivity to photons at the cornea
  double aperture_um2 = 0;  // aperture of the inner segment, which collects the light
  double density_per_deg2 = 0;
  double integration_s = 0;  // over which responses add up
  double dark_per_s = 0;     // isomerisations without light, or their equivalent, in one receptor
};
const ReceptorFigures& figures_of(Receptor receptor);

/// Gives the area of retina that a square degree covers [um2]: 291 um per degree, of an eye with 16.68 mm between
/// nodal point and retina (Le Grand's, in makous-2004's tables too).
inline constexpr double retina_um2_per_deg2 = 291.2 * 291.2;

/// Returns the isomerisations per photon that arrives at the cornea for a receptor's own aperture: its corneal spectral
/// sensitivity to photons, scaled so that its peak is isomerisations_per_photon() of the receptor's path. Sensitivities
/// are those of Stockman & Sharpe (cones) and of CIE 1951 (rods), which are measured at the cornea and so contain the
/// absorption of the media and the self-screening of the pigment: only the peak needs them as figures.
double isomerisations_per_corneal_photon(Receptor receptor, double wavelength_nm);

/// Returns the isomerisations by light in one receptor [s-1] (thesis Eq. 3.3):
///     A_pupil aperture / (um2 per deg2) integral of photons(lambda) eta(lambda) dlambda
/// Bleaching is not included; it halves the pigment at 10^4.3 td.
/// Errors: those of corneal_photons().
Result<double> isomerisations_per_s(Receptor receptor, const Spectrum& radiance, double pupil_mm2);

/// Returns the isomerisations of one rod per scotopic troland [s-1], the same for every spectrum, because V' is the
/// sensitivity of the rods.
double rod_isomerisations_per_td_s();
/// Returns the mean isomerisations of one L or M cone, two of L for each of M, per photopic troland [s-1], under
/// equal-energy light. The figure depends on the spectrum by as much as V(lambda) differs from that mean.
double cone_isomerisations_per_td_s();

/// Holds isomerisations in one receptor [s-1]: of rods, and of L and M cones in the mean.
struct ReceptorRates {
  double rods = 0;
  double cones = 0;
};
/// Returns the isomerisations by light of a field's luminances. Luminances below 0 or not numbers count as 0.
ReceptorRates receptor_rates(const LuminancePair& field, double pupil_mm2);

/// Gives the fraction of cones that are L or M: 7 % are S cones.
inline constexpr double luminance_cones = 0.93;

/// Describes all receptors of one kind in a field: rods, or L and M cones, of which one number of isomerisations in an
/// integration time is counted.
struct ReceptorField {
  double counts_per_cd_m2 = 0;  // mean isomerisations by light: per scotopic cd/m2 for rods
  double dark_counts = 0;       // mean isomerisations without light
};
/// @param area_deg2  area deg2 of the field
ReceptorField rods_in(double area_deg2, double pupil_mm2);
ReceptorField cones_in(double area_deg2, double pupil_mm2);

}  // namespace lowlux::isp
