#include "isp/model/vision/retina.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "isp/base/text.h"
#include "isp/model/sensor/photon.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::isp {
namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double sr_per_deg2 = degree * degree;
constexpr double m2_per_mm2 = 1e-6;

constexpr double circle_area(double diameter) { return std::numbers::pi / 4 * diameter * diameter; }

// Macular pigment in front of S cones at 441 nm: density 0.35 at its peak (stockman-sharpe-2000), 0.29 here.
constexpr double macular_density = 0.29;
// rodieck-1998, appendix B: isomerisations per absorbed photon, density of rods, diameters of inner segments. Density
// of cones: stockman-sharpe-2000, Table 2.
constexpr double per_absorbed_photon = 0.667;
constexpr double rod_density = 0.47, long_density = 0.50, short_density = 0.40;
constexpr double rod_aperture_um2 = circle_area(2.22), cone_aperture_um2 = circle_area(2.3);
// Rods: about 150 000 mm-2 in the ring around 20 degrees (curcio-1990). Cones: watson-2014 for the centre of the fovea,
// after curcio-1990; 7 % of them S, and two L for each M (hofer-2005).
constexpr double rods_per_deg2 = 150'000e-6 * retina_um2_per_deg2, cones_per_deg2 = 14804.6;
constexpr double l_of_l_and_m = 2.0 / 3;
// Rods: duration of complete summation in the dark (barlow-1958), and noise equivalent to light as observers show it,
// about three times the thermal rate (field-2005). Cones: integration time and spontaneous rate of models of observers
// (koenig-hofer-2011).
constexpr double rod_integration_s = 0.1, cone_integration_s = 0.05;
constexpr double rod_dark_per_s = 0.01, cone_dark_per_s = 100;

ReceptorFigures cone(double peak_nm, double macular, double density, double fraction) {
  return {{ocular_transmittance(peak_nm) * std::pow(10.0, -macular), 1, density, per_absorbed_photon},
          cone_aperture_um2,
          fraction * cones_per_deg2,
          cone_integration_s,
          cone_dark_per_s};
}

// Returns the sensitivities to photons, peak 1, over the nodes of the tables.
const std::array<Spectrum, 4>& photon_sensitivities() {
  static const std::array<Spectrum, 4> all = [] {
    const auto to_photons = [](const Spectrum& energy) {
      const Spectrum photons = energy.mapped([](double nm, double value) { return value / nm; });
      const double peak = std::ranges::max(photons.values());
      return photons.mapped([&](double, double value) { return value / peak; });
    };
    const auto [l, m, s] = cone_fundamentals(ConeSet::stockman_sharpe_2000);
    return std::array{to_photons(l), to_photons(m), to_photons(s), to_photons(scotopic_observer())};
  }();
  return all;
}

const Spectrum& photon_sensitivity(Receptor receptor) {
  return photon_sensitivities()[static_cast<std::size_t>(receptor)];
}

double peak_nm(Receptor receptor) {
  const Spectrum& photons = photon_sensitivity(receptor);
  return photons.wavelengths_nm()[std::ranges::max_element(photons.values()) - photons.values().begin()];
}

double peak_efficiency(Receptor receptor) { return *isomerisations_per_photon(figures_of(receptor).path); }

double not_negative(double value) { return value > 0 ? value : 0; }

// Returns the photons of 1 td: 1 cd/m2 through 1 mm2.
double photons_per_td(double wavelength_nm, double efficacy_lm_w, double response) {
  if (!(response > 0)) return 0;
  return sr_per_deg2 * m2_per_mm2 / (efficacy_lm_w * response * photon_energy_j(wavelength_nm));
}

}  // namespace

double adapted_pupil_mm(double luminance_cd_m2, const PupilConditions& conditions) {
  constexpr double reference_age = 28.58, youngest = 20, oldest = 83;
  const double eyes = conditions.eyes == 1 ? 0.1 : 1;
  const double flux = not_negative(luminance_cd_m2) * not_negative(conditions.field_deg2) * eyes;
  const double f = std::pow(std::min(flux, 1e30) / 846, 0.41);
  const double young = 7.75 - 5.75 * f / (f + 2);
  return young + (std::clamp(conditions.age_years, youngest, oldest) - reference_age) * (0.02132 - 0.009562 * young);
}

double ocular_transmittance(double wavelength_nm, double age_years) {
  const double age2 = age_years * age_years;
  const auto band = [&](double centre_nm, double per_nm) {
    const double x = per_nm * (wavelength_nm - centre_nm);
    return std::exp(-x * x);
  };
  const double density = (0.15 + 0.000031 * age2) * std::pow(400 / wavelength_nm, 4) +
                         14.19 * 10.68 * band(273, 0.057) + (1.05 - 0.000063 * age2) * 2.13 * band(370, 0.029) +
                         (0.059 + 0.000186 * age2) * 11.95 * band(325, 0.021) +
                         (0.016 + 0.000132 * age2) * 1.43 * band(325, 0.008) + 0.06;
  return std::pow(10.0, -density);
}

