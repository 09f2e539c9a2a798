#pragma once

#include "isp/base/matrix3.h"
#include "isp/model/appearance/appearance_model.h"

namespace lowlux::isp {

// How saturated colours look at a mean luminance (Wanat & Mantiuk 2014; thesis Eq. 2.29).

/// s(Y) = Y / (Y + 0.108 cd/m2), of the mean luminance of a picture, at least 0.
double wanat_saturation(double luminance_cd_m2);

/// s(Y) / s(Y_t), within 0 and 4: the power of R_i / R_Y that shows a picture of mean luminance Y at a mean of Y_t;
/// 1 where neither has light.
double wanat_exponent(double from_cd_m2, double to_cd_m2);

/// R_i = Y (R_i / Y)^exponent for each of R, G, B, then scaled to the luminance it had. Components below 0 are taken
/// times the exponent (at most 1) instead; colours of negative luminance are those of their opposites, of luminance 0
/// black.
/// @param luminance_weights  of R, G and B, positive
Vector3 wanat_saturated(const Vector3& rgb, double exponent, const Vector3& luminance_weights);

/// The model as a map: saturation of linear Rec.709 (white taken to D65 and back) at the luminance of adaptation
/// against 200 cd/m2, the reference of the experiment. Luminance stays; the model's curve for it is no matter of
/// single colours.
AppearanceModel wanat_mantiuk_appearance();

}  // namespace lowlux::isp
