#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/model/sensor/bracket_advice.h"
#include "isp/pipeline/options.h"

namespace lowlux::isp {

/// Limits how far the brightest lamps are assumed to be above the limit of saturation: 10 EV.
inline constexpr double max_highlight_fraction = 1024;

/// Measures the light levels of a Bayer frame. The darkest tenth is that of the means of green over 16 x 16 pixels; one
/// that is not three standard errors above black is set to three standard errors.
///
/// The brightest lamps are at the level that `clipped_fraction` of the pixels exceed. Where more pixels than that are
/// beyond the limit of saturation, the level is extrapolated: with p and q the fractions of the pixels beyond 1 and 1/4
/// of the limit, the distribution of light is assumed to continue as the power law through both (Pareto),
///     highlight_fraction = (p / clipped_fraction)^(1 / a),   a = ln(q / p) / ln 4,
/// at most max_highlight_fraction.
/// @param clipped_fraction  0..1
/// Errors: those of frame_electrons; no exposure time (insufficient).
Result<BracketScene> measure_bracket_scene(const RawFrame& frame, const DevelopOptions& options,
                                           double clipped_fraction, Executor& executor);

}  // namespace lowlux::isp
