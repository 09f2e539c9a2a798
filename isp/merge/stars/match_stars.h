#pragma once

#include "isp/base/result.h"
#include "isp/merge/stars/star.h"
#include "isp/merge/stars/star_transform.h"

namespace lowlux::merge {

/// Holds the options of match_stars().
struct MatchOptions {
  double max_scale_change = 0.02;             // 0..0.1
  double max_false_match_probability = 1e-6;  // 1e-30..0.1: that two unrelated lists are taken for the same stars
};

/// Holds how a frame lies to a reference, as its stars show it.
struct StarMatch {
  StarTransform transform;                   // from the reference to the frame; its covariance regards chi_square_ratio
  int matched = 0;                           // stars that are in both lists and were used
  int in_view = 0;                           // stars of the reference that lie within the frame
  double log10_false_match_probability = 0;  // upper bound
  double rms_px = 0;                         // residual of one axis
  double chi_square_ratio = 0;  // chi-square / degrees of freedom: above 1, places scatter more than they state
};

/// Finds the transformation from a reference to another frame without any prior but its scale, and fits it.
///
/// 1. Triangles of the brightest 25, 70, 200, 500 stars of both lists are compared (triangles.h). Each pair of
///    triangles states a similarity, which is refitted to the stars that agree with it.
/// 2. It is accepted by the number of agreeing stars alone (a contrario, as Moisan and Stival, IJCV 57, 2004): of the n
///    stars of the reference in view, m have one of the frame within r = 1/4, 1/2, 1, 2, 4 or 8 px. Stars that are
///    placed at random, of the density found around, do so with probability q; the expected number of similarities
///    through two stars of each list that would reach m by chance is at most
///        tests * P(binomial(n - 2, q) >= m - 2),
///    which is compared with max_false_match_probability. Where another similarity reaches 0.8 of its logarithm, as in
///    patterns that repeat, none is accepted.
/// 3. Weighted least squares by the standard errors of the stars, pairs more than five standard deviations apart left
///    out. The radial model replaces the similarity where it lowers chi-square by more than 2 (Akaike 1974), and a
///    polynomial replaces both where their chi-square is significantly (0.001) above that of the largest model; models
///    need at least twice as many coordinates as parameters. Where the places scatter more than their standard errors
///    state, the excess enters the comparison and the covariance.
///
/// @return insufficient, with the counts, where too few stars match
Result<StarMatch> match_stars(const StarField& reference, const StarField& frame, const MatchOptions& options);

}  // namespace lowlux::merge
