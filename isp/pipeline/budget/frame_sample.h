#pragma once

#include <optional>
#include <span>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/pipeline/plan/levels.h"

/// Samples of a large Bayer frame represent all of it, for properties that are much the same everywhere, like noise.
namespace lowlux::isp {

inline constexpr int sample_side_px = 512;  // side of each square; whole blocks of every level of noise_check.h
inline constexpr int sample_squares_along = 3, sample_squares_down = 2;
inline constexpr double sample_megapixels =
    1e-6 * sample_squares_along * sample_squares_down * sample_side_px * sample_side_px;

/// Returns squares of the active area, evenly spread, with even corners. Empty where the frame is hardly larger than
/// the sample would be, or where each position has a black of its own: then the entire frame has to be examined.
std::vector<Rect> sample_squares(const RawFrame& frame, const RawLevels& levels);

/// Returns the squares one below the other in electrons, dark charge included, defects repaired.
/// Precondition: levels.electrons_at_white.
RawElectrons sample_electrons(const RawFrame& frame, const RawLevels& levels, std::span<const Rect> squares,
                              Executor& executor);

/// Returns the squares of an existing mosaic, one below the other.
RawElectrons sample_of(const RawElectrons& charge, std::span<const Rect> squares);

/// Returns the noise ratio of the squares, one below the other, in blocks of 16 pixels.
NoiseRatio sample_ratio(const NoiseRatioView& ratio, std::span<const Rect> squares);

}  // namespace lowlux::isp
