#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "isp/merge/motion.h"
#include "isp/merge/stars/point_grid.h"

namespace lowlux::merge {

/// Lists the models of a transformation, each contained in those after it to first order.
enum class TransformModel : std::uint8_t {
  similarity,  // translation, rotation, scale: 4 parameters
  radial,      // and one radial distortion k r^2 of the lens, the same in both frames: 5
  quadratic,   // polynomials of second order for both coordinates: 12
  cubic,       // of third order: 20
};

inline constexpr std::array<TransformModel, 4> transform_models{TransformModel::similarity, TransformModel::radial,
                                                                TransformModel::quadratic, TransformModel::cubic};
constexpr int parameters_of(TransformModel model) {
  constexpr std::array<int, 4> counts{4, 5, 12, 20};
  return counts[static_cast<std::size_t>(model)];
}
const char* name_of(TransformModel model);

/// Translation, rotation and scale: (x, y) -> (a x - b y + dx, b x + a y + dy).
struct Similarity {
  double a = 1;
  double b = 0;
  double dx = 0;
  double dy = 0;

  Point at(const Point& p) const { return {a * p.x - b * p.y + dx, b * p.x + a * p.y + dy}; }
};

/// Maps places of a reference frame to another frame, with the covariance of its parameters.
/// Coordinates u are (x - centre) / unit. The radial model is, with S the similarity and d(u) = |u|^2 u,
///     u' = S(u) + k (d(S(u)) - M d(u)),  M the linear part of S:
/// a frame distorted by k, undistorted, moved by S, and distorted again, to first order in k.
struct StarTransform {
  TransformModel model = TransformModel::similarity;
  Point centre;  // centre of both frames
  double unit_px = 1;
  std::vector<double> coefficients;  // in the unit
  std::vector<double> covariance;    // row after row

  Point at(const Point& reference) const;
  /// Returns the standard error of at() for one axis, the mean of both axes.
  double standard_error_px(const Point& reference) const;
};

/// A star of the reference and the same star in another frame.
struct StarPair {
  Point reference;
  Point frame;
  double variance_px2 = 1;  // variance of the difference, for one axis
};

/// A model fitted to pairs.
struct TransformFit {
  StarTransform transform;
  double chi_square = 0;
};

/// Fits a model by weighted least squares; nullopt if the pairs do not determine it.
std::optional<TransformFit> fit_transform(TransformModel model, const std::vector<StarPair>& pairs, const Point& centre,
                                          double unit_px);

/// Returns the similarity that fits pairs best, without regard of their variances; nullopt if all references coincide.
std::optional<Similarity> fit_similarity(const std::vector<StarPair>& pairs);

/// Returns the motion of a frame of width x height pixels. Its standard error is the root of the mean square of those
/// of the nodes whose content lies within the other frame (of all nodes, if there are none).
Motion motion_of(const StarTransform& transform, int width, int height, int spacing_px = 32);

}  // namespace lowlux::merge
