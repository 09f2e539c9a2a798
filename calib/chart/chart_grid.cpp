#include "calib/chart/chart_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Dense>

namespace lowlux::calib {
namespace {

using Corners = std::array<PicturePoint, 4>;

constexpr Corners plane_corners{{{0, 0}, {chart_columns, 0}, {chart_columns, chart_rows}, {0, chart_rows}}};

PicturePoint project(const Matrix3& h, double u, double v) {
  const Vector3 p = h * Vector3{u, v, 1};
  return {p[0] / p[2], p[1] / p[2]};
}

bool convex(const Corners& c) {
  int left = 0, right = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const PicturePoint &a = c[i], &b = c[(i + 1) % 4], &d = c[(i + 2) % 4];
    const double cross = (b.x - a.x) * (d.y - b.y) - (b.y - a.y) * (d.x - b.x);
    const double size = std::hypot(b.x - a.x, b.y - a.y) * std::hypot(d.x - b.x, d.y - b.y);
    if (cross > 1e-3 * size) ++left;
    if (cross < -1e-3 * size) ++right;
  }
  return left == 4 || right == 4;
}

/// Returns the linear interpolation between the four pixels around a point; nullopt outside the image.
std::optional<Vector3> sample(RgbView<const float> picture, const PicturePoint& p) {
  if (!(p.x >= 0 && p.y >= 0 && p.x < picture[0].width - 1 && p.y < picture[0].height - 1)) return std::nullopt;
  const int x = static_cast<int>(p.x), y = static_cast<int>(p.y);
  const double fx = p.x - x, fy = p.y - y;
  Vector3 out{};
  for (std::size_t c = 0; c < 3; ++c) {
    const float *upper = picture[c].row(y) + x, *lower = picture[c].row(y + 1) + x;
    out[c] = (1 - fy) * ((1 - fx) * upper[0] + fx * upper[1]) + fy * ((1 - fx) * lower[0] + fx * lower[1]);
  }
  return out;
}

constexpr int samples_across = 9;
constexpr double middle = 0.76;          // of a cell's width
constexpr double black_fraction = 0.02;  // of the brightest patch, added to means: noise in black does not count

struct CellSpread {
  Vector3 mean{};
  Vector3 standard_deviation{};
};

std::optional<CellSpread> spread_of(const Matrix3& h, int column, int row, RgbView<const float> picture) {
  Vector3 sum{}, squares{};
  for (int j = 0; j < samples_across; ++j) {
    for (int i = 0; i < samples_across; ++i) {
      const double u = column + 0.5 + middle * (static_cast<double>(i) / (samples_across - 1) - 0.5);
      const double v = row + 0.5 + middle * (static_cast<double>(j) / (samples_across - 1) - 0.5);
      const auto rgb = sample(picture, project(h, u, v));
      if (!rgb) return std::nullopt;
      for (std::size_t c = 0; c < 3; ++c) {
        sum[c] += (*rgb)[c];
        squares[c] += (*rgb)[c] * (*rgb)[c];
      }
    }
  }
  constexpr double n = samples_across * samples_across;
  CellSpread out;
  for (std::size_t c = 0; c < 3; ++c) {
    out.mean[c] = sum[c] / n;
    out.standard_deviation[c] = std::sqrt(std::max(0.0, squares[c] / n - out.mean[c] * out.mean[c]));
  }
  return out;
}

/// Returns the non-uniformity of the cells; infinite for an invalid grid or one that leaves the image.
double unevenness(const Corners& corners, RgbView<const float> picture) {
  constexpr double none = HUGE_VAL;
  const auto grid = grid_of(corners);
  if (!grid) return none;
  std::array<CellSpread, chart_patch_count> cell;
  Vector3 brightest{};
  for (int i = 0; i < chart_patch_count; ++i) {
    const auto spread = spread_of(grid->to_picture, i % chart_columns, i / chart_columns, picture);
    if (!spread) return none;
    cell[static_cast<std::size_t>(i)] = *spread;
    for (std::size_t c = 0; c < 3; ++c) brightest[c] = std::max(brightest[c], spread->mean[c]);
  }
  double sum = 0;
  for (const CellSpread& spread : cell) {
    for (std::size_t c = 0; c < 3; ++c) {
      sum += spread.standard_deviation[c] / (std::fabs(spread.mean[c]) + black_fraction * brightest[c]);
    }
  }
  return sum;
}

constexpr int move_count = 12;

/// Applies move number 0..7, which shifts one coordinate of a corner, 8 and 9 the grid, or 10 and 11, which stretch it
/// about its middle.
Corners moved(const Corners& corners, int move, double by_px) {
  Corners out = corners;
  if (move < 8) {
    PicturePoint& p = out[static_cast<std::size_t>(move / 2)];
    (move % 2 == 0 ? p.x : p.y) += by_px;
    return out;
  }
  for (std::size_t i = 0; i < 4; ++i) {
    // The direction is that of its neighbour across the stretched side.
    const PicturePoint &p = corners[i], &q = corners[move == 10 ? i ^ 1U : 3 - i];
    const double length = std::hypot(p.x - q.x, p.y - q.y);
    if (move == 8) out[i].x += by_px;
    if (move == 9) out[i].y += by_px;
    if (move >= 10) out[i] = {p.x + by_px * (p.x - q.x) / length, p.y + by_px * (p.y - q.y) / length};
  }
  return out;
}

}  // namespace

