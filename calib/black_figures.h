#pragma once

#include <cstdint>

#include "calib/dark_stack.h"
#include "isp/base/cfa.h"
#include "isp/base/estimate.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Standard deviation of the means of rows or columns, and what white noise alone would give.
struct LineScatter {
  double found_dn = 0;
  double white_dn = 0;
};

/// What dark pixels of one exposure time say: the pedestal with the dark charge in it.
struct BlackFigures {
  PerSite<Estimate> level_dn{};    // row and column terms are in the errors
  PerSite<double> deviation_dn{};  // of the pixels that were kept, in one frame
  PerSite<LineScatter> rows{};     // of the mean of the frames
  PerSite<LineScatter> columns{};
  double row_noise_dn = 0;     // what whole rows of one frame have in common beyond white noise, mean of the sites
  double column_noise_dn = 0;  // fixed
  std::int64_t pixels = 0;     // kept, of all sites
  double excluded_share = 0;
  int frames = 0;
};

/// Means of the pixels within 5 standard deviations (robustly found) of their site's median: the cut takes 6e-7 of a
/// normal law on both sides alike.
/// Errors: those of setting_of; fewer than 500 pixels of a site; more than 5 % excluded; codes at 0 or white.
Result<BlackFigures> measure_black(const RawDn& frame);
Result<BlackFigures> measure_black(const DarkGroup& group);

/// The frame with one part of its readout as active area: masked pixels to be measured as dark frames are. The part is
/// cut so that its corner is of the active area's first colour.
/// Errors: a part that is not in the readout.
Result<RawDn> part_of(const RawDn& frame, const Rect& part);

}  // namespace lowlux::calib
