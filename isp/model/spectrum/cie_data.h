#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "isp/base/spectrum.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// Returns the colour-matching functions x, y, z of the CIE 1931 2-degree observer, 360 to 830 nm in steps of 1 nm, for
/// radiant power (ISO/CIE 11664-1).
const std::array<Spectrum, 3>& cie_1931_observer();

/// Returns a light by name: relative spectral power, 380 to 780 nm in steps of 5 nm. Illuminants of CIE 015 are named
/// "A", "D50", "D65", "E", "FL2", "HP1", "LED-B3"..., street lamps "HPS_generic", "LPS", "mercury_clear_H38HT100"...
/// (see data/SOURCES.md); nullopt for another name. Lines are summed into the 5 nm bins.
std::optional<Spectrum> light_named(std::string_view name);

/// Returns all names that light_named() accepts.
std::vector<std::string_view> light_names();

/// Gives the maximum luminous efficacy K_m of photopic vision (CIE 018:2019), in the rounding used throughout
/// photometry.
inline constexpr double luminous_efficacy_lm_w = 683;

/// Returns the XYZ of a spectral power, the integral of power times colour-matching function [power x nm], on its own
/// nodes.
Xyz xyz_of(const Spectrum& power);

/// Returns the absolute XYZ of a spectral radiance [W m-2 sr-1 nm-1]: Y is its luminance [cd/m2].
Xyz xyz_cd_m2(const Spectrum& radiance);

/// Returns the XYZ of a reflectance (0..1) under a light, Y = 1 for the perfect diffuser; nullopt if the light has no
/// luminance. The nodes are the light's.
std::optional<Xyz> xyz_of_reflectance(const Spectrum& reflectance, const Spectrum& light);

/// Holds one table of isp/model/data, compiled in. `cells` holds rows of columns.size() numbers, the wavelength [nm]
/// first (except macadam1942, whose rows are ellipses).
struct CieTable {
  std::span<const std::string_view> columns;
  std::span<const double> cells;
};

/// Both functions return column 1, 2... of a table as a spectrum, by its index or its name; nullopt for an unknown
/// name.
Spectrum column_of(const CieTable& table, std::size_t column);
std::optional<Spectrum> column_named(const CieTable& table, std::string_view name);

CieTable camera_ssf_5nm_table();
CieTable cie1931_2deg_cmf_1nm_table();
CieTable cie1951_scotopic_1nm_table();
CieTable colorchecker_ohta_reflectance_5nm_table();
CieTable cones_smith_pokorny_1975_5nm_table();
CieTable cones_stockman_sharpe_2deg_1nm_table();
CieTable illuminants_cie_5nm_table();
CieTable macadam1942_table();
CieTable munsell_ten_chips_1nm_table();
CieTable sfu_laboratory_lamps_4nm_table();
CieTable sfu_macbeth_reflectance_4nm_table();
CieTable sony_dxc930_sensitivity_4nm_table();
CieTable street_lamps_5nm_table();

}  // namespace lowlux::isp
