#pragma once

#include <cstdint>

#include "calib/frame_setting.h"
#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// What two frames a and b of the same light say about the pixels of one CFA site.
struct SiteStatistics {
  std::int64_t pixels = 0;
  int rows = 0;
  double mean_dn = 0;       // of both frames
  double drift_dn = 0;      // mean of b less mean of a
  double variance_dn2 = 0;  // temporal: half the variance of b - a about its mean (EMVA 1288), quantisation included
  double row_variance_dn2 = 0;  // of it what whole rows have in common; unbiased, so that it may be negative
  double covariance_dn2 = 0;    // of a and b within blocks of 32 x 32 sites: what stays from frame to frame (spatial
                                // variance s^2; equal to EMVA's s_mean^2 - sigma^2 / 2); unbiased, may be negative
  double share_at_white = 0;    // of the samples, at or above the white level
  double share_at_zero = 0;     // at code 0
};

/// One pair of frames, reduced: nothing of the pixels is kept, so that any number of pairs fits in memory.
struct PairStatistics {
  FrameSetting setting;
  PerSite<SiteStatistics> site;  // counted from the corner of the active area
};

/// Statistics of the active areas of two frames of one setting.
/// Errors: those of setting_of, and frames that differ in camera, size, mosaic, white level, gain or exposure time.
Result<PairStatistics> measure_pair(const RawDn& a, const RawDn& b);

}  // namespace lowlux::calib
