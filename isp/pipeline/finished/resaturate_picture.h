#pragma once

#include <optional>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// Describes how the colours of a finished image are restored.
struct ResaturateOptions {
  Xyz black;                           // colour of the image where there is no light; white is Y = 1
  std::optional<double> chroma_noise;  // denoise::Resaturation::chroma_noise; absent: measured
  double prior_std = 0.065;            // denoise::Resaturation::prior_std
  int radius = 4;                      // denoise::Resaturation::radius
  OutputSpace space = OutputSpace::srgb;
  SampleType samples = SampleType::u8;
};

/// Holds an image with restored colours.
struct Resaturated {
  Picture picture;
  double chroma_noise = 0;
  double fraction_dark =
      0;  // fraction of pixels, not saturated, with surroundings at most as bright as black: now grey
  double fraction_saturated = 0;  // fraction of saturated pixels, which are unchanged
};

/// Returns the standard deviation of X - x0 S and of Y - y0 S (S = X + Y + Z, neutral D65) in flat dark areas, where
/// the black point reduces saturation most; the mean of both: 1.4826 times the median of the absolute values of
/// diagonal Haar details, in the darkest tenth of the image that is brighter than the black point. The texture of
/// brighter areas would count as noise. Demosaicing and JPEG leave little of the noise between neighbours, so means
/// over squares of 2 and 4 pixels are evaluated too, times 2 and 4, and the largest counts. Where rounding leaves
/// no noise there, it is that of the whole image above the black point. Returns 0 for images of fewer than 2 x 2
/// pixels, and for those without noise or without anything above the black point.
/// @param dark  X + Y + Z of the black point
double chroma_noise_of(const RgbView<const float>& xyz, double dark);

/// Applies denoise::resaturate to an image in XYZ, and encodes the result in an output space without tone curve. Pixels
/// with a channel at white are saturated.
/// @param xyz  display-linear, D65 white at Y = 1; taken over
Resaturated resaturate_picture(SceneLinear xyz, const ResaturateOptions& options, Executor& executor);

}  // namespace lowlux::isp
