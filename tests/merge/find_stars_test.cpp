#include "isp/merge/stars/find_stars.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "isp/merge/stars/candidates.h"
#include "isp/merge/stars/detection_limit.h"
#include "tests/merge/star_grid.h"

namespace lowlux::merge {
namespace {

using namespace star_testing;

TEST(FindStars, FindsAtMostAsManyFalseStarsAsStatedAtAnyLight) {
  constexpr double stated = 20;
  for (const double sky_e : {0.02, 0.3, 3.0, 60.0, 2000.0}) {
    for (const double sigma : {0.8, 1.2, 2.0}) {
      const StarCamera camera{
          .width = 1500, .height = 1400, .sky_e = {0.5 * sky_e, sky_e, 0.7 * sky_e}, .read_noise_e = 1};
      const Plane<float> frame = exposed(camera, {}, 7);
      const StarField field = found_in(camera, frame, {.psf_sigma_px = sigma, .false_stars_per_mp = stated});
      const double expected = stated * 2.1, found = static_cast<double>(field.stars.size());
      EXPECT_LE(found, expected + 5 * std::sqrt(expected)) << sky_e << " e-, sigma " << sigma;
      EXPECT_GE(found, 0.2 * expected - 5 * std::sqrt(0.2 * expected)) << sky_e << " e-, sigma " << sigma;
    }
  }
}

TEST(FindStars, FalseStarsStayAsRareUnderVignettingAndGradients) {
  const StarCamera camera{.width = 1600, .height = 1400};
  Plane<float> frame = sky_of(camera);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double u = x / 800.0 - 1, v = y / 800.0 - 1;
      frame.at(x, y) *= static_cast<float>((1 - 0.25 * (u * u + v * v)) * (1 + 0.5 * u));
    }
  }
  expose(camera, 3, frame);
  const double expected = 20 * 2.24;
  EXPECT_LE(static_cast<double>(found_in(camera, frame, {.false_stars_per_mp = 20}).stars.size()),
            expected + 5 * std::sqrt(expected));
}

TEST(FindStars, CompletenessFollowsTheSignalToNoiseRatio) {
  for (const double sky_e : {0.5, 60.0}) {
    const StarCamera camera{.width = 1600, .height = 1600, .sky_e = {0.5 * sky_e, sky_e, 0.7 * sky_e}};
    const std::vector<float> taps = matched_filter_taps(1.2);
    const PerSite<double> level{0.5 * sky_e, sky_e, sky_e, 0.7 * sky_e};
    const double limit = detection_limit(taps, level, camera.variance_e2(), 1e-6);
    for (const double snr : {3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 20.0}) {
      Draw draw(static_cast<std::uint64_t>(100 * snr));
      const std::vector<TrueStar> stars = star_grid(camera, snr / camera.snr_of(1), draw);
      const StarField field = found_in(camera, exposed(camera, stars, 5), {.max_stars = 4000});
      const int found = for_each_found(camera, field, stars, [](const Star&, const TrueStar&) {});
      const auto count = static_cast<double>(stars.size());
      const double fraction = found / count, error = 5 * std::sqrt(0.25 / count);
      // The filter is sampled at the sites, and the light of the star has noise too.
      EXPECT_GE(fraction, normal_tail(limit - 0.85 * snr) - 0.02 - error) << "snr " << snr << ", " << sky_e << " e-";
      EXPECT_LE(fraction, normal_tail(limit - snr) + 0.02 + error) << "snr " << snr << ", " << sky_e << " e-";
      EXPECT_GE(fraction, snr >= 10 ? 0.98 : 0) << sky_e;
    }
  }
}

TEST(FindStars, ErrorsOfPlaceFluxAndWidthAreThoseStated) {
  for (const double sigma : {0.8, 1.2, 1.8}) {
    for (const double snr : {15.0, 50.0, 200.0}) {
      const auto phase = static_cast<BayerPhase>(static_cast<int>(snr) % 4);
      const StarCamera camera{.width = 1600, .height = 1600, .phase = phase, .sigma_px = sigma};
      Draw draw(static_cast<std::uint64_t>(snr + 1000 * sigma));
      const std::vector<TrueStar> stars = star_grid(camera, snr / camera.snr_of(1), draw);
      const StarField field = found_in(camera, exposed(camera, stars, 5), {.max_stars = 4000});
      Errors x, y, width;
      std::array<Errors, 3> flux;
      for_each_found(camera, field, stars, [&](const Star& star, const TrueStar& truth) {
        x.add(star.x_px, truth.x);
        y.add(star.y_px, truth.y);
        width.add(star.sigma_px, sigma);
        for (std::size_t c = 0; c < 3; ++c) flux[c].add(star.flux_e[c], truth.flux_e[c]);
      });
      const double error = 5 / std::sqrt(x.count);  // of a mean
      for (const Errors& e : {x, y}) {
        EXPECT_NEAR(e.mean(), 0, error) << sigma << " px, snr " << snr;
        EXPECT_GT(e.rms(), 0.85) << sigma << " px, snr " << snr;
        EXPECT_LT(e.rms(), 1.2) << sigma << " px, snr " << snr;
      }
      for (const Errors& e : flux) {
        EXPECT_NEAR(e.mean(), 0, error + 1 / snr) << sigma << " px, snr " << snr;  // second order, as 1 / snr
        EXPECT_GT(e.rms(), 0.85) << sigma << " px, snr " << snr;
        EXPECT_LT(e.rms(), 1.2) << sigma << " px, snr " << snr;
      }
      EXPECT_NEAR(width.mean(), 0, error + 5 / snr) << sigma << " px, snr " << snr;  // a skewed distribution
      EXPECT_LT(width.rms(), 1.25) << sigma << " px, snr " << snr;
      EXPECT_NEAR(field.psf_sigma_px, sigma, 0.03 * sigma + 0.5 * sigma / snr);
    }
  }
}

