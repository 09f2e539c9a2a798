#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "isp/base/dark_frame.h"
#include "isp/base/frame.h"
#include "isp/raw/black_point.h"
#include "isp/raw/measure/saturation_level.h"
#include "isp/raw/repair.h"

namespace lowlux::isp {

/// States what the raw values of a frame mean, and which of them are to be repaired.
struct RawLevels {
  BlackPoint black;
  PerSite<double> stated_dark_dn{};  // part of the pedestal of `black` that was stated as dark charge; 0 if unknown
  std::shared_ptr<const DarkFrame> dark_frame;        // set: subtracted pixel by pixel instead of the pedestal
  std::optional<PerSite<double>> electrons_at_white;  // set where the mosaic is converted to electrons
  std::optional<SaturationLevel> saturation;          // set where the sensor saturates below white
  std::vector<Pixel> defects;                         // ascending
};

/// Returns whether a frame can be rendered directly from its 16-bit codes: it has codes, and no step before that
/// repairs, multiplies, reduces noise, or subtracts pixel by pixel.
bool renders_from_codes(const RawFrame& frame, const RawLevels& levels, bool reduces_noise);

/// Returns the fractions of white from which on R, G and B are saturated by `levels.saturation`; 1 without.
std::array<double, 3> saturated_from(const RawDn& raw, const RawLevels& levels);

/// Returns the variance of a raw value without light [e-^2]: that of the noise model or, if that is more, that of the
/// pixels which the black point was measured on, as a model may lack the noise of dark charge. A model that was
/// measured on the image itself contains that charge and is not raised to masked pixels, which on some cameras have
/// twice the variance. At least that of rounding, which floating-point samples do not have; what subtracting a dark
/// frame adds is in. Precondition: frame.noise.
/// @param site        site of the black point: of a mosaic's cell, or a plane of other frames
/// @param colour      of the noise model
/// @param electrons   at white
/// @param e_per_dn    electrons of a code
double black_variance_e2(const RawFrame& frame, const RawLevels& levels, int site, int colour, double electrons,
                         double e_per_dn);

/// Returns the electrons at white of each colour; both greens have the same number. Precondition:
/// levels.electrons_at_white.
std::array<double, 3> electrons_by_colour(const RawDn& raw, const RawLevels& levels);

/// Returns the charge of light in a white pixel of each site [e-], electrons at white less the dark charge that is
/// subtracted: light and dark charge saturate a pixel together. Precondition: levels.electrons_at_white.
PerSite<double> light_at_white_e(const RawLevels& levels);
/// Returns light_at_white_e of each colour. Precondition: levels.electrons_at_white.
std::array<double, 3> light_at_white_by_colour(const RawDn& raw, const RawLevels& levels);

}  // namespace lowlux::isp
