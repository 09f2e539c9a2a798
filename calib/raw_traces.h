#pragma once

#include "calib/noise_samples.h"
#include "isp/base/cfa.h"
#include "isp/base/frame.h"

namespace lowlux::calib {

/// What was done to a raw before it came here, as far as its codes tell: the figure each flag rests on stands beside
/// it.
struct RawTraces {
  int code_step_dn = 1;     // smallest distance of codes in use, of the site where it is largest
  int largest_step_dn = 1;  // of any part of the range: above the smallest where codes were companded
  double grid_excess = 0;   // restlessness across the lines of an 8 x 8 grid, relative to that elsewhere, less 1
  double fine_to_coarse =
      0;                    // energy of the finest details to that of the next, where the picture is quietest; noise: 1
  bool companded = false;   // steps that grow with the value, as lossy raw formats have them
  bool block_grid = false;  // lines of an 8 x 8 grid of one colour's pixels show: coded in blocks
  bool denoised = false;    // fine_to_coarse below 0.7: filtered, or grain of the scene
};

/// Below this ratio (denoise.md 9.8) what looks like noise is coarser than noise is: it was filtered, or grain and
/// texture of the scene are stronger than the noise everywhere (untouched kodim19 at 60 e-: 0.43). Neither can be
/// believed. In the dark, where noise is what there is, untouched pictures have 0.9 to 1.
inline constexpr double least_fine_to_coarse = 0.7;

/// Steps and grid of the active area; fine_to_coarse is left at 0.
/// Steps are told where codes lie dense (30 pixels for each code): a sixteenth of the range in use or more.
RawTraces code_traces(const RawDn& raw);

/// Adds fine_to_coarse and what follows from it.
void add_filter_trace(const NoiseSamples& blocks_by_surroundings, RawTraces& traces);

}  // namespace lowlux::calib
