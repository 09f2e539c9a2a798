#pragma once

#include <cstdint>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"

namespace lowlux::calib {

/// One small patch of pixels of one colour. All energies are means of squares of orthonormal details: for noise alone,
/// each is a chi square divided by its degrees of freedom, times the variance, and independent of the others.
struct NoiseSample {
  float mean_dn = 0;    // mean of the patch, above black
  float around_dn = 0;  // mean of the pixels around the patch, whose noise is independent of the patch's
  float low_dn2 = 0;    // variance of coarse details, in which texture is strongest
  float middle_dn2 = 0;
  float high_dn2 = 0;     // variance of the finest details, which are considered as noise
  std::uint8_t site = 0;  // for greens: that of the upper one, for both
};

/// Number of details of which each energy of a sample is the mean. 0: the energy is not available.
struct DetailCount {
  int low = 0;
  int middle = 0;
  int high = 0;
  double step_fraction = 0;         // variance of mean_dn - around_dn for noise alone, relative to a pixel's
  double independent_fraction = 1;  // independent fraction of the high details: neighbouring samples may share pixels
};

/// Holds the noise samples of an image.
struct NoiseSamples {
  DetailCount details;
  std::vector<NoiseSample> sample;
};

/// Side of a block and width of its surroundings [pixels of the colour].
inline constexpr int noise_block = 8, noise_border = 2;

/// Selection of samples.
struct SamplePlan {
  PerSite<double> black_dn{};
  std::int64_t max_samples = 0;  // above 0: limit for all sites together, kept by using only every n-th row of samples
};

/// Returns samples of adjacent blocks of 8 x 8 pixels of one colour, by their cosine transform (the details that N.
/// Ponomarenko et al. 2007 use; IPOL 3, 2013, "Analysis and extension of the Ponomarenko method"). Details of level and
/// slope are left out. The greens of a Bayer mosaic are one square lattice, sqrt 2 apart and turned by 45 degrees, and
/// so are their blocks. Only for SensorLayout::bayer and monochrome (whose four sites are also processed separately).
NoiseSamples block_samples(const RawDn& raw, const SamplePlan& plan, Executor& executor);

/// Returns samples of second differences in both directions, at every second pixel of a colour, with the 7 x 7 pixels
/// around them, on the lattices of block_samples() (after Foi et al. 2008, whose details are wavelets and whose level
/// sets come from smoothing).
NoiseSamples detail_samples(const RawDn& raw, const SamplePlan& plan, Executor& executor);

}  // namespace lowlux::calib
