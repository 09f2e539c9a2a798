#pragma once

#include <functional>
#include <optional>

#include "isp/model/appearance/seen_scene.h"

namespace lowlux::isp {

/// Gives the luminance of adaptation in daylight: 1000 lx / pi, a fifth of the white's luminance. From there up the
/// models that match lightness leave colours unchanged.
inline constexpr double daylight_adaptation_cd_m2 = 318.31;

/// Computes the achromatic signal above that of black, relative to white's, from cone responses relative to white's
/// (not negative) and the rods' (likewise). It rises with each.
using AchromaticSignal = std::function<double(const Vector3& cones, double rods)>;

/// Returns a map that scales a colour until it gives in daylight the signal that it gives in the dark. Chromaticities
/// are kept, the sign of a luminance too; scales are kept within 1/1024 and 1024.
ColourMap lightness_match(const SeenScene& scene, AchromaticSignal dark, AchromaticSignal daylight);

/// Returns a model's signal in one state of adaptation, on any scale.
using AchromaticModel = AchromaticSignal (*)(double adaptation_cd_m2, std::optional<double> colour_temperature_k);

/// Returns lightness_match() of a model in the scene and in daylight. Errors: those of seen_scene().
Result<ColourMap> lightness_match(const ViewingConditions& conditions, AchromaticModel model);

}  // namespace lowlux::isp
