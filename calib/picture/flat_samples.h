#pragma once

#include <optional>
#include <vector>

#include "calib/picture/noise_line.h"
#include "calib/picture/noise_samples.h"
#include "isp/base/cfa.h"
#include "isp/base/frame.h"

namespace lowlux::calib {

/// P(chi^2 < x) of `degrees` degrees of freedom, 1..64; 0 for x <= 0.
double chi_square_probability(int degrees, double x);

/// Where it is `probability` (above 0, below 1).
double chi_square_quantile(int degrees, double probability);

/// Mean of a chi square, divided by its degrees of freedom, of the values below x: 1 without limit.
double chi_square_mean_below(int degrees, double x);

/// How samples are told to be flat, and what is averaged over them.
struct FlatRule {
  double low_share = 0.8;     // of flat samples, kept: those of the least coarse detail
  double middle_share = 0.8;  // the same of middle details
  double high_share = 0.98;   // of flat samples, kept in the average: beyond is taken for texture
};

struct FlatPoints {
  std::vector<NoisePoint> points;
  double samples = 0;    // that were kept
  double mean_high = 0;  // of kept samples, relative to the line: where there is only noise both are 1
  double mean_middle = 0;
};

/// Means and variances of samples that are no more restless than noise of this line would make them. Each group of
/// samples has about the same surroundings: sorting by the samples themselves would sort by their noise. Details of
/// different bands are independent where noise is normal, so that the choice by the low and middle ones does not change
/// the mean of the high ones. The law of clipped pixels is skewed: there a strict choice prefers dark samples, which is
/// why the shares are high. What leaving out the largest high ones takes away is put back (chi_square_mean_below).
/// @param clip of each site
FlatPoints flat_points(const NoiseSamples& samples, const NoiseLine& line, const PerSite<ClipRange>& clip,
                       const FlatRule& rule);

/// Where no line is known yet: the share `share` of each group that has the least coarse detail.
FlatPoints quietest_points(const NoiseSamples& samples, const PerSite<ClipRange>& clip, double share);

/// Sorts samples by site and surroundings, as the two functions above need them.
void sort_by_surroundings(NoiseSamples& samples);

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
