#pragma once

#include "denoise/denoise_options.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/pipeline/noise_reduction.h"

/// Views of NoiseMaps, as the denoiser fills them.
namespace lowlux::isp {

denoise::DenoiseMaps views_of(NoiseMaps& maps);

/// Allocates memory for the maps of a mosaic of width x height sites.
void fit(NoiseMaps& maps, int width, int height);

/// Returns the maps of the cells of a region of sites; none where there are no maps.
denoise::DenoiseMaps crop_of(const denoise::DenoiseMaps& maps, const Rect& sites);

/// Copies maps of one size; nothing where there are none to copy to.
void copy(const denoise::DenoiseMaps& from, const denoise::DenoiseMaps& to);
void copy(const PlaneView<float>& from, const PlaneView<float>& to);

}  // namespace lowlux::isp
