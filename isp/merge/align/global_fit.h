#pragma once

#include <vector>

#include "isp/merge/align/global_motion.h"
#include "isp/merge/align/tiles.h"

namespace lowlux::merge {

/// Which parameters are fitted: the first three; all, if the others are significant (chi-square of 5 degrees of
/// freedom, 0.1 %); all.
enum class MotionModel { rigid, significant, full };

/// How a global motion changes so that it fits the tiles of a frame.
struct GlobalFit {
  MotionStep step{};
  bool is_rigid = true;     // only translation and rotation were fitted
  int determined = 0;       // number of directions of `step` that the tiles determine
  double inflation = 1;     // variance of the tiles' scores about the fit, in units of what noise explains; at least 1
  double variance_px2 = 0;  // variance of a displacement along one axis, mean over the tiles
  double largest_px = 0;    // change of displacement of any tile
  double mean_square_px2 = 0;  // mean square of the changes of displacement, for one axis
  double light_change = 0;     // by which the ratio of the frame's light to the reference's is larger
};

/// Fits a change of `motion` to tiles that were measured with it, by least squares with the tiles' variances, and
/// weights 1 / (1 + z^2 / (12 inflation)) with z^2 the chi-square of a tile's residual (2 degrees of freedom): tiles
/// with a motion of their own lose their influence. Translation and rotation are always fitted; scale, shear and
/// perspective, whose prior is normal with a standard deviation of 1 % of half the diagonal at the corner, as `model`
/// says.
/// @param undetermined_variance_px2  variance of the directions of translation and rotation that the tiles do not
/// determine
/// @param light  ratio of light that the tiles were measured with, and expected_light the one expected beforehand,
///               with a standard deviation of 5 %
GlobalFit fit_global(const GlobalMotion& motion, const TileGrid& grid, const std::vector<TileFit>& fits,
                     MotionModel model, double undetermined_variance_px2, double light, double expected_light);

/// Returns the score of a tile after the displacement (dx, dy), and the chi-square of a score: 0 for a tile without
/// one.
std::array<double, 2> residual_of(const TileFit& fit, double dx_px, double dy_px);
double chi_square_of(const TileFit& fit, const std::array<double, 2>& score);

}  // namespace lowlux::merge
