#pragma once

#include <optional>
#include <span>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/pipeline/plan/levels.h"

/// Parts of a large Bayer frame that stand for all of it: for what is much the same all over, like noise.
namespace lowlux::isp {

inline constexpr int sample_side_px = 512;  // of each square; whole blocks of every level of noise_check.h
inline constexpr int sample_squares_along = 3, sample_squares_down = 2;
inline constexpr double sample_megapixels =
    1e-6 * sample_squares_along * sample_squares_down * sample_side_px * sample_side_px;

/// Squares of the active area, evenly spread, even corners. Empty where the whole is hardly more than the sample would
/// be, or where each place has a black of its own: then the whole has to be looked at.
std::vector<Rect> sample_squares(const RawFrame& frame, const RawLevels& levels);

/// The codes of one square, as a frame that ends there. Tags that are about the whole readout are left out.
RawDn square_codes(const RawDn& raw, const Rect& square);

/// The squares one below the other in electrons, dark charge in, defects repaired.
/// Precondition: levels.electrons_at_white.
RawElectrons sample_electrons(const RawFrame& frame, const RawLevels& levels, std::span<const Rect> squares,
                              Executor& executor);

/// The squares of a mosaic that is there already, one below the other.
RawElectrons sample_of(const RawElectrons& charge, std::span<const Rect> squares);

}  // namespace lowlux::isp
