#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/correction.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/merge/frame.h"
#include "isp/pipeline/options.h"

namespace lowlux::isp {

/// Holds a Bayer frame as signed electrons of light, with what is known of its noise. Sites are those of the active
/// area.
struct FrameElectrons {
  Plane<float> signal_e;  // pedestal, dark charge, row and column noise subtracted; NaN at defects
  BayerPhase phase = BayerPhase::rggb;
  PerSite<double> variance_e2{};              // without light: read noise, dark charge, quantisation
  PerSite<double> dark_charge_e{};            // mean that was subtracted; 0 if unknown
  bool dark_is_estimated = false;             // dark_mean_e was estimated from the frame itself
  PerSite<double> common_variance_e2{};       // variance of the subtracted dark frame, common to frames of one exposure
  std::array<double, 3> saturation_e{};       // signal from which on a site of R, G, B is saturated
  std::optional<SaturationLevel> saturation;  // set where the sensor saturates below white
  PerSite<double> light_at_white_e{};
  Plane<float> gain;  // gain that corrects the shading of the lens at each pixel; empty: not stated, or not requested
  std::vector<std::string> warnings;
};

inline merge::FrameView view_of(const FrameElectrons& frame) {
  return {frame.signal_e.view(), frame.phase, frame.variance_e2};
}

/// Holds the levels and the noise of a frame for R, G and B, of which both greens are the mean.
struct ColourLevels {
  PerSite<double> white_e{};            // light at white, at 0, 1, 2; the last figure is that of B
  std::array<double, 3> variance_e2{};  // without light, that of the dark frame included
};
ColourLevels colour_levels(const FrameElectrons& frame);

/// Returns options under which a whole frame is developed to camera RGB at a level. Of `options`, those of black level,
/// dark charge, defects, line noise and interpolation are kept; those of the image, such as its crop, are not.
DevelopOptions options_of_signal(const DevelopOptions& options, denoise::Level level);

/// Returns the gain of each pixel by which a frame's corrections undo the shading of its lens; empty where they hold
/// none.
Plane<float> shading_gain(const RawCorrections& corrections, int width, int height, Executor& executor);

/// Measures a frame as plan_develop does and converts it. The options that matter are those of black level, dark frame,
/// defects and line noise. Errors: those of plan_develop; unknown noise (insufficient), three colours in each pixel
/// (unsupported).
/// @param with_gain  whether FrameElectrons::gain is wanted
Result<FrameElectrons> frame_electrons(const RawFrame& frame, const DevelopOptions& options, Executor& executor,
                                       bool with_gain = false);

}  // namespace lowlux::isp
