#pragma once

#include <limits>
#include <span>
#include <vector>

#include "calib/flat/pair_statistics.h"
#include "isp/base/cfa.h"
#include "isp/base/estimate.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// One point of the photon transfer curve.
struct TransferPoint {
  int site = 0;
  int pair = 0;             // index of its flats; -1: darks
  double signal_dn = 0;     // mean above the darks' mean
  double variance_dn2 = 0;  // temporal, with quantisation's 1/12 subtracted
  double pixels = 0;
  double rows = 0;
};

/// Parameters other than the line that determine the points' variances.
struct DarkScatter {
  double row_variance_dn2 = 0;   // temporal, of whole rows; at least 0
  double dark_variance_dn2 = 0;  // temporal, of single pixels, without quantisation; at least 0
  double pairs = 1;              // number of pairs of darks
};

/// A fitted line, variance = gain * signal + offset.
struct TransferLine {
  Estimate gain_dn_per_e;
  Estimate offset_dn2;
  double covariance = 0;  // covariance of gain and offset
  double chi_square = 0;
  int degrees_of_freedom = 0;
};

/// Fits a line by weighted least squares; weights follow from the line itself and are iterated. The variance of a point
/// of n pixels from one pair, in DN^4, V being the line there and V0 at no light, is
///     (2 V^2 + K^2 V0 / 2) / n + 4 row^4 / rows                       (darks)
///     ... + K^2 V0 / (2 n pairs) + K^2 row^2 (1 + 1 / pairs) / (2 rows)   (flats)
/// from the cumulants of Poisson + normal: 2 sigma^4 + kappa_4 / 2 for half the variance of a difference, and the error
/// of the mean, correlated with it by kappa_3 / 2, through the slope. Row terms are doubled: two sites have each row in
/// common.
/// @param points at least three, at two or more signals
TransferLine fit_line(std::span<const TransferPoint> points, const DarkScatter& scatter);

/// Statistics of all pairs of darks together.
struct JoinedDarks {
  PerSite<double> mean_dn{};
  PerSite<double> spatial_dn2{};
  PerSite<double> column_dn2{};  // the part of it that whole columns have in common
  double variance_dn2 = 0;       // temporal, of all sites, quantisation included
  DarkScatter scatter;
};

/// Point where a site's variance is largest; `reached` if it falls beyond or codes end there, else the brightest flats.
struct TransferPeak {
  double signal_dn = 0;
  double fallen_dn = 0;  // darkest signal beyond it at which the variance has fallen; the largest one if it has not
  bool reached = false;
};

/// Holds the variance against mean of all pairs of flats, and where it ends.
struct TransferCurve {
  std::vector<TransferPoint> flats;  // all flats
  PerSite<TransferPeak> peak{};
  std::vector<TransferPoint> linear;             // flats of the linear range, and the darks where they are dithered
  int levels = std::numeric_limits<int>::max();  // number in `linear`, of the site that has fewest
};

/// Joins darks of one setting that are not clipped. Errors: see fit_photon_transfer.
Result<JoinedDarks> join_darks(std::span<const PairStatistics> darks);

/// Computes the curve of variance against mean. Errors: see fit_photon_transfer.
Result<TransferCurve> curve_of(std::span<const PairStatistics> dark_pairs, std::span<const PairStatistics> flats,
                               const JoinedDarks& darks, bool under_dithered);

}  // namespace lowlux::calib