double pupil_area_mm2(double diameter_mm) { return circle_area(diameter_mm); }

Result<Spectrum> corneal_photons(const Spectrum& radiance, double pupil_mm2) {
  if (!(pupil_mm2 >= 0) || !std::isfinite(pupil_mm2)) {
    return fail(ErrorCode::invalid_argument,
                "the area of a pupil must be 0 or more and finite [mm2], found " + number_text(pupil_mm2));
  }
  Result<Spectrum> photons = photon_radiance(radiance);
  if (!photons) return photons;
  return photons->mapped([&](double, double value) { return value * pupil_mm2 * m2_per_mm2 * sr_per_deg2; });
}

double photons_per_photopic_td(double wavelength_nm) {
  return photons_per_td(wavelength_nm, luminous_efficacy_lm_w, cie_1931_observer()[1].at(wavelength_nm));
}

double photons_per_scotopic_td(double wavelength_nm) {
  return photons_per_td(wavelength_nm, scotopic_efficacy_lm_w, scotopic_observer().at(wavelength_nm));
}

const ReceptorFigures& figures_of(Receptor receptor) {
  static const std::array<ReceptorFigures, 4> all{
      cone(peak_nm(Receptor::l_cone), 0, long_density, luminance_cones * l_of_l_and_m),
      cone(peak_nm(Receptor::m_cone), 0, long_density, luminance_cones * (1 - l_of_l_and_m)),
      cone(peak_nm(Receptor::s_cone), macular_density, short_density, 1 - luminance_cones),
      ReceptorFigures{{ocular_transmittance(peak_nm(Receptor::rod)), 1, rod_density, per_absorbed_photon},
                      rod_aperture_um2,
                      rods_per_deg2,
                      rod_integration_s,
                      rod_dark_per_s}};
  return all[static_cast<std::size_t>(receptor)];
}

double isomerisations_per_corneal_photon(Receptor receptor, double wavelength_nm) {
  return peak_efficiency(receptor) * photon_sensitivity(receptor).at(wavelength_nm);
}

Result<double> isomerisations_per_s(Receptor receptor, const Spectrum& radiance, double pupil_mm2) {
  const Result<Spectrum> photons = corneal_photons(radiance, pupil_mm2);
  if (!photons) return tl::make_unexpected(photons.error());
  const Spectrum& sensitivity = photon_sensitivity(receptor);
  const double aperture_deg2 = figures_of(receptor).aperture_um2 / retina_um2_per_deg2;
  return aperture_deg2 * peak_efficiency(receptor) * integrate(*photons, [&](double nm) { return sensitivity.at(nm); });
}

double rod_isomerisations_per_td_s() {
  // Energy-based V' over energy of a photon is the sensitivity to photons, so that every spectrum of 1 td counts alike.
  static const double rate = photons_per_scotopic_td(peak_nm(Receptor::rod)) * peak_efficiency(Receptor::rod) *
                             rod_aperture_um2 / retina_um2_per_deg2;
  return rate;
}

double cone_isomerisations_per_td_s() {
  static const double rate = [] {
    const Spectrum equal = cie_1931_observer()[1].mapped([](double, double) { return 1.0; });
    const double luminance = luminance_of(equal).photopic;
    const double l = *isomerisations_per_s(Receptor::l_cone, equal, 1);
    const double m = *isomerisations_per_s(Receptor::m_cone, equal, 1);
    return (l_of_l_and_m * l + (1 - l_of_l_and_m) * m) / luminance;
  }();
  return rate;
}

ReceptorRates receptor_rates(const LuminancePair& field, double pupil_mm2) {
  return {rod_isomerisations_per_td_s() * not_negative(field.scotopic) * pupil_mm2,
          cone_isomerisations_per_td_s() * not_negative(field.photopic) * pupil_mm2};
}

namespace {

ReceptorField field_of(const ReceptorFigures& receptor, double receptors, double per_td_s, double pupil_mm2) {
  const double receptor_s = receptors * receptor.integration_s;
  return {receptor_s * per_td_s * pupil_mm2, receptor_s * receptor.dark_per_s};
}

}  // namespace

ReceptorField rods_in(double area_deg2, double pupil_mm2) {
  const ReceptorFigures& rod = figures_of(Receptor::rod);
  return field_of(rod, area_deg2 * rod.density_per_deg2, rod_isomerisations_per_td_s(), pupil_mm2);
}

ReceptorField cones_in(double area_deg2, double pupil_mm2) {
  return field_of(figures_of(Receptor::l_cone), area_deg2 * luminance_cones * cones_per_deg2,
                  cone_isomerisations_per_td_s(), pupil_mm2);
}

}  // namespace lowlux::isp
