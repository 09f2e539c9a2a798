#pragma once

#include <optional>
#include <vector>

#include "calib/noise_line.h"
#include "calib/noise_samples.h"

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

}  // namespace lowlux::calib
