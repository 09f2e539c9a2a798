#pragma once

#include <array>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/bench/denoise_scene.h"

namespace lowlux::isp {

/// The same multi-scale DCT behind a variance-stabilising transform: f of each raw value with its dark (Anscombe), the
/// denoiser at `level` on noise of standard deviation 1, the exact unbiased inverse (Makitalo & Foi 2013), then the
/// dark off. The denoiser is not told of the signal in its values: they are scaled by 1e6, beside whose square their
/// mean is below 1e-3 as a variance. Chroma starts at the level that the whole picture's q = s / sqrt(s + d + sigma^2)
/// asks for, and is not drawn towards neutral, which stabilised values do not have.
/// @param white_gain  of the stabilised colours
/// @param signal_e  as large as the shot
void gat_denoise(denoise::Denoiser& denoiser, const DenoiseShot& shot, denoise::Level level,
                 const std::array<double, 3>& white_gain, PlaneView<float> signal_e, Executor& executor);

}  // namespace lowlux::isp
