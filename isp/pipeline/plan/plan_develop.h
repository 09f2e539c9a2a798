#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/plan.h"
#include "isp/raw/black_point.h"

namespace lowlux::isp {

/// Returns the black point as requested; masked pixels are measured again with the gain that the noise profile states,
/// which follows from a first black level. Errors: those of choose_black.
Result<BlackPoint> choose_black_by_gain(const RawFrame& frame, const BlackRequest& request);

/// Returns the black point as the options request it: that of their dark frame, else choose_black_by_gain. Errors:
/// those of choose_black and black_of.
Result<BlackPoint> choose_black_point(const RawFrame& frame, const DevelopOptions& options);

/// Returns the level below white at which the sensor saturates, as the options request it: that of the series, else as
/// the frame shows it; nullopt where there is none, and pixels saturate at white.
std::optional<SaturationLevel> choose_saturation(const RawFrame& frame, const BlackPoint& black,
                                                 const DevelopOptions& options);

/// Refers the NoiseProfile of a file, which is stated above its tagged black level (DNG 1.7, NoiseProfile), to the
/// black point as the options request it: a raw value x of 0..1 stands for another charge if that holds dark charge. To
/// be called once for a frame that was read. Does nothing for other sources of noise, and where a black level is
/// missing.
void refer_noise_to_black(RawFrame& frame, const DevelopOptions& options);

/// Measures black, noise, exposure and white of a frame, and decides how to develop it. With a dark frame, everything
/// is measured after it is subtracted. Errors: no black point (insufficient), those of black_of, no colour calibration
/// for a space other than `camera` (insufficient), white not above black, invalid matrices (malformed), options that do
/// not fit together or the frame (invalid_argument), those of plan_look and plan_noise.
/// @param charge  receives the charge of the frame without its lines, if it was computed as a whole to measure them;
///                may be null
Result<DevelopPlan> plan_develop(const RawFrame& frame, const DevelopOptions& options, Executor& executor,
                                 RawElectrons* charge = nullptr);

}  // namespace lowlux::isp