PicturePoint ChartGrid::at(double u, double v) const {
  const bool turn_columns = turn == ChartTurn::half_turn || turn == ChartTurn::mirrored_columns;
  const bool turn_rows = turn == ChartTurn::half_turn || turn == ChartTurn::mirrored_rows;
  return project(to_picture, turn_columns ? chart_columns - u : u, turn_rows ? chart_rows - v : v);
}

std::optional<ChartGrid> grid_of(const std::array<PicturePoint, 4>& corners) {
  for (const PicturePoint& p : corners) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) return std::nullopt;
  }
  if (!convex(corners)) return std::nullopt;
  Eigen::Matrix<double, 8, 8> equations;
  Eigen::Matrix<double, 8, 1> right;
  for (int i = 0; i < 4; ++i) {
    const auto [u, v] = plane_corners[static_cast<std::size_t>(i)];
    const auto [x, y] = corners[static_cast<std::size_t>(i)];
    equations.row(2 * i) << u, v, 1, 0, 0, 0, -u * x, -v * x;
    equations.row(2 * i + 1) << 0, 0, 0, u, v, 1, -u * y, -v * y;
    right[2 * i] = x;
    right[2 * i + 1] = y;
  }
  const Eigen::Matrix<double, 8, 1> h = equations.partialPivLu().solve(right);
  if (!h.allFinite()) return std::nullopt;
  return ChartGrid{{{{h[0], h[1], h[2]}, {h[3], h[4], h[5]}, {h[6], h[7], 1}}}};
}

ChartGrid rescaled(const ChartGrid& grid, double scale, double offset) {
  return {Matrix3{{{scale, 0, offset}, {0, scale, offset}, {0, 0, 1}}} * grid.to_picture, grid.turn};
}

std::optional<ChartGrid> refined(const ChartGrid& start, RgbView<const float> picture) {
  Corners corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = project(start.to_picture, plane_corners[i].x, plane_corners[i].y);
  double best = unevenness(corners, picture);
  if (!std::isfinite(best)) return std::nullopt;
  const double cell_px = std::hypot(corners[1].x - corners[0].x, corners[1].y - corners[0].y) / chart_columns;
  constexpr std::array steps_cells{0.2, 0.1, 0.05, 0.025, 0.0125};
  constexpr int max_rounds = 20;  // largest number of rounds of one step size
  for (const double step : steps_cells) {
    bool better = true;
    for (int round = 0; better && round < max_rounds; ++round) {
      better = false;
      for (int move = 0; move < 2 * move_count; ++move) {
        const Corners tried = moved(corners, move / 2, move % 2 == 0 ? step * cell_px : -step * cell_px);
        const double value = unevenness(tried, picture);
        if (!(value < best)) continue;
        best = value;
        corners = tried;
        better = true;
      }
    }
  }
  auto out = grid_of(corners);
  if (out) out->turn = start.turn;
  return out;
}

}  // namespace lowlux::calib
