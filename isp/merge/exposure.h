#pragma once

#include <array>
#include <optional>

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/merge/frame.h"

/// Frames of different exposure: how their signals compare, and how they are weighted.
namespace lowlux::merge {

/// States the fraction of saturation up to which a site has its full weight in a mean of different exposures.
inline constexpr double full_weight_fraction = 0.85;

/// Sets saturated sites to NaN.
/// @param saturation_e  saturation of R, G and B
/// @param saturated     as large: set to 1 where a site is saturated, else to 0
void remove_saturated(PlaneView<float> signal_e, BayerPhase phase, const std::array<double, 3>& saturation_e,
                      PlaneView<float> saturated, Executor& executor);

/// States the ratio of the signal of one frame to that of another.
struct LightRatio {
  double ratio = 1;
  double standard_error = 0;
};

/// Measures the ratio of the signal of `frame` to that of `reference`, whose exposures differ: files state rounded
/// exposure times, shutters are not exact, and both would show as seams where a frame saturates. It is the ratio of the
/// sums over blocks of 16 x 16 sites without a NaN site; blocks whose difference is more than 5 standard deviations, at
/// first from the expected ratio within 20 %, are left out (moving objects). Both frames show the same scene, in place.
/// @param expected  ratio by the stated exposures
/// @return nullopt where fewer than 16 blocks remain, or the standard error is above 2 % of the ratio
std::optional<LightRatio> measure_light_ratio(const FrameView& reference, const FrameView& frame, double expected,
                                              Executor& executor);

/// Computes the weight of each site of a frame in a mean of signals per light: its inverse variance,
///     w = s light^2 / (max(m, 0) + variance_e2),
/// where m is the mean of the 8 nearest sites of the same colour, without the site itself, so that no weight depends on
/// the noise of its value. s falls from 1 to 0 where m rises from 85 to 95 % of saturation, and with the fraction of
/// neighbours that are NaN, so that a frame that saturates leaves the mean without a seam.
/// @param light   ratio of the frame's signal to that of the reference
/// @param weight  as large as the frame; 0 where the site itself is NaN
void inverse_variance_weights(const FrameView& frame, double light, const std::array<double, 3>& saturation_e,
                              PlaneView<float> weight, Executor& executor);

}  // namespace lowlux::merge
