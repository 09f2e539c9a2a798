#pragma once

#include "isp/base/executor.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// How far the smoothest spectra of a picture's colours (lift()) are from those of a reference [nat], means over
/// pixels. Brightness does not count, chromaticity alone does.
struct SpectralDifference {
  double kullback_leibler = 0;  // of the reference from the test, D(reference || test)
  double jeffreys = 0;          // both ways together
  int pixels = 0;               // that have a chromaticity in both; if none, the means are not numbers
};

/// Pixels that are looked at, at most, spread evenly.
inline constexpr int spectral_samples = 4096;

/// Chromaticities no light can have count as the nearest ones that can be lifted.
/// @param reference_xyz, test_xyz  X, Y, Z planes of one size, D65 at Y = 1 their white
SpectralDifference spectral_difference(const SceneLinear& reference_xyz, const SceneLinear& test_xyz,
                                       Executor& executor);

}  // namespace lowlux::isp
