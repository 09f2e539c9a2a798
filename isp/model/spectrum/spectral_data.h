#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "isp/base/spectrum.h"

namespace lowlux::isp {

/// Lists sets of spectra; origin, licence and check values of each are in data/SOURCES.md.
enum class SpectrumSet : std::uint8_t {
  cie_illuminants,   // relative power, 5 nm: "A", "D65", "FL2", "LED-B3"...
  street_lamps,      // relative power, 5 nm: "HPS_generic", "LPS"...
  laboratory_lamps,  // radiance [W sr-1 m-2 nm-1], 4 nm: "Solux_4700K_12VDC"...
  colorchecker,      // 24 reflectances, 5 nm, in the chart's order: "dark_skin"...
  macbeth,           // 24 reflectances of an older chart, 4 nm
  munsell_ten,       // ten reflectances of the thesis' Table 3-1, 1 nm: "5R_4_14"...
};

/// Holds a spectrum and its name.
struct NamedSpectrum {
  std::string_view name;
  Spectrum spectrum;
};

/// Returns all spectra of a set, in its order.
std::vector<NamedSpectrum> spectra_of(SpectrumSet set);

/// Returns one spectrum by its name; nullopt for a name that is not in the set.
std::optional<Spectrum> spectrum_named(SpectrumSet set, std::string_view name);

/// Returns the response of a camera's R, G and B (lens included) per unit radiant power, largest of the three 1, 380 to
/// 780 nm: 22 still cameras at 5 nm, and "Sony_DXC-930", the thesis' video camera, at 4 nm. nullopt for another name.
std::optional<std::array<Spectrum, 3>> camera_sensitivity(std::string_view camera);

/// Returns all names that camera_sensitivity() accepts.
std::vector<std::string_view> camera_names();

/// Returns the name that camera_sensitivity() accepts for a camera's usual name: case is ignored and blanks count as _,
/// so that "NIKON D850" is "Nikon_D850". nullopt for a camera that is not in the tables.
std::optional<std::string_view> known_camera(std::string_view usual_name);

/// Selects a measurement of the cones' sensitivities.
enum class ConeSet : std::uint8_t { smith_pokorny_1975, stockman_sharpe_2000 };

/// Returns the sensitivity of the L, M and S cones of the 2-degree observer per unit radiant power, peak 1.
std::array<Spectrum, 3> cone_fundamentals(ConeSet set);

}  // namespace lowlux::isp
