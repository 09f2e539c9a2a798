#pragma once

#include <cstdint>

#include "calib/frame_setting.h"
#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Statistics of the pixels of one CFA site from two frames a and b of the same light.
struct SiteStatistics {
  std::int64_t pixels = 0;
  int rows = 0;
  double mean_dn = 0;       // mean of both frames
  double drift_dn = 0;      // mean of b less mean of a
  double variance_dn2 = 0;  // temporal: half the variance of b - a about its mean (EMVA 1288), quantisation included
  double row_variance_dn2 = 0;  // the part common to whole rows; unbiased, may be negative
  double covariance_dn2 = 0;    // of a and b within blocks of 32 x 32 sites: the part constant between frames (spatial
                                // variance s^2; equal to EMVA's s_mean^2 - sigma^2 / 2); unbiased, may be negative
  double column_covariance_dn2 = 0;  // the part of it that whole columns have in common, shading of the frame included;
                                     // unbiased, may be negative
  double fraction_at_white = 0;      // fraction of the samples at or above the white level
  double fraction_at_zero = 0;       // fraction of the samples at code 0
};

/// Statistics of one pair of frames. Pixels are not kept, so that any number of pairs fits in memory.
struct PairStatistics {
  FrameSetting setting;
  PerSite<SiteStatistics> site;  // counted from the corner of the active area
};

/// Measures the statistics of the active areas of two frames of one setting.
/// Errors: those of setting_of, and frames that differ in camera, size, mosaic, white level, gain or exposure time.
Result<PairStatistics> measure_pair(const RawDn& a, const RawDn& b);

}  // namespace lowlux::calib
