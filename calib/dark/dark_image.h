#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "calib/dark/dark_stack.h"
#include "isp/base/cfa.h"
#include "isp/base/plane.h"

namespace lowlux::calib {

/// Pixels that are left out of means, 1 for those left out.
using PixelMask = Plane<std::uint8_t>;

/// Where a site's pixels lie, whatever a few of them do. `smallest_deviation` stands in where most are equal.
struct SiteSpread {
  double median = 0;
  double deviation = 0;  // standard deviation of what lies within 6 normalised median absolute deviations
};
SiteSpread spread_of(const Plane<float>& values, int site, double smallest_deviation);

/// Sum of the groups' means with a weight each: any linear estimate made pixel by pixel. One weight for each group.
struct WeightedImage {
  std::span<const DarkGroup> groups;
  std::span<const double> weights;
};

/// What the pixels of one site that are not masked say about a weighted image.
struct ImageFigures {
  double pixels = 0;
  double mean = 0;
  double standard_error = 0;     // with what rows and columns have in common
  double variance = 0;           // of pixels, spatial and remaining temporal noise together
  double column_variance = 0;    // of it what whole columns have in common; unbiased, may be negative
  double temporal_variance = 0;  // of it what follows from the groups' temporal noise
  /// A straight line through the means of columns (x) and of rows (y): its change from edge to edge.
  double change_x = 0, change_y = 0, error_x = 0, error_y = 0;
  double row_variance = 0;  // as column_variance, of whole rows
};
ImageFigures figures_of(const WeightedImage& image, const PixelMask& mask, int site);

}  // namespace lowlux::calib
