#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "isp/merge/stars/match_stars.h"
#include "tests/merge/drizzle_frames.h"
#include "tests/merge/star_grid.h"

/// Flux, widths and noise of drizzled images against closed forms.
namespace lowlux::merge {
namespace {

using namespace star_testing;

/// Moments of a star in an image of measured colour, about its centroid: in pixels of the reference.
struct Moments {
  double flux = 0, x = 0, y = 0, width2 = 0;
};
Moments moments_of(const DrizzleImage& image, int colour, double cx, double cy, double scale, double sky) {
  Moments out;
  double xx = 0;
  const double radius = 9;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double px = (x + 0.5) / scale - 0.5 - cx, py = (y + 0.5) / scale - 0.5 - cy;
      if (std::fabs(px) > radius || std::fabs(py) > radius) continue;
      const double e = (static_cast<double>(image.value_e(colour).at(x, y)) - sky) / (scale * scale);
      out.flux += e;
      out.x += e * px;
      out.y += e * py;
      xx += e * (px * px + py * py) / 2;
    }
  }
  out.x /= out.flux;
  out.y /= out.flux;
  out.width2 = xx / out.flux - (out.x * out.x + out.y * out.y) / 2;
  return out;
}

TEST(Drizzle, StarsKeepTheirFluxAndPlaceAndGrowAsStated) {
  const StarCamera camera{.width = 60, .height = 50, .sigma_px = 1.1, .sky_e = {10, 10, 10}};
  const std::vector<TrueStar> stars{{29.3, 24.6, {20000, 30000, 10000}}};
  InlineExecutor one;
  for (const DrizzleOptions options : {DrizzleOptions{1, 1}, {1, 0.6}, {2, 0.6}, {2, 1}, {3, 0.5}}) {
    for (const double degrees : {0.0, 30.0}) {
      Drizzle drizzle(camera.width, camera.height, options);
      Draw draw(6);
      for (int j = 0; j < 24; ++j) {  // places that cover the cell evenly: 24 x 24
        for (int i = 0; i < 24; ++i) {
          const merge::StarTransform transform = rotation(camera.width, camera.height, j % 2 == 0 ? degrees : 0,
                                                          (i + draw.uniform()) / 12.0, (j + draw.uniform()) / 12.0);
          const Point p = transform.at({stars[0].x, stars[0].y});
          Plane<float> frame = sky_of(camera);
          add_stars(camera, {{p.x, p.y, stars[0].flux_e}}, frame);
          drizzle.add({.frame = view_of(camera, frame), .motion = motion_of(transform, camera.width, camera.height)},
                      one);
        }
      }
      const DrizzleImage image = drizzle.finish(one);
      // Integrated over the pixel of the sensor, the drop and the output pixel: a twelfth of the square of each side.
      const double expected =
          1.1 * 1.1 + 1.0 / 12 + options.pixfrac * options.pixfrac / 12 + 1 / (12 * options.scale * options.scale);
      for (int c = 0; c < 3; ++c) {
        const Moments got = moments_of(image, c, stars[0].x, stars[0].y, options.scale, 10);
        const double flux = stars[0].flux_e[static_cast<std::size_t>(c)];
        EXPECT_NEAR(got.flux, flux, 0.01 * flux) << options.scale << " " << options.pixfrac << " colour " << c;
        EXPECT_NEAR(got.x, 0, 0.01) << options.scale << " " << options.pixfrac;
        EXPECT_NEAR(got.y, 0, 0.01) << options.scale << " " << options.pixfrac;
        EXPECT_NEAR(got.width2, expected, 0.02 * expected) << options.scale << " " << options.pixfrac;
      }
    }
  }
}

