#pragma once

#include <cstdint>

#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/model/colorimetry.h"

namespace lowlux::denoise {

/// Takes the mean dark charge off a mosaic, y - d, and keeps the sign: values below zero are data, and clipping them
/// would lift dark means by 0.4 standard deviations. Where it is done linearly it is the whole undoing of Eq. 4.23.
/// @param dark_e  of the four sites of the mosaic [e-]
void subtract_dark(PlaneView<const float> charge_e, const PerSite<double>& dark_e, PlaneView<float> signal_e);

/// The same of a whole mosaic, in its own memory.
SignalElectrons subtract_dark(RawElectrons charge, const PerSite<double>& dark_e);

/// In whose weights an intensity is summed. The law of desaturation has its own alpha in each.
enum class ShareWeights : std::uint8_t {
  xy,  // S = X + Y + Z
  uv,  // W = X + 15 Y + 3 Z
};

double intensity(const isp::Xyz& colour, ShareWeights weights);

/// The signal's share of every measured pixel (Eq. 4.24), for looking at: where it is small, colour is the dark's.
///     alpha = s / (s + n),  s the mean of the signal's intensity over a square of 2 radius + 1 pixels
/// @param signal_xyz  dark already subtracted, signed
/// @param dark        in the same unit, of positive intensity or 0
/// @param saturated   empty, or not 0 where a pixel is saturated: it is left out, being no sum of signal and dark
/// @return 0..1; 0 where s is not positive or no pixel of the square can be used. Values that are not finite are left
/// out
Plane<float> alpha_map(const SceneLinear& signal_xyz, const isp::Xyz& dark, ShareWeights weights, int radius,
                       PlaneView<const std::uint8_t> saturated = {});

}  // namespace lowlux::denoise
