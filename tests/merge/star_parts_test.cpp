#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "isp/merge/inverse_motion.h"
#include "isp/merge/stars/background.h"
#include "isp/merge/stars/normal_equations.h"
#include "isp/merge/stars/point_grid.h"
#include "isp/merge/stars/psf_fit.h"
#include "isp/merge/stars/triangles.h"
#include "tests/merge/star_motion.h"

namespace lowlux::merge {
namespace {

using namespace star_testing;

TEST(PointGrid, FindsWhatASearchOfAllPointsFinds) {
  Draw draw(1);
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<Point> points(static_cast<std::size_t>(trial));
    const double side = std::pow(10, draw.uniform(0, 4));
    for (Point& p : points) p = {draw.uniform(-side, side), draw.uniform(0, side)};
    const PointGrid grid(points, draw.uniform(0.1, 0.3) * side);
    for (int k = 0; k < 50; ++k) {
      const Point place{draw.uniform(-2, 2) * side, draw.uniform(-1, 2) * side};
      const double radius = draw.uniform(0, 1) * side;
      int count = 0, best = -1;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double distance = std::hypot(points[i].x - place.x, points[i].y - place.y);
        if (distance > radius) continue;
        ++count;
        const auto& b = points[static_cast<std::size_t>(std::max(best, 0))];
        if (best < 0 || distance < std::hypot(b.x - place.x, b.y - place.y)) best = static_cast<int>(i);
      }
      EXPECT_EQ(grid.count(place, radius), count);
      EXPECT_EQ(grid.nearest(place, radius), best);
    }
  }
}

TEST(Triangles, EveryTriangleOfAMovedListIsFound) {
  Draw draw(9);
  for (int trial = 0; trial < 50; ++trial) {
    const TrueMotion motion = drawn_motion(4000, 3000, 0, draw);
    std::vector<Point> first, second;
    for (int k = 0; k < 3 + trial % 12; ++k) {
      first.push_back({draw.uniform(0, 4000), draw.uniform(0, 3000)});
      second.push_back(motion.moved(first.back()));
    }
    int same = 0, all = 0;
    for (const TrianglePair& pair : matching_triangles(first, second, {})) same += pair.first == pair.second ? 1 : 0;
    for (const TrianglePair& pair : matching_triangles(first, first, {.tolerance = 0, .place_error_px = 0}))
      all += pair.first == pair.second ? 1 : 0;
    EXPECT_GE(same, all) << trial;
    EXPECT_GT(all + (first.size() == 3 ? 1 : 0), 0) << trial;  // a single triangle may be too flat
  }
}

TEST(NormalEquations, SolutionHasTheCovarianceStated) {
  constexpr int unknowns = 5, rows = 40;
  Draw draw(2);
  const std::vector<double> truth{1, -2, 3, 0.5, 10};
  double squares = 0;
  constexpr int trials = 2000;
  for (int trial = 0; trial < trials; ++trial) {
    NormalEquations equations(unknowns);
    for (int k = 0; k < rows; ++k) {
      std::vector<double> row;
      double value = 0;
      for (int i = 0; i < unknowns; ++i) {
        row.push_back(std::pow(k / 20.0 - 1, i));
        value += row.back() * truth[static_cast<std::size_t>(i)];
      }
      const double error = 0.5 + k % 3;
      equations.add(row, value + error * draw.normal(), 1 / (error * error));
    }
    const std::optional<LeastSquares> solution = equations.solve();
    ASSERT_TRUE(solution);
    squares += std::pow(solution->coefficients[2] - truth[2], 2) / solution->covariance[2 * unknowns + 2];
  }
  EXPECT_NEAR(squares / trials, 1, 5 * std::sqrt(2.0 / trials));
  NormalEquations singular(2);
  const std::vector<double> row{1, 2};
  for (int k = 0; k < 5; ++k) singular.add(row, 3, 1);
  EXPECT_FALSE(singular.solve());
}

TEST(InverseMotion, UndoesTheMotionAtItsNodes) {
  Draw draw(3);
  for (int trial = 0; trial < 50; ++trial) {
    const int width = 40 + static_cast<int>(draw.uniform(0, 900)), height = 40 + static_cast<int>(draw.uniform(0, 900));
    const TrueMotion truth = drawn_motion(width, height, 2, draw);
    Motion motion = no_motion(width, height);
    for (int j = 0; j < motion.dx_px.height(); ++j) {
      for (int i = 0; i < motion.dx_px.width(); ++i) {
        const Point node{32.0 * i, 32.0 * j}, to = truth.distorted(truth.moved(node));
        motion.dx_px.at(i, j) = static_cast<float>(to.x - node.x);
        motion.dy_px.at(i, j) = static_cast<float>(to.y - node.y);
      }
    }
    const InverseMotion inverse = inverse_of(motion, width, height);
    ASSERT_GE(inverse.columns * InverseMotion::cell_px, width);
    ASSERT_GE(inverse.rows * InverseMotion::cell_px, height);
    for (int j = 0; j <= inverse.rows; ++j) {
      for (int i = 0; i <= inverse.columns; ++i) {
        const Point p = inverse.node(i, j);
        if (!truth.in_view(p)) continue;
        const Shift shift = motion.at(static_cast<float>(p.x), static_cast<float>(p.y));
        EXPECT_NEAR(p.x + static_cast<double>(shift.dx_px), 32.0 * i, 1e-3) << trial;
        EXPECT_NEAR(p.y + static_cast<double>(shift.dy_px), 32.0 * j, 1e-3) << trial;
      }
    }
  }
}

