#pragma once

#include <array>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/pipeline/plan.h"

namespace lowlux::isp {

/// Computes the variance of the noise in the luminance of the image's pixels, in their unit (that of
/// plan.rendering.transform), one value for each cell of 4 x 4: the residual noise that the denoiser predicts, or the
/// input noise that the noise model predicts. Needs noise that was reduced, or a frame with a noise profile.
/// @param maps  maps of the active area; read where noise was reduced
/// @param quarter  means of camera RGB (RawToRgb::quarter), read where noise was not reduced
/// @param out  ceil(plan.height / 4) x ceil(plan.width / 4)
void noise_of_luminance(const DevelopPlan& plan, const RawFrame& frame, const NoiseMaps& maps,
                        const RgbView<const float>& quarter, PlaneView<float> out, Executor& executor);

/// Computes what the variance of each cell is in plain areas of its light: the median over cells of the frame that have
/// as much light, times the noise ratio. What noise reduction predicts for a cell scatters with the few coefficients
/// that passed there, and is larger at edges, in texture and along the border of the frame.
/// @param variance  result of noise_of_luminance
/// @param out  as `variance`
void noise_of_plain_areas(const DevelopPlan& plan, const Rect& crop, const RgbView<const float>& quarter,
                          PlaneView<const float> variance, PlaneView<float> out, Executor& executor);

/// Returns the luminance of a unit of each channel of white-balanced camera RGB, in the unit of
/// plan.rendering.transform.
std::array<float, 3> luminance_of_camera(const DevelopPlan& plan);

/// Computes NoiseGrid from the result of noise_of_luminance: the mean luminance of each cell over the standard
/// deviation of its pixels' noise, 0 for cells without light and at most 1e6.
/// @param out  as `variance`
void signal_to_noise(const DevelopPlan& plan, const RgbView<const float>& quarter, PlaneView<const float> variance,
                     PlaneView<float> out, Executor& executor);

}  // namespace lowlux::isp
