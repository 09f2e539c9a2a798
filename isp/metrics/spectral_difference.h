#pragma once

#include "isp/base/executor.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// Distance of the smoothest spectra of an image's colours (lift()) from those of a reference [nat], means over pixels.
/// Brightness does not count, chromaticity alone does.
struct SpectralDifference {
  double kullback_leibler = 0;  // divergence of the reference from the test, D(reference || test)
  double jeffreys = 0;          // sum of the divergences in both directions
  int pixels = 0;               // number with a chromaticity in both; if none, the means are not numbers
};

/// At most this many pixels, spread evenly, are evaluated.
inline constexpr int spectral_samples = 4096;

/// Computes the spectral difference of two images. Chromaticities outside the spectral locus count as the nearest ones
/// that can be lifted.
/// @param reference_xyz, test_xyz  X, Y, Z planes of one size, D65 at Y = 1 their white
SpectralDifference spectral_difference(const SceneLinear& reference_xyz, const SceneLinear& test_xyz,
                                       Executor& executor);

}  // namespace lowlux::isp
