#pragma once

#include <optional>

#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// The range of the Planckian locus that is searched and offered is [planckian_min_k, planckian_max_k] [K].
inline constexpr double planckian_min_k = 1000;
inline constexpr double planckian_max_k = 100000;
/// The range of white_of_temperature is [white_min_k, white_max_k] [K].
inline constexpr double white_min_k = 1667;
inline constexpr double white_max_k = 25000;

/// Describes the position of a chromaticity relative to the Planckian locus.
struct ColourTemperature {
  double cct_k = 0;     // temperature of the nearest point of the locus in CIE 1960 uv
  double duv = 0;       // distance to the locus in uv: positive on the green side, negative on the pink one
  bool at_end = false;  // the nearest point is an end of the searched range: the temperature lies beyond it
};

/// Returns the chromaticity of a Planckian radiator, `duv` along the normal in CIE 1960 uv, from Planck's law with c2 =
/// 1.4388e-2 m K (CIE 15:2018) and the CIE 1931 observer at 1 nm.
/// @return nullopt outside planckian_min_k..planckian_max_k, or if duv leads outside all chromaticities
std::optional<Xy> planckian_xy(double cct_k, double duv = 0);

/// Returns the chromaticity of CIE daylight (CIE 15:2018 Eq. 4.6 to 4.8); nullopt outside 4000..25000 K.
std::optional<Xy> daylight_xy(double cct_k);

/// Returns the white for a colour temperature alone: CIE daylight from 4000 K up, a Planckian radiator up to 3333 K.
/// The loci lie 0.003 apart in uv at 4000 K. In between, the offset at 4000 K fades out (smoothstep in 1/CCT), so that
/// a white moved through the join neither jumps nor turns.
/// @return nullopt outside white_min_k..white_max_k
std::optional<Xy> white_of_temperature(double cct_k);

/// Returns correlated colour temperature and duv: the nearest point of the Planckian locus in CIE 1960 uv (CIE 15:2018
/// section 9.5), searched over the whole locus, so that chromaticities far off it get the nearest of all points. CIE
/// calls the figure meaningless for |duv| > 0.05; it is still returned, for interpolation between calibrations.
/// @return nullopt if the chromaticity is not finite or its y is not positive
std::optional<ColourTemperature> colour_temperature_of(const Xy& xy);

}  // namespace lowlux::isp
