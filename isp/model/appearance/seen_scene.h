#pragma once

#include <utility>

#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/model/appearance/appearance_model.h"

namespace lowlux::isp {

// Common parts of the appearance models: the viewing conditions of one scene, and limits that keep colours finite.

/// Converts XYZ to the cones of Hunt, Pointer and Estevez, each 1 for the equal-energy white.
inline constexpr Matrix3 xyz_to_hpe{{{0.38971, 0.68898, -0.07868}, {-0.22981, 1.18340, 0.04641}, {0, 0, 1}}};
/// Converts XYZ to the cones of Smith and Pokorny, L + M = Y, to three decimals (Shin et al. 2004).
inline constexpr Matrix3 xyz_to_smith_pokorny{{{0.155, 0.543, -0.033}, {-0.155, 0.457, 0.033}, {0, 0, 1}}};

/// Holds checked viewing conditions: all figures are positive and finite, the white excites all cones.
struct SeenScene {
  Vector3 white{};              // XYZ, Y = 1
  double white_cd_m2 = 0;       // luminance of a perfect diffuser
  double adaptation_cd_m2 = 0;  // photopic luminance of the adaptation field
  double rod_fraction = 0;      // r of L_mes = L_p + r (L_s - L_p)
  double adaptation_m = 0;      // m of CIE 191
  double white_scotopic = 0;    // scotopic luminance of the white of Y = 1
  Matrix3 to_rec709{};          // linear Rec.709 of the colour under D65, von Kries in Bradford's cones
  Matrix3 from_rec709{};        // inverse of to_rec709
};

/// Checks and converts viewing conditions. Errors: invalid_argument for a luminance that is not within 1e-12..1e12
/// cd/m2, a ratio or temperature that is not positive and finite, a white without a colour or that leaves a cone or the
/// rods dark.
Result<SeenScene> seen_scene(const ViewingConditions& conditions);

/// Returns the scotopic luminance by scotopic_weights, relative to that of the scene's white; at least 0.
double relative_scotopic(const SeenScene& scene, const Vector3& xyz);
/// Returns the mesopic luminance of CIE 191 relative to that of the scene's white, for an eye in the scene's state;
/// negative for colours of negative luminance that rods do not see.
double relative_mesopic(const SeenScene& scene, const Vector3& xyz);

/// Returns a colour scaled to `luminance`, its chromaticity kept. Where it has none (its own or the requested luminance
/// is not positive) it becomes the white, of either sign. No colour is brightened more than eight times: noise about
/// black would become bright coloured outliers.
Vector3 with_luminance(const Vector3& xyz, double luminance, const Vector3& white);

/// Returns each component clamped to +-1e12, so that no power in a model overflows.
Vector3 within_reach(const Vector3& xyz);

/// Returns the map of a model: finite colours stay finite.
template <class Model>
ColourMap colour_map(Model model) {
  return [model = std::move(model)](const Xyz& colour) { return xyz_of(model(within_reach(vector_of(colour)))); };
}

}  // namespace lowlux::isp
