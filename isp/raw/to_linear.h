#pragma once

#include <optional>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"

namespace lowlux::isp {

/// Subtracts the black point from the active area: value = (dn - black) / (white - black), signed, nothing clipped.
/// Frames are Bayer or monochrome. The dark charge stays in unless the black point holds it.
RawFraction to_fraction(const RawDn& raw, const BlackPoint& black, Executor& executor);
/// Subtracts the black point into the caller's plane, active height x width.
void to_fraction(const RawDn& raw, const BlackPoint& black, PlaneView<float> out, Executor& executor);
/// Subtracts the black point from a region of the active area whose corner is at an even column and row; the values are
/// bit-identical to those of the entire area.
/// @param out  `part` height x width
void to_fraction(const RawDn& raw, const BlackPoint& black, const Rect& part, PlaneView<float> out, Executor& executor);

/// Subtracts the black point from a SensorLayout::linear_rgb frame into three planes of active height x width.
void to_fraction_rgb(const RawDn& raw, const BlackPoint& black, RgbView<float> out, Executor& executor);
/// Subtracts the black point from a region of the active area of such a frame; the values are those of the entire area.
/// @param out  three planes of `part` height x width
void to_fraction_rgb(const RawDn& raw, const BlackPoint& black, const Rect& part, RgbView<float> out,
                     Executor& executor);

/// The largest full wells hold about 1e6 electrons; raw data with reduced noise counts as if it held a thousand times
/// as many.
inline constexpr double max_electrons_at_white = 1e9;

/// Returns the electrons that one FractionOfWhite stands for, per CFA site. With shot noise alone the variance of a
/// fraction x is x / electrons, so this is 1 / NoiseProfile::scale. Returns nullopt where that is not within 1 to
/// max_electrons_at_white.
std::optional<PerSite<double>> electrons_at_white(const RawDn& raw, const NoiseProfile& noise);

/// Converts fractions of white to electrons.
RawElectrons to_electrons(RawFraction fraction, const PerSite<double>& electrons_at_white, Executor& executor);
/// Converts fractions of white to electrons in place; the corner of `fraction` is at an even column and row of the
/// active area.
void count_electrons(PlaneView<float> fraction, const PerSite<double>& electrons_at_white, Executor& executor);
/// Applies to_fraction and to_electrons to a Bayer frame in one pass, with bit-identical results.
void to_electrons(const RawDn& raw, const BlackPoint& black, const PerSite<double>& electrons_at_white,
                  PlaneView<float> out, Executor& executor);
/// Converts a region of the active area, whose corner is at an even column and row, to electrons.
/// @param out  `part` height x width
void to_electrons(const RawDn& raw, const BlackPoint& black, const PerSite<double>& electrons_at_white,
                  const Rect& part, PlaneView<float> out, Executor& executor);

/// Subtracts the mean dark charge. Where the black point already held it (masked pixels), nothing is subtracted.
SignalElectrons subtract_dark(RawElectrons raw, const BlackPoint& black, Executor& executor);
/// Subtracts the mean dark charge in place; the corner of `raw_e` is at an even column and row of the active area.
void subtract_dark(PlaneView<float> raw_e, const PerSite<double>& dark_mean_e, Executor& executor);
/// Changes only the type: without a known gain the dark charge that the pedestal did not hold is unknown, and stays.
SignalFraction subtract_dark(RawFraction raw);

}  // namespace lowlux::isp
