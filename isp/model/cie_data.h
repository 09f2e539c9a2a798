#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "isp/base/spectrum.h"
#include "isp/model/colorimetry.h"

namespace lowlux::isp {

/// Colour-matching functions x, y, z of the CIE 1931 2-degree observer, 360 to 830 nm in steps of 1 nm,
/// for radiant power (ISO/CIE 11664-1).
const std::array<Spectrum, 3>& cie_1931_observer();

/// A light by name: relative spectral power, 380 to 780 nm in steps of 5 nm. Illuminants of CIE 015 are named "A",
/// "D50", "D65", "E", "FL2", "HP1", "LED-B3"..., street lamps "HPS_generic", "LPS", "mercury_clear_H38HT100"...
/// (see data/SOURCES.md); nullopt for another name. Lines are summed into the 5 nm bins.
std::optional<Spectrum> light_named(std::string_view name);

/// All names light_named() knows.
std::vector<std::string_view> light_names();

/// Maximum luminous efficacy K_m of photopic vision (CIE 018:2019), in the rounding all of photometry uses.
inline constexpr double luminous_efficacy_lm_w = 683;

/// XYZ of a spectral power, the integral of power times colour-matching function [power x nm], on its own nodes.
Xyz xyz_of(const Spectrum& power);

/// XYZ in absolute terms of a spectral radiance [W m-2 sr-1 nm-1]: Y is its luminance [cd/m2].
Xyz xyz_cd_m2(const Spectrum& radiance);

/// XYZ of a reflectance (0..1) under a light, Y = 1 for the perfect diffuser; nullopt if the light has no luminance.
/// The nodes are the light's.
std::optional<Xyz> xyz_of_reflectance(const Spectrum& reflectance, const Spectrum& light);

}  // namespace lowlux::isp