TEST(InverseMotion, AreaIsThatOfTheScale) {
  for (const double scale : {0.98, 1.0, 1.02}) {
    for (const double degrees : {0.0, 0.3, 45.0, 180.0}) {
      const Motion motion = motion_of(rotation(4000, 3000, degrees, 1000, -900, scale), 4000, 3000);
      const InverseMotion inverse = inverse_of(motion, 4000, 3000);
      for (int k = 0; k < inverse.columns * inverse.rows; ++k) {
        const Point p = inverse.node(k % inverse.columns, k / inverse.columns);
        if (p.x < 300 || p.y < 300 || p.x > 3700 || p.y > 2700) continue;  // beyond, motions are extrapolated
        EXPECT_NEAR(inverse.area[static_cast<std::size_t>(k)], 1 / (scale * scale), 5e-6);  // displacements are floats
      }
    }
  }
}

TEST(Background, IsUnbiasedAtAnyLightAndUnderStars) {
  for (const double sky : {0.02, 0.5, 40.0, 3000.0}) {
    for (const bool with_stars : {false, true}) {
      const StarCamera camera{.width = 1024, .height = 1024, .sky_e = {0.5 * sky, sky, 0.7 * sky}, .read_noise_e = 1};
      Draw draw(5);
      const std::vector<TrueStar> stars = drawn_stars(camera, with_stars ? 100 : 0, 100 * std::sqrt(sky + 1), draw);
      const Plane<float> frame = exposed(camera, stars, 6);
      InlineExecutor one;
      const std::optional<Background> background = measure_background(view_of(camera, frame), 1.2, one);
      ASSERT_TRUE(background);
      for (std::size_t s = 0; s < 4; ++s) {
        const double truth = camera.sky_e[static_cast<std::size_t>(
            colour_at(camera.phase, static_cast<int>(s % 2), static_cast<int>(s / 2)))];
        double sum = 0;
        for (const PerSite<float>& level : background->level_e) sum += static_cast<double>(level[s]);
        const double error = std::sqrt((truth + 1) / (1024 * 1024 / 4.0));  // standard error of the mean of all
        const double std_of_site = std::sqrt(truth + 1);
        EXPECT_NEAR(sum / static_cast<double>(background->level_e.size()), truth,
                    5 * error + (with_stars ? 0.02 : 0.002) * std_of_site)
            << sky << " e-, site " << s;
      }
      for (const PerSite<float>& per_std : background->per_std)
        EXPECT_GT(static_cast<double>(per_std[1]) * std::sqrt(sky + 1), 0.8);
    }
  }
}

TEST(PsfFit, IsExactWithoutNoise) {
  Draw draw(6);
  for (int trial = 0; trial < 200; ++trial) {
    const StarCamera camera{.width = 31,
                            .height = 33,
                            .phase = static_cast<BayerPhase>(trial % 4),
                            .sigma_px = draw.uniform(0.6, 2),
                            .read_noise_e = 1};
    const TrueStar star{15 + draw.uniform(-0.5, 0.5), 16 + draw.uniform(-0.5, 0.5), {3e6, 1e6, 5e5}};
    Plane<float> frame = sky_of(camera);
    add_stars(camera, {star}, frame);
    const std::optional<PsfFit> fit =
        fit_psf(view_of(camera, frame), {.x_px = 15,
                                         .y_px = 16,
                                         .sigma_px = camera.sigma_px * draw.uniform(0.8, 1.25),
                                         .background_e = {30, 60, 60, 40}});
    ASSERT_TRUE(fit) << trial << ", sigma " << camera.sigma_px;
    EXPECT_NEAR(fit->x_px, star.x, 1e-4) << trial;
    EXPECT_NEAR(fit->y_px, star.y, 1e-4) << trial;
    EXPECT_NEAR(fit->sigma_px, camera.sigma_px, 1e-4) << trial;
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(fit->flux_e[c], star.flux_e[c], 1e-3 * star.flux_e[c]) << trial;
  }
}

}  // namespace
}  // namespace lowlux::merge
