#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "calib/dark/dark_stack.h"
#include "isp/base/cfa.h"
#include "isp/base/plane.h"

namespace lowlux::calib {

/// Mask of pixels that are excluded from means: 1 for those excluded.
using PixelMask = Plane<std::uint8_t>;

/// Robust location and spread of a site's pixels. `smallest_deviation` replaces the deviation where most values are
/// equal.
struct SiteSpread {
  double median = 0;
  double deviation = 0;  // standard deviation of the values within 6 normalised median absolute deviations
};
SiteSpread spread_of(const Plane<float>& values, int site, double smallest_deviation);

/// Sum of the groups' means with a weight each, for any linear estimate pixel by pixel. One weight for each group.
struct WeightedImage {
  std::span<const DarkGroup> groups;
  std::span<const double> weights;
};

/// Statistics of a weighted image over the pixels of one site that are not masked.
struct ImageFigures {
  double pixels = 0;
  double mean = 0;
  double standard_error = 0;     // includes the variance common to rows and columns
  double variance = 0;           // variance of pixels, spatial and remaining temporal noise together
  double column_variance = 0;    // the part of `variance` that whole columns have in common; unbiased, may be negative
  double temporal_variance = 0;  // the part of `variance` that follows from the groups' temporal noise
  /// Change from edge to edge of straight lines through the means of columns (x) and of rows (y).
  double change_x = 0, change_y = 0, error_x = 0, error_y = 0;
  double row_variance = 0;  // like column_variance, for whole rows
};
ImageFigures figures_of(const WeightedImage& image, const PixelMask& mask, int site);

}  // namespace lowlux::calib
