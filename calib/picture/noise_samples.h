#pragma once

#include <cstdint>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"

namespace lowlux::calib {

/// One small patch of pixels of one colour. All energies are means of squares of orthonormal details: where there is
/// noise only, each is a chi square divided by its degrees of freedom, times the variance, and independent of the
/// others.
struct NoiseSample {
  float mean_dn = 0;    // of the patch, above black
  float around_dn = 0;  // mean of the pixels about the patch, whose noise is independent of the patch's
  float low_dn2 = 0;    // of coarse details, in which texture shows most
  float middle_dn2 = 0;
  float high_dn2 = 0;     // of the finest details: what is taken for noise
  std::uint8_t site = 0;  // of the greens: the upper one's, for both
};

/// How many details each energy of a sample is the mean of. 0: there is no such energy.
struct DetailCount {
  int low = 0;
  int middle = 0;
  int high = 0;
  double step_share = 0;         // variance of mean_dn - around_dn where there is noise only, relative to a pixel's
  double independent_share = 1;  // of the high ones: neighbouring samples may share pixels
};

struct NoiseSamples {
  DetailCount details;
  std::vector<NoiseSample> sample;
};

/// Side of a block and width of its surroundings [pixels of the colour].
inline constexpr int noise_block = 8, noise_border = 2;

/// Which samples are taken.
struct SamplePlan {
  PerSite<double> black_dn{};
  std::int64_t most_samples = 0;  // above 0: of all sites together; beyond it only every n-th row of them is taken
};

/// Blocks of 8 x 8 pixels of one colour, side by side, by their cosine transform (the details N. Ponomarenko et al.
/// 2007 use; IPOL 3, 2013, "Analysis and extension of the Ponomarenko method"). Details of level and slope are left
/// out. The greens of a Bayer mosaic are one square lattice, sqrt 2 apart and turned by 45 degrees, and so are their
/// blocks. Only for SensorLayout::bayer and monochrome (whose four sites are taken one by one too).
NoiseSamples block_samples(const RawDn& raw, const SamplePlan& plan, Executor& executor);

/// Second differences in both directions, every second pixel of a colour, with the 7 x 7 pixels about them, on the same
/// lattices (after Foi et al. 2008, whose details are wavelets and whose level sets come of smoothing).
NoiseSamples detail_samples(const RawDn& raw, const SamplePlan& plan, Executor& executor);

}  // namespace lowlux::calib
