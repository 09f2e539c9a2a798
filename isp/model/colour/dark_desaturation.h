#pragma once

#include <optional>

#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// Dark current desaturates colours. A measured mean I is signal plus dark, I = Delta + n, and a linear map to XYZ
/// keeps that. With S = X + Y + Z the chromaticities lie on one line (thesis Eq. 4.16 to 4.24):
///     I_c = alpha Delta_c + (1 - alpha) n_c,   alpha = S(Delta) / (S(Delta) + S(n)) = 1 / (1 + S(n) / S(Delta))
/// The law holds for means. The same alpha does not hold for u'v', whose weights are X + 15 Y + 3 Z.

/// Returns the signal's fraction alpha of a measurement: near 1 in bright light, near 0 where dark current dominates.
/// @return nullopt unless S(signal) and S(signal) + S(dark) are positive and finite: there is no alpha, and no colour
std::optional<double> signal_fraction(const Xyz& signal, const Xyz& dark);

/// Returns the measured chromaticity of a true one (Eq. 4.23). alpha = 0 gives the dark's own.
Xy desaturated(const Xy& signal, const Xy& dark, double alpha);

/// Returns the true chromaticity of a measured one: Delta_c = (I_c - (1 - alpha) n_c) / alpha. Errors of the
/// measurement grow by 1 / alpha.
/// @return nullopt unless alpha > 0 and the quotient is finite: dark current alone holds no information about the light
std::optional<Xy> resaturated(const Xy& measured, const Xy& dark, double alpha);

/// Returns the true chromaticity from tristimulus values: that of measured - dark, the inverse of Eq. 4.23.
/// @return nullopt unless X + Y + Z of the difference is positive and finite
std::optional<Xy> resaturated(const Xyz& measured, const Xyz& dark);

}  // namespace lowlux::isp
