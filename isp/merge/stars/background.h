#pragma once

#include <optional>
#include <vector>

#include "isp/base/executor.h"
#include "isp/merge/frame.h"

namespace lowlux::merge {

/// Describes the background of a frame, its light without stars, at the centres of blocks of about 64 x 64 sites, after
/// Bertin and Arnouts (A&AS 117, 1996). Between the centres it is interpolated bilinearly.
struct Background {
  std::vector<float> column_px;  // columns of the centres, ascending
  std::vector<float> row_px;
  std::vector<PerSite<float>> level_e;  // rows x columns
  std::vector<PerSite<float>> per_std;  // 1 / standard deviation of a site, clutter included [1/e]

  int columns() const { return static_cast<int>(column_px.size()); }
  int rows() const { return static_cast<int>(row_px.size()); }
};

/// Smallest variance of a site [e^2]: a frame without read noise has sites whose variance is not known to be above 0.
inline constexpr double min_variance_e2 = 1e-4;

/// Measures the background. Of each block, the 8 x 8 sites of its tiles are averaged; tiles whose mean is more than
/// three standard deviations from the median of the tiles do not count. Means of tiles are nearly normal at any light,
/// so this removes stars and does not bias the mean of Poisson noise as clipping single sites would. Where the means
/// of tiles scatter more than noise does, the excess counts as noise (clutter) at the scale of a star.
/// @param psf_sigma_px scale of a star
/// @return nullopt if no block has enough sites, as in frames of less than 16 x 16
std::optional<Background> measure_background(const FrameView& frame, double psf_sigma_px, Executor& executor);

/// Returns the background at a pixel for each site of the cell.
PerSite<double> level_at(const Background& background, double x, double y);

/// Returns the median over the blocks.
PerSite<double> median_level(const Background& background);

}  // namespace lowlux::merge
