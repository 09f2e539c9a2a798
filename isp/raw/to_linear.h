#pragma once

#include <optional>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"

namespace lowlux::isp {

/// Takes the black point off the active area: value = (dn - black) / (white - black), signed, nothing clipped.
/// Bayer or monochrome frames. The dark charge stays in unless the black point holds it.
RawFraction to_fraction(const RawDn& raw, const BlackPoint& black, Executor& executor);
/// The same into the caller's plane, active height x width.
void to_fraction(const RawDn& raw, const BlackPoint& black, PlaneView<float> out, Executor& executor);
/// The same of a part of the active area, its corner at an even column and row: the same bits as there.
/// @param out  part height x width
void to_fraction(const RawDn& raw, const BlackPoint& black, const Rect& part, PlaneView<float> out, Executor& executor);

/// The same for SensorLayout::linear_rgb: three planes of active height x width.
void to_fraction_rgb(const RawDn& raw, const BlackPoint& black, RgbView<float> out, Executor& executor);

/// The deepest wells hold some 1e6; raws whose noise was reduced count as if they held a thousand times as many.
inline constexpr double most_electrons_at_white = 1e9;

/// Electrons that one FractionOfWhite stands for, per CFA site. With shot noise alone the variance of a fraction x is
/// x / electrons, so this is 1 / NoiseProfile::scale. Nullopt where that is not within 1 to
/// most_electrons_at_white.
std::optional<PerSite<double>> electrons_at_white(const RawDn& raw, const NoiseProfile& noise);

/// Fractions counted in electrons.
RawElectrons to_electrons(RawFraction fraction, const PerSite<double>& electrons_at_white, Executor& executor);
/// The same in place; the corner of `fraction` is at an even column and row of the active area.
void count_electrons(PlaneView<float> fraction, const PerSite<double>& electrons_at_white, Executor& executor);
/// to_fraction and to_electrons of a Bayer frame in one pass: the same bits.
void to_electrons(const RawDn& raw, const BlackPoint& black, const PerSite<double>& electrons_at_white,
                  PlaneView<float> out, Executor& executor);
/// The same of a part of the active area, its corner at an even column and row.
/// @param out  part height x width
void to_electrons(const RawDn& raw, const BlackPoint& black, const PerSite<double>& electrons_at_white,
                  const Rect& part, PlaneView<float> out, Executor& executor);

/// Takes the mean dark charge off. Where the black point already held it (masked pixels) nothing is left to take.
SignalElectrons subtract_dark(RawElectrons raw, const BlackPoint& black, Executor& executor);
/// The same in place; the corner of `raw_e` is at an even column and row of the active area.
void subtract_dark(PlaneView<float> raw_e, const PerSite<double>& dark_mean_e, Executor& executor);
/// Without a known gain the dark charge is unknown too: what the pedestal did not hold stays, and only the type
/// changes.
SignalFraction subtract_dark(RawFraction raw);

}  // namespace lowlux::isp
