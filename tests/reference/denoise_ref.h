#pragma once

#include <array>

#include "denoise/denoiser.h"

namespace lowlux::reference {

struct Denoised {
  Plane<double> signal_e;
  Plane<double> residual_variance;
  Plane<double> chroma_confidence;
  std::array<Plane<double>, 3> site_variance;
};

/// Computes what denoise::Denoiser does, in double and one block at a time, without its treatment of point sources
/// and without DenoiseOptions::keep_means.
Denoised denoise(const denoise::RawElectronsView& raw, const denoise::RawNoise& noise,
                 const denoise::DenoiseOptions& options);

}  // namespace lowlux::reference
