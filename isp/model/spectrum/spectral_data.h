#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "isp/base/spectrum.h"

namespace lowlux::isp {

/// Spectra that belong together; origin, licence and check values of each are in data/SOURCES.md.
enum class SpectrumSet : std::uint8_t {
  cie_illuminants,   // relative power, 5 nm: "A", "D65", "FL2", "LED-B3"...
  street_lamps,      // relative power, 5 nm: "HPS_generic", "LPS"...
  laboratory_lamps,  // radiance [W sr-1 m-2 nm-1], 4 nm: "Solux_4700K_12VDC"...
  colorchecker,      // 24 reflectances, 5 nm, in the chart's order: "dark_skin"...
  macbeth,           // 24 reflectances of an older chart, 4 nm
  munsell_ten,       // ten reflectances of the thesis' Table 3-1, 1 nm: "5R_4_14"...
};

struct NamedSpectrum {
  std::string_view name;
  Spectrum spectrum;
};

/// A set whole, in its order.
std::vector<NamedSpectrum> spectra_of(SpectrumSet set);

/// One spectrum by its name; nullopt for a name the set has not.
std::optional<Spectrum> spectrum_named(SpectrumSet set, std::string_view name);

/// Response of a camera's R, G and B (lens included) per unit radiant power, largest of the three 1, 380 to 780 nm: 22
/// still cameras at 5 nm, and "Sony_DXC-930", the thesis' video camera, at 4 nm. nullopt for another name.
std::optional<std::array<Spectrum, 3>> camera_sensitivity(std::string_view camera);

/// All names camera_sensitivity() knows.
std::vector<std::string_view> camera_names();

/// Which measurement of the cones' sensitivities.
enum class ConeSet : std::uint8_t { smith_pokorny_1975, stockman_sharpe_2000 };

/// Sensitivity of the L, M and S cones of the 2-degree observer per unit radiant power, peak 1.
std::array<Spectrum, 3> cone_fundamentals(ConeSet set);

}  // namespace lowlux::isp
