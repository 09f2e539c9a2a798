#include "capture/synthetic/exposed_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_response.h"
#include "tests/support/synthetic_camera.h"

namespace lowlux::capture {
namespace {

const SpectralResponse& response() {
  static const SpectralResponse one = test::response_of(test::plain_sensor());
  return one;
}

const isp::LiftTable& table() {
  static const isp::LiftTable one(response());
  return one;
}

double total(const Plane<float>& plane) {
  double sum = 0;
  for (std::size_t i = 0; i < plane.size(); ++i) sum += plane.data()[i];
  return sum;
}

Scene with_point(int width, int height, double x_px, double y_px, double spread_px = 0.7) {
  Scene scene = *dark_scene(test::setup_of(width, height, 1));
  EXPECT_TRUE(add_lamp(scene, x_px, y_px, *isp::light_named("D65"), 3));
  scene.points.back().spread_px = spread_px;
  return scene;
}

TEST(ExposedScene, APatchGivesTheIntegralOfItsSpectrumUnderEachFilterInEveryPhase) {
  InlineExecutor executor;
  const auto chips = isp::spectra_of(isp::SpectrumSet::munsell_ten);
  const Scene scene = *chart_scene(test::setup_of(61, 33, 10), chips);
  for (const BayerPhase phase : {BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr}) {
    const ChargeRate rate = charge_rate(scene, response(), nullptr, phase, executor);
    EXPECT_EQ(rate.moved_pixels, 0);
    for (int y = 0; y < 33; ++y) {
      for (int x = 0; x < 61; ++x) {
        const Vector3 expected = isp::electron_rate(response(), scene.radiances[scene.patch.at(x, y)]);
        ASSERT_EQ(rate.e_per_s.at(x, y), static_cast<float>(expected[static_cast<int>(colour_at(phase, x, y))]));
      }
    }
  }
}

TEST(ExposedScene, TheMosaicIsTheTruthSeenThroughTheFilters) {
  PoolExecutor executor(3);
  Scene scene = *picture_scene(test::even_picture(33, 17, {0.3, 0.25, 0.4}), 5);
  ASSERT_TRUE(add_lamp(scene, 4.3, 7.9, *isp::light_named("A"), 30));
  const CameraRgb truth = charge_rate_rgb(scene, response(), &table(), executor);
  const ChargeRate rate = charge_rate(scene, response(), &table(), BayerPhase::grbg, executor);
  for (int y = 0; y < 17; ++y) {
    for (int x = 0; x < 33; ++x) {
      ASSERT_EQ(rate.e_per_s.at(x, y), truth.plane[static_cast<int>(colour_at(BayerPhase::grbg, x, y))].at(x, y));
    }
  }
}

TEST(ExposedScene, AStarKeepsAllItsLightAwayFromTheBorders) {
  InlineExecutor executor;
  const Vector3 expected = isp::electron_rate(response(), *isp::radiance_of(*isp::light_named("D65"), 3));
  for (const double spread_px : {0.05, 0.3, 0.7, 2.5}) {
    for (const double x_px : {40.0, 40.25, 40.5, 39.999}) {
      const Scene scene = with_point(81, 81, x_px, 41.3, spread_px);
      const CameraRgb truth = charge_rate_rgb(scene, response(), &table(), executor);
      SceneLinear xyz(81, 81);
      for (Plane<float>& plane : xyz.plane) std::fill_n(plane.data(), plane.size(), 0.0f);
      add_points(scene.points, scene.point_lights, xyz);
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(total(truth.plane[k]) / expected[k], 1, 1e-6) << "float sums";
      EXPECT_NEAR(total(xyz.plane[1]), 3, 3e-6);
    }
  }
}

TEST(ExposedScene, AStarHasTheCentroidAndTheSpreadItIsGiven) {
  InlineExecutor executor;
  const double x_px = 20.3, y_px = 17.8, spread_px = 1.5;
  const CameraRgb truth = charge_rate_rgb(with_point(41, 41, x_px, y_px, spread_px), response(), &table(), executor);
  double sum = 0, mx = 0, my = 0, xx = 0;
  for (int y = 0; y < 41; ++y) {
    for (int x = 0; x < 41; ++x) {
      const double v = truth.plane[1].at(x, y);
      sum += v, mx += v * x, my += v * y, xx += v * (x - x_px) * (x - x_px);
    }
  }
  // 1e-6 px: float planes, and aliasing of order exp(-2 pi^2 spread^2) below it. Pixels are boxes: 1/12 more.
  EXPECT_NEAR(mx / sum, x_px, 1e-5);
  EXPECT_NEAR(my / sum, y_px, 1e-5);
  EXPECT_NEAR(xx / sum, spread_px * spread_px + 1.0 / 12, 1e-5);
}

TEST(ExposedScene, AStarAtABorderLosesWhatFallsBeside) {
  InlineExecutor executor;
  const Vector3 whole = isp::electron_rate(response(), *isp::radiance_of(*isp::light_named("D65"), 3));
  // Centred on the outer edge of column 0, half the light is outside; in a corner, three quarters.
  const auto share = [&](double x_px, double y_px) {
    return total(charge_rate_rgb(with_point(41, 41, x_px, y_px), response(), &table(), executor).plane[0]) / whole[0];
  };
  EXPECT_NEAR(share(-0.5, 20), 0.5, 1e-6);
  EXPECT_NEAR(share(40.5, 20), 0.5, 1e-6);
  EXPECT_NEAR(share(20, -0.5), 0.5, 1e-6);
  EXPECT_NEAR(share(-0.5, 40.5), 0.25, 1e-6);
  EXPECT_EQ(share(-50, 20), 0);
  const double erf_fraction = 0.5 * (1 + std::erf(0.5 / (0.7 * std::numbers::sqrt2)));
  EXPECT_NEAR(share(0, 20), erf_fraction, 1e-6);
}

TEST(ExposedScene, AStarOnASinglePixelGivesItsShareOfTheGaussian) {
  InlineExecutor executor;
  const double one = std::erf(0.5 / (0.7 * std::numbers::sqrt2));
  const double expected = isp::electron_rate(response(), *isp::radiance_of(*isp::light_named("D65"), 3))[0] * one * one;
  const ChargeRate rate = charge_rate(with_point(1, 1, 0, 0), response(), &table(), BayerPhase::rggb, executor);
  EXPECT_NEAR(rate.e_per_s.at(0, 0) / expected, 1, 1e-6);
}

TEST(ExposedScene, StarsAddToTheLightThatIsThere) {
  InlineExecutor executor;
  Scene scene = *flat_scene(test::setup_of(9, 9, 1));
  const Plane<float> before = charge_rate(scene, response(), nullptr, BayerPhase::rggb, executor).e_per_s;
  ASSERT_TRUE(add_lamp(scene, 4, 4, *isp::light_named("D65"), 3));
  const Plane<float> after = charge_rate(scene, response(), nullptr, BayerPhase::rggb, executor).e_per_s;
  EXPECT_GT(after.at(4, 4), before.at(4, 4));
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_GE(after.data()[i], before.data()[i]);
}

TEST(ExposedScene, ColoursNoLightCanHaveAreMovedAndCounted) {
  InlineExecutor executor;
  SceneLinear xyz = test::even_picture(10, 6, {0.9505, 1, 1.089});
  for (const auto& [x, y] : {std::pair{0, 0}, {9, 5}, {3, 2}}) {
    xyz.plane[0].at(x, y) = 1, xyz.plane[1].at(x, y) = 0.001f, xyz.plane[2].at(x, y) = 0.001f;
  }
  for (int c = 0; c < 3; ++c) xyz.plane[c].at(5, 5) = 0;  // black has no colour, and is not moved
  const Scene scene = *picture_scene(std::move(xyz), 2);
  for (const int threads : {1, 3, 7}) {
    PoolExecutor pool(threads);
    const ChargeRate rate = charge_rate(scene, response(), &table(), BayerPhase::rggb, pool);
    EXPECT_EQ(rate.moved_pixels, 3) << threads;
    EXPECT_EQ(rate.e_per_s.at(5, 5), 0);
    EXPECT_GT(rate.e_per_s.at(3, 2), 0);
    EXPECT_TRUE(std::isfinite(rate.e_per_s.at(0, 0)));
  }
}

TEST(ExposedScene, ALiftedColourGivesWhatItsSpectrumGives) {
  InlineExecutor executor;
  for (const Vector3& xyz : {Vector3{0.9505, 1, 1.089}, {0.3, 0.25, 0.4}, {0.02, 0.03, 0.01}}) {
    const Scene scene = *picture_scene(test::even_picture(2, 2, xyz), 1);
    const Vector3 expected = isp::electron_rate(response(), *isp::lift(isp::xyz_of(xyz)));
    const CameraRgb truth = charge_rate_rgb(scene, response(), &table(), executor);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(truth.plane[k].at(1, 1) / expected[k], 1, 0.005) << "the lift's table";
  }
}

}  // namespace
}  // namespace lowlux::capture
