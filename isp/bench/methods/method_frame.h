#pragma once

#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/bench/methods/method.h"
#include "isp/bench/scenes/denoise_scene.h"
#include "isp/metrics/picture_metrics.h"

namespace lowlux::isp {

/// Returns a shot as the raw frame of a camera: 16 bits RGGB, with matrix, white balance, noise and a black level that
/// includes the dark charge, as masked pixels measure it. Neither end of the codes clips noise (eight standard
/// deviations). Nothing in it names the scene.
RawFrame noisy_frame(const DenoiseShot& shot);

/// System gain of noisy_frame [DN/e-].
double gain_dn_per_e(const DenoiseShot& shot);

/// Renders what a method made by the same rules for all methods. A raw frame keeps the scale of its levels. An image is
/// scaled to the mean luminance of the truth, as the exposure of a raw developer is its own.
/// @param truth  linear Rec. 709
/// Errors, with what was found and expected: another size, mosaic or layout.
Result<RenderedPicture> rendered(const MethodImage& image, const DenoiseShot& shot, const SceneLinear& truth,
                                 BenchRenderer& renderer);

}  // namespace lowlux::isp
