#pragma once

#include <optional>
#include <vector>

#include "calib/picture/noise_line.h"
#include "calib/picture/noise_samples.h"
#include "isp/base/cfa.h"
#include "isp/base/frame.h"

namespace lowlux::calib {

/// Returns P(chi^2 < x) with `degrees` degrees of freedom, 1..64; 0 for x <= 0.
double chi_square_probability(int degrees, double x);

/// Returns the x at which chi_square_probability() is `probability` (above 0, below 1).
double chi_square_quantile(int degrees, double probability);

/// Returns the mean of a chi square, divided by its degrees of freedom, of the values below x: 1 without limit.
double chi_square_mean_below(int degrees, double x);

/// Fractions that select flat samples, and those to average.
struct FlatRule {
  double low_fraction = 0.8;     // fraction of flat samples that is kept: those with the least coarse detail
  double middle_fraction = 0.8;  // fraction of flat samples that is kept: those with the least middle detail
  double high_fraction = 0.98;   // fraction of flat samples in the average: the others count as texture
};

/// Holds the samples of flat areas, grouped by brightness.
struct FlatPoints {
  std::vector<NoisePoint> points;
  double samples = 0;    // number kept
  double mean_high = 0;  // mean of high details relative to the line; for pure noise both means are 1
  double mean_middle = 0;
};

/// Returns means and variances of samples whose details are no larger than noise of this line would make them. Each
/// group of samples has about the same surroundings: sorting by the samples themselves would sort by their noise.
/// Details of different bands are independent where noise is normal, so that the selection by the low and middle ones
/// does not change the mean of the high ones. The distribution of clipped pixels is skewed: there a strict selection
/// prefers dark samples, which is why the fractions are high. The bias from excluding the largest high ones is
/// corrected (chi_square_mean_below).
/// @param clip clip of each site
FlatPoints flat_points(const NoiseSamples& samples, const NoiseLine& line, const PerSite<ClipRange>& clip,
                       const FlatRule& rule);

/// Returns the points of the fraction `share` of each group that has the least coarse detail, for use before a line is
/// known.
FlatPoints quietest_points(const NoiseSamples& samples, const PerSite<ClipRange>& clip, double share);

/// Returns the ratio of the variance of the finest details to that of a line, in the fraction `share` of each group
/// that has the least coarse detail: the lower quartile of the groups, as detail of the scene only adds to it. 1 where
/// no group has enough pixels that are not clipped.
double quiet_ratio(const NoiseSamples& samples, const NoiseLine& line, const PerSite<ClipRange>& clip, double share);

/// Sorts samples by site and surroundings, as flat_points() and quietest_points() require.
void sort_by_surroundings(NoiseSamples& samples);

/// Previous processing of a raw, as far as its codes show it: each flag has the value that it is based on.
struct RawTraces {
  int code_step_dn = 1;     // smallest distance of codes in use, of the site where it is largest
  int largest_step_dn = 1;  // in any part of the range: above the smallest for companded codes
  double grid_excess = 0;   // second differences across the lines of an 8 x 8 grid, relative to those elsewhere, less 1
  double fine_to_coarse =
      0;  // ratio of the energy of the finest details to that of the next, where the image has least detail; noise: 1
  bool companded = false;   // steps that grow with the value, as in lossy raw formats
  bool block_grid = false;  // visible lines of an 8 x 8 grid of one colour's pixels: coded in blocks
  bool denoised = false;    // fine_to_coarse below 0.7: filtered, or grain of the scene
};

/// Below this ratio (denoise.md 9.8) what looks like noise is coarser than noise is: it was filtered, or grain and
/// texture of the scene are stronger than the noise everywhere (unfiltered kodim19 at 60 e-: 0.43). Neither gives a
/// reliable result. In the dark, where noise dominates, unfiltered images have 0.9 to 1.
inline constexpr double min_fine_to_coarse = 0.7;

/// Measures steps and grid of the active area; fine_to_coarse is left at 0. Steps are measured where codes are dense
/// (30 pixels for each code), in sixteenths of the range in use: an unused code counts if the used ones next to it have
/// so many pixels that it would be in use too.
RawTraces code_traces(const RawDn& raw, Executor& executor);

/// Sets fine_to_coarse, and `denoised` from it.
void add_filter_trace(const NoiseSamples& blocks_by_surroundings, RawTraces& traces);

}  // namespace lowlux::calib
