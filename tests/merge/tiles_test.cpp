#include "isp/merge/align/tiles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "isp/merge/align/global_fit.h"

namespace lowlux::merge {
namespace {

/// Means over a standard normal variable r, with the weight q = 1 / (1 + r^2 / student), by the trapezoidal rule.
struct NormalMeans {
  double q = 0, r2q = 0, r2q2 = 0, r4q2 = 0;
};

NormalMeans normal_means() {
  NormalMeans out;
  constexpr double step = 1e-3;
  for (int i = -12000; i <= 12000; ++i) {
    const double r = step * i, w = step * std::exp(-r * r / 2) / std::sqrt(2 * std::numbers::pi);
    const double q = 1 / (1 + r * r / static_cast<double>(rows::student));
    out.q += w * q;
    out.r2q += w * r * r * q;
    out.r2q2 += w * r * r * q * q;
    out.r4q2 += w * r * r * r * r * q * q;
  }
  return out;
}

std::array<float, rows::sums> tile_of(double n, double square) {
  std::array<float, rows::sums> tile{};
  tile[rows::gradient_xx] = tile[rows::gradient_yy] = 100;
  tile[rows::slope_xx] = tile[rows::slope_yy] = 100;
  tile[rows::count] = static_cast<float>(n);
  tile[rows::square] = static_cast<float>(square);
  return tile;
}

TEST(Tiles, WeightsOfStudentsTAreAccountedFor) {
  const NormalMeans m = normal_means();
  const double own = 0.02 * 0.02;  // cells^2, the error that a tile has without noise
  const TileFit fit = fit_of(tile_of(64, 64 * m.r2q), 1);
  const double k = 100 * m.r2q / m.q;
  EXPECT_NEAR(fit.information[0], k, 1e-4 * k);  // 5 decimals of the constants
  EXPECT_NEAR(fit.variance[0], 100 * m.r2q2 / m.q + own * k * k, 1e-3);
  // Differences within 2 standard deviations of what noise explains change nothing; larger ones lower the information.
  const double sigma = std::sqrt((m.r4q2 / (m.r2q * m.r2q) - 1) / 64);
  EXPECT_EQ(fit_of(tile_of(64, 64 * m.r2q * (1 + 1.9 * sigma)), 1).information[0], fit.information[0]);
  EXPECT_LT(fit_of(tile_of(64, 64 * m.r2q * (1 + 2.2 * sigma)), 1).information[0], fit.information[0]);
}

TEST(Tiles, TilesOfFewCellsStateNothing) {
  const TileFit fit = fit_of(tile_of(15, 15), 2);
  EXPECT_EQ(fit.information[0], 0);
  EXPECT_EQ(chi_square_of(fit, fit.score), 0);
}

TEST(Tiles, ChiSquareIsThatOfTheInverseCovariance) {
  const TileFit fit{.score = {3, -1}, .information = {1, 0, 1}, .variance = {4, 1, 2}};
  // (3, -1) times the inverse of {{4, 1}, {1, 2}}, {{2, -1}, {-1, 4}} / 7: (2 * 9 + 2 * 3 + 4) / 7.
  EXPECT_NEAR(chi_square_of(fit, fit.score), 28.0 / 7, 1e-7);
  EXPECT_EQ(residual_of(fit, 3, -1), (std::array<double, 2>{0, 0}));
}

TEST(Tiles, NodesReachTheFarEdgesOfFramesOfAllSizes) {
  for (const int width : {8, 9, 31, 64, 65, 500}) {
    for (const int cell_px : {2, 4, 8}) {
      const LumaLevel level(width, 12, cell_px);
      const TileGrid grid = tile_grid(level, 32);
      EXPECT_GE((grid.columns - 1) * grid.cells, width);
      EXPECT_GE(grid.rows, 2);
      EXPECT_EQ(grid.spacing_px() % 16, 0);
    }
  }
}

}  // namespace
}  // namespace lowlux::merge
