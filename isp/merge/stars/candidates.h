#pragma once

#include <vector>

#include "isp/base/executor.h"
#include "isp/merge/frame.h"
#include "isp/merge/stars/background.h"

namespace lowlux::merge {

/// A maximum of the matched filter.
struct Candidate {
  int x = 0;
  int y = 0;
  float dx_px = 0;  // offset of the vertex of a parabola through the maximum and its neighbours
  float dy_px = 0;
  float snr = 0;
};

/// Holds the input of find_candidates().
struct CandidateSearch {
  const FrameView& frame;
  const Background& background;
  double psf_sigma_px;
  double probability;  // probability that noise exceeds the limit at one site
};

/// Returns the taps of the matched filter from the centre outward, up to 3 sigma: the Gaussian integrated over pixels;
/// the squares of all, both sides counted, add up to 1.
std::vector<float> matched_filter_taps(double psf_sigma_px);

/// Finds candidates by decreasing snr, equal ones row by row: steps 1 to 3 of find_stars.h.
std::vector<Candidate> find_candidates(const CandidateSearch& search, Executor& executor);

}  // namespace lowlux::merge
