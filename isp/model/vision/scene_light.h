#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/result.h"
#include "isp/base/spectrum.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// Describes the light that falls on a scene.
struct SceneLight {
  std::string name;                  // name of the lamp or of the file; empty where only the ratio is known
  double scotopic_ratio = 1;         // S/P
  std::optional<Xy> white;           // chromaticity; absent without a spectrum
  std::optional<Spectrum> spectrum;  // relative power
};

/// Give the range of S/P that is supported: that of the tables of eye_tables.h.
inline constexpr double min_scotopic_ratio = 0.1;
inline constexpr double max_scotopic_ratio = 60;

/// Returns a light of which S/P alone is known. Error: a ratio outside the supported range.
Result<SceneLight> light_of_ratio(double scotopic_ratio);

/// Returns the light of a spectrum, with its exact S/P and chromaticity. The nodes of the spectrum are those of all
/// integrals. Errors: a spectrum without luminance, one with a ratio outside the supported range.
Result<SceneLight> light_of_spectrum(std::string name, Spectrum spectrum);

/// Returns a CIE illuminant, a street lamp or a laboratory lamp (spectral_data.h) by its name, in any case. Error: no
/// such lamp; the message lists all names.
Result<SceneLight> light_of_lamp(std::string_view name);

/// Returns the names of all lamps of light_of_lamp(), set by set.
std::vector<std::string_view> lamp_names();

/// Returns the degree of adaptation D to the chromaticity of the light,
///     D = F (1 - exp(-(L_A + 42) / 92) / 3.6)
/// (CIE 159:2004, CIECAM02) with F = 1, the average surround: the scene surrounds the observer. 0.82 in the dark, 1 in
/// daylight.
/// @param adapting_cd_m2  L_A, the mean luminance of the scene; negative values count as 0
double degree_of_adaptation(double adapting_cd_m2);

/// Returns the matrix from XYZ of complete adaptation to the XYZ that an incompletely adapted observer perceives,
///     C^-1 diag(D + (1 - D) C w_scene / C w_adapted) C,  C the matrix CAT02
/// (CIE 159:2004): the white w_adapted goes to D w_adapted + (1 - D) w_scene, at equal Y.
/// @param scene    white of the light
/// @param adapted  white to which all colours were adapted completely
/// @param degree   D, 0..1; the matrix of 1 is the identity
/// @return nullopt if a white has no XYZ, or a response of CAT02 to w_adapted or to the white perceived is not positive
std::optional<Matrix3> incomplete_adaptation(const Xy& scene, const Xy& adapted, double degree);

}  // namespace lowlux::isp
