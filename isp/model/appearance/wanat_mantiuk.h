#pragma once

#include "isp/base/matrix3.h"
#include "isp/model/appearance/appearance_model.h"

namespace lowlux::isp {

// Appearance of saturated colours at a mean luminance (Wanat & Mantiuk 2014; thesis Eq. 2.29).

/// Returns s(Y) = Y / (Y + 0.108 cd/m2), for the mean luminance of an image, at least 0.
double wanat_saturation(double luminance_cd_m2);

/// Returns s(Y) / s(Y_t), within 0 and 4: the power of R_i / R_Y that shows an image of mean luminance Y at a mean of
/// Y_t; 1 where neither has light.
double wanat_exponent(double from_cd_m2, double to_cd_m2);

/// Returns R_i = Y (R_i / Y)^exponent for each of R, G, B, scaled back to the original luminance. Components below 0
/// are multiplied by the exponent (at most 1) instead; colours of negative luminance are treated as the negative of
/// their opposites, those of luminance 0 as black.
/// @param luminance_weights  weights of R, G and B, positive
Vector3 wanat_saturated(const Vector3& rgb, double exponent, const Vector3& luminance_weights);

/// Returns the model as a map: saturation of linear Rec.709 (white adapted to D65 and back) at the luminance of
/// adaptation relative to 200 cd/m2, the reference of the experiment. Luminance is kept; the model's curve for it does
/// not apply to single colours.
AppearanceModel wanat_mantiuk_appearance();

}  // namespace lowlux::isp