TEST(Drizzle, VarianceIsThatOfTheNoiseAndItsCorrelationAsStated) {
  const StarCamera camera{.width = 400, .height = 360, .sky_e = {20, 40, 30}, .read_noise_e = 2};
  InlineExecutor one;
  for (const DrizzleOptions options : {DrizzleOptions{1, 1}, {1, 0.6}, {2, 0.7}}) {
    Drizzle drizzle(camera.width, camera.height, options);
    Draw draw(7);
    for (std::uint64_t k = 0; k < 40; ++k) {
      const Plane<float> frame = exposed(camera, {}, 10 + k);
      const Motion motion =
          moved(camera.width, camera.height, draw.uniform(-2, 2), draw.uniform(-4, 4), draw.uniform(-4, 4));
      drizzle.add({.frame = view_of(camera, frame), .motion = motion, .level_e = {20, 40, 40, 30}}, one);
    }
    const DrizzleImage image = drizzle.finish(one);
    for (int c = 0; c < 3; ++c) {
      EXPECT_LT(image.empty_fraction[static_cast<std::size_t>(c)], 1e-3);
      const double sky = camera.sky_e[static_cast<std::size_t>(c)];
      double single = 0, count = 0, blocks = 0, block_count = 0;
      constexpr int block = 20;
      const int margin = static_cast<int>(20 * options.scale);
      for (int y = margin; y + block < image.height - margin; y += block) {
        for (int x = margin; x + block < image.width - margin; x += block) {
          double sum = 0, variance = 0;
          for (int k = 0; k < block * block; ++k) {
            const double stated = static_cast<double>(image.variance_e2(c).at(x + k % block, y + k / block));
            if (stated == 0) continue;  // without data
            const double error = static_cast<double>(image.value_e(c).at(x + k % block, y + k / block)) - sky;
            single += error * error / stated;
            count += 1;
            sum += error;
            variance += stated;
          }
          blocks += sum * sum / variance;
          block_count += 1;
        }
      }
      EXPECT_NEAR(single / count, 1, 0.03) << options.scale << " " << options.pixfrac << " colour " << c;
      const double ratio = std::sqrt(blocks / block_count), stated = noise_correlation_ratio(options);
      const double error = 5 * stated / std::sqrt(2 * block_count);
      // The formula is for equal weights everywhere; those of a mosaic vary. The border of a block has less of it.
      EXPECT_NEAR(ratio, stated, error + 0.08 * stated) << options.scale << " " << options.pixfrac << " colour " << c;
    }
  }
}

/// All steps together: a sky that rotates, found, matched and drizzled without any truth.
TEST(Drizzle, StarsOfARotatingSkyKeepTheirFluxAndWidthAfterRegistration) {
  constexpr int frames = 16;
  const StarCamera camera{.width = 600, .height = 480};
  constexpr DrizzleOptions options{1, 0.8};
  Draw draw(9);
  std::vector<TrueStar> stars = star_grid(camera, 12000, draw);
  for (TrueStar& star : stars) {
    star.x += draw.uniform(-9, 9);
    star.y += draw.uniform(-9, 9);
  }
  InlineExecutor one;
  Drizzle drizzle(camera.width, camera.height, options);
  StarField reference;
  for (int k = 0; k < frames; ++k) {
    const StarTransform truth = rotation(camera.width, camera.height, k * 0.5, k == 0 ? 0 : draw.uniform(-9, 9),
                                         k == 0 ? 0 : draw.uniform(-9, 9));
    std::vector<TrueStar> moved_stars = stars;
    for (TrueStar& star : moved_stars) {
      const Point p = truth.at({star.x, star.y});
      star.x = p.x;
      star.y = p.y;
    }
    const Plane<float> frame = exposed(camera, moved_stars, 20 + static_cast<std::uint64_t>(k));
    const FrameView seen = view_of(camera, frame);
    const StarField field = find_stars(seen, {}, one);
    if (k == 0) reference = field;
    const Result<StarMatch> match = match_stars(reference, field, {});
    ASSERT_TRUE(match) << k;
    const Point p = match->transform.at({10, 10}), expected = truth.at({10, 10});
    EXPECT_NEAR(std::hypot(p.x - expected.x, p.y - expected.y), 0, 0.1) << k;
    drizzle.add({.frame = seen,
                 .motion = motion_of(match->transform, camera.width, camera.height),
                 .level_e = field.background_e},
                one);
  }
  const DrizzleImage image = drizzle.finish(one);
  double flux_errors = 0, flux = 0, width2 = 0, count = 0;
  for (const TrueStar& star : stars) {
    if (std::hypot(star.x - 300, star.y - 240) > 200) continue;  // in all frames
    const Moments got = moments_of(image, 1, star.x, star.y, options.scale, 60);
    double variance = 0;
    for (int y = static_cast<int>(star.y) - 9; y <= star.y + 9; ++y)
      for (int x = static_cast<int>(star.x) - 9; x <= star.x + 9; ++x)
        variance += static_cast<double>(image.variance_e2(1).at(x, y));
    const double error = std::sqrt(variance) * noise_correlation_ratio(options);
    flux_errors += std::pow((got.flux - star.flux_e[1]) / error, 2);
    flux += got.flux / star.flux_e[1] - 1;
    width2 += got.width2;
    count += 1;
  }
  EXPECT_GT(count, 60);
  EXPECT_NEAR(flux / count, 0, 0.01);
  EXPECT_GT(std::sqrt(flux_errors / count), 0.7);
  EXPECT_LT(std::sqrt(flux_errors / count), 1.6);  // few drops: their places weigh parts of the star differently
  EXPECT_NEAR(width2 / count, 1.2 * 1.2 + (2 + 0.8 * 0.8) / 12, 0.08);
}

}  // namespace
}  // namespace lowlux::merge
