#pragma once

#include <limits>
#include <span>
#include <vector>

#include "calib/flat/pair_statistics.h"
#include "calib/flat/photon_transfer_fit.h"
#include "isp/base/cfa.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Statistics of all pairs of darks together.
struct JoinedDarks {
  PerSite<double> mean_dn{};
  PerSite<double> spatial_dn2{};
  double variance_dn2 = 0;  // temporal, of all sites, quantisation included
  DarkScatter scatter;
};

/// Point where a site's variance is largest; `reached` if it falls beyond or codes end there, else the brightest flats.
struct TransferPeak {
  double signal_dn = 0;
  double fallen_dn = 0;  // darkest signal beyond it at which the variance has fallen; the largest one if it has not
  bool reached = false;
};

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
