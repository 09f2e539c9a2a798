#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "calib/chart/chart_detector.h"
#include "isp/base/image.h"
#include "isp/base/matrix3.h"

namespace lowlux::calib {

inline constexpr int chart_columns = 6;
inline constexpr int chart_rows = 4;
inline constexpr int chart_patch_count = chart_columns * chart_rows;

/// Orientation of a grid on a chart: which of the grid's corners the chart's first patch is at. The last two are mirror
/// images.
enum class ChartTurn : std::uint8_t { as_is, half_turn, mirrored_columns, mirrored_rows };
inline constexpr std::array all_chart_turns{ChartTurn::as_is, ChartTurn::half_turn, ChartTurn::mirrored_columns,
                                            ChartTurn::mirrored_rows};

/// A grid of 6 x 4 cells in an image: cell (i, j) spans i..i+1, j..j+1 in the plane that the homography maps to the
/// image; a patch fills the middle of its cell.
struct ChartGrid {
  Matrix3 to_picture = identity3();
  ChartTurn turn = ChartTurn::as_is;

  /// Returns the image point of a point in the chart's plane, with the chart's orientation: u 0..6 and v 0..4 from the
  /// corner of the chart's first patch.
  PicturePoint at(double u, double v) const;
};

/// Returns the grid whose cells' outer corners (0, 0), (6, 0), (6, 4), (0, 4) lie at four points. nullopt if three of
/// them are on one line, or the quadrilateral is not convex, or a number is not finite.
std::optional<ChartGrid> grid_of(const std::array<PicturePoint, 4>& corners);

/// Returns a grid in an image with transformed coordinates: x * scale + offset, for both axes.
ChartGrid rescaled(const ChartGrid& grid, double scale, double offset);

/// Returns the grid near `start` whose cells are the most uniform inside: minimises the sum over cells of the relative
/// standard deviation in the middle 76 % of their width. Patches fill more: 85 % on a ColorChecker Passport, 91 % in
/// the model of OpenCV's detector. It is a pattern search over the four corners and the grid's position and size, down
/// to an eightieth of a cell; grids within 0.05 cells are equally good by this measure. nullopt if the grid leaves the
/// image.
std::optional<ChartGrid> refined(const ChartGrid& start, RgbView<const float> picture);

}  // namespace lowlux::calib