TEST(FindStars, AnyThreadsFindTheSame) {
  const StarCamera camera{.width = 701, .height = 533};
  Draw draw(3);
  const Plane<float> frame = exposed(camera, drawn_stars(camera, 200, 300, draw), 5);
  const StarField one = found_in(camera, frame);
  EXPECT_GT(one.stars.size(), 100U);
  for (const int threads : {2, 3, 7}) {
    const StarField other = found_in(camera, frame, {}, threads);
    ASSERT_EQ(other.stars.size(), one.stars.size());
    EXPECT_EQ(std::memcmp(other.stars.data(), one.stars.data(), one.stars.size() * sizeof(Star)), 0) << threads;
    EXPECT_EQ(other.psf_sigma_px, one.psf_sigma_px);
  }
}

TEST(FindStars, SmallFramesHaveNoStars) {
  for (const auto& [width, height] : std::vector<std::array<int, 2>>{{1, 1}, {1, 5000}, {5000, 1}, {2, 3}, {15, 900}}) {
    const StarCamera camera{.width = width, .height = height};
    EXPECT_TRUE(found_in(camera, exposed(camera, {}, 5)).stars.empty()) << width << " x " << height;
  }
}

TEST(FindStars, StarsAreFoundInFramesOfAnySizeFrom16) {
  Draw draw(12);
  for (int k = 0; k < 40; ++k) {
    const StarCamera camera{.width = 16 + static_cast<int>(120 * std::pow(draw.uniform(), 2)),
                            .height = 16 + static_cast<int>(120 * std::pow(draw.uniform(), 2))};
    TrueStar star{draw.uniform(6, camera.width - 7), draw.uniform(6, camera.height - 7), {3000, 3000, 3000}};
    const StarField field = found_in(camera, exposed(camera, {star}, 5));
    ASSERT_FALSE(field.stars.empty()) << camera.width << " x " << camera.height << " at " << star.x << ", " << star.y;
    const Star& first = field.stars.front();
    EXPECT_NEAR(first.x_px.value, star.x, 5 * first.x_px.standard_error) << camera.width << " x " << camera.height;
    EXPECT_NEAR(first.y_px.value, star.y, 5 * first.y_px.standard_error) << camera.width << " x " << camera.height;
    for (const Star& any : field.stars) {
      EXPECT_TRUE(std::isfinite(any.x_px.standard_error) && std::isfinite(any.sigma_px.standard_error));
      for (const Estimate& flux : any.flux_e) EXPECT_TRUE(std::isfinite(flux.value + flux.standard_error));
    }
  }
}

TEST(FindStars, FramesWithoutNoiseOrWithoutDataHaveNoStars) {
  const StarCamera camera{.width = 200, .height = 200, .read_noise_e = 0};
  for (const float level : {0.0F, 100.0F, -3.0F, nan}) {
    Plane<float> frame(camera.width, camera.height);
    std::fill_n(frame.data(), frame.size(), level);
    EXPECT_TRUE(found_in(camera, frame).stars.empty()) << level;
  }
}

/// The limit against the exact distribution: one coefficient for all sites, so that the sum is a scaled Poisson count.
TEST(DetectionLimit, IsTheNormalQuantileWithManyPhotonsAndHigherWithFew) {
  const std::vector<float> taps = matched_filter_taps(1.2);
  const double normal = 4.7534;  // quantile of 1 - 1e-6
  double before = 1e9;
  for (const double mean : {0.01, 0.1, 1.0, 10.0, 100.0, 1e4, 1e6}) {
    const double limit = detection_limit(taps, {mean, mean, mean, mean}, {0, 0, 0, 0}, 1e-6);
    EXPECT_LT(limit, before) << mean;
    EXPECT_GT(limit, normal - 1e-3) << mean;
    before = limit;
  }
  EXPECT_NEAR(before, normal, 2e-3);
  EXPECT_NEAR(detection_limit(taps, {0, 0, 0, 0}, {4, 9, 4, 1}, 1e-6), normal, 1e-4);
}

}  // namespace
}  // namespace lowlux::merge
