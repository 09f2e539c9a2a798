#pragma once

#include <array>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/estimate.h"

namespace lowlux::merge {

/// Describes one star as measured in one frame. Pixel centres have integer coordinates.
struct Star {
  Estimate x_px;
  Estimate y_px;
  Estimate sigma_px;                 // standard deviation of the Gaussian PSF, before integration over pixels
  std::array<Estimate, 3> flux_e{};  // R, G, B: in all, had every site this filter; {0, 0} if not measured
  double snr = 0;                    // of the matched filter: standard deviations of the noise without the star
};

/// Counts the sources that were detected and are not listed as stars, by the first reason that applied.
struct NotStars {
  int single_sites = 0;  // hot pixels: nothing is left without their brightest site
  int extended = 0;      // or structure: an edge, a lamp, a galaxy
  int sharp = 0;         // far narrower than the stars of this frame
  int missing = 0;       // too many sites without value, or too close to the border
};

/// Holds the stars of one frame.
struct StarField {
  int width = 0;  // width of the frame
  int height = 0;
  std::vector<Star> stars;         // by decreasing snr
  double psf_sigma_px = 0;         // median width of the stars; 0 if there are none
  PerSite<double> background_e{};  // median of the local background; 0 if none could be measured
  NotStars not_stars;
};

}  // namespace lowlux::merge
