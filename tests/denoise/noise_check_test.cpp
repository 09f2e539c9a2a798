#include "denoise/check/noise_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "isp/base/executor.h"
#include "tests/denoise/frames.h"
#include "tests/support/executors.h"

namespace lowlux {
namespace {

using test::two_threads;

using namespace denoise_testing;
using denoise::check_noise;
using denoise::NoiseCheck;
using denoise::NoiseFinding;

bool has(const NoiseCheck& check, NoiseFinding finding) {
  const auto remarks = denoise::remarks_on(check);
  return std::any_of(remarks.begin(), remarks.end(), [&](const auto& remark) { return remark.finding == finding; });
}

/// Standard error of a ratio on a level: of a tenth of the blocks, 8 at least, each has 16 details of three colours,
/// and a square of a normal figure has the variance 2.
double ratio_error(const Plane<float>& raw, int level) {
  const double blocks = std::floor(raw.width() / (16 << level)) * std::floor(raw.height() / (16 << level));
  return std::sqrt(2 / (48 * std::max(8.0, std::floor(blocks / 10))));
}

TEST(NoiseCheck, FindsNothingInTheModelsOwnNoiseAndOneForItsRatio) {
  struct Case {
    double signal_e, dark_e, read_noise_e;
  };
  for (const Case c : {Case{0.5, 2, 1.5}, Case{4, 200, 4}, Case{20, 2, 1.5}, Case{2000, 2, 2}}) {
    const Camera camera{
        .phase = BayerPhase::gbrg, .dark_e = {c.dark_e, c.dark_e, c.dark_e, c.dark_e}, .read_noise_e = c.read_noise_e};
    const auto raw = exposed(camera, flat(c.signal_e, 2 * c.signal_e, 0.5 * c.signal_e), 2048, 1536, 91);
    const auto check = check_noise({raw.view(), camera.phase}, camera.noise(), two_threads);
    for (int l = 0; l < denoise::max_levels; ++l) {
      // 0.002: the model's mean is that of 64 cells, and 1 / (1 + error) is in the mean above 1 by the error's square.
      EXPECT_NEAR(check.measured_over_model[l].value(), 1, 5 * ratio_error(raw, l) + 0.002) << l;
      EXPECT_NEAR(check.across_over_model[l].value(), 1, 5 * ratio_error(raw, l) + 0.002) << l;
    }
    // Flatness and detail share the fourth moment: see the header.
    EXPECT_LT(std::abs(check.measured_over_model[0].value() - 1), 0.03);
    EXPECT_TRUE(denoise::remarks_on(check).empty()) << denoise::remarks_on(check).front().text;
    for (const double scale : denoise::variance_scale_of(check)) EXPECT_EQ(scale, 1);
    EXPECT_EQ(check.windows, 8 * 6 * 14 * 14);  // parts of 128 cells
  }
}

/// A scene with texture, edges and flat parts: a crop of a photograph would do as well.
Scene streets(double mean) {
  return [mean](int x, int y) {
    const double house = (x / 150 + y / 110) % 3 == 0 ? 0.3 : (x / 150 + y / 110) % 3 == 1 ? 1.0 : 2.2;
    const double windows = (y / 110) % 2 == 0 && x % 16 < 8 && y % 20 < 10 ? 0.6 : 1;
    const double grain = (x / 150) % 4 == 1 ? 1 + 0.2 * std::sin(1.3 * x) * std::sin(1.1 * y) : 1;
    const double e = mean * house * windows * grain;
    return std::array{0.8 * e, e, 0.6 * e};
  };
}

Plane<float> times(const Plane<float>& raw, double factor) {
  auto out = raw.clone();
  for (std::size_t i = 0; i < out.size(); ++i) out.data()[i] *= static_cast<float>(factor);
  return out;
}

TEST(NoiseCheck, FindsAGainThatIsOffByFourInBothDirectionsOnFlatsAndOnTexture) {
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  for (const double mean_e : {3.0, 20.0, 200.0, 2000.0}) {
    for (const bool textured : {false, true}) {
      const auto raw = exposed(camera, textured ? streets(mean_e) : flat(mean_e, mean_e, mean_e), 1200, 880, 92);
      const auto right = check_noise({raw.view(), camera.phase}, camera.noise(), two_threads);
      EXPECT_FALSE(has(right, NoiseFinding::noise_above_model)) << mean_e << textured;
      EXPECT_FALSE(has(right, NoiseFinding::noise_below_model)) << mean_e << textured;
      const auto high = check_noise({times(raw, 4).view(), camera.phase}, camera.noise(), two_threads);
      EXPECT_TRUE(has(high, NoiseFinding::noise_above_model)) << mean_e << textured;
      EXPECT_FALSE(has(high, NoiseFinding::noise_below_model)) << mean_e << textured;
      const auto low = check_noise({times(raw, 0.25).view(), camera.phase}, camera.noise(), two_threads);
      EXPECT_TRUE(has(low, NoiseFinding::noise_below_model)) << mean_e << textured;
      EXPECT_FALSE(has(low, NoiseFinding::noise_above_model)) << mean_e << textured;
    }
  }
}

// Noise of 200 e- and no read noise: the variance of a multiple m is m^2 200, the model's m 200, the ratio m.
TEST(NoiseCheck, SpeaksFromTheStatedThresholdsOn) {
  const Camera camera{.read_noise_e = 0};
  const auto raw = exposed(camera, flat(200, 200, 200), 2048, 1536, 93);
  const auto of = [&](double gain) {
    return check_noise({times(raw, gain).view(), camera.phase}, camera.noise(), two_threads);
  };
  EXPECT_NEAR(of(0.8).measured_over_model[0].value(), 0.8, 0.8 * 5 * ratio_error(raw, 0) + 0.002);
  NoiseCheck check = of(1);
  for (auto& ratio : check.measured_over_model) ratio = 0.71;
  EXPECT_FALSE(has(check, NoiseFinding::noise_below_model));
  EXPECT_EQ(denoise::variance_scale_of(check)[3], 1);
  check.measured_over_model[3] = 0.69;
  EXPECT_TRUE(has(check, NoiseFinding::noise_below_model));
  EXPECT_EQ(denoise::variance_scale_of(check)[3], 1);  // by the other details
  check.across_over_model = {1, 1, 1, 0.2, 0.9};
  EXPECT_EQ(denoise::variance_scale_of(check)[3], 1) << "0.795, with the next level";
  check.measured_over_model[4] = 0.69;
  check.across_over_model[4] = 0.6;
  EXPECT_EQ(denoise::variance_scale_of(check)[3], 0.69);
  EXPECT_EQ(denoise::variance_scale_of(check)[4], 0.69);
  check.measured_over_model[3] = 0.2;
  EXPECT_EQ(denoise::variance_scale_of(check)[3], (0.2 + 0.69) / 2);
  check.measured_over_model[4] = check.across_over_model[4] = 0;
  EXPECT_EQ(denoise::variance_scale_of(check)[3], 0.2) << "never below its own";
  EXPECT_EQ(denoise::variance_scale_of(check)[4], 0.01);
  for (auto& ratio : check.measured_over_model) ratio = 1.51;
  EXPECT_TRUE(has(check, NoiseFinding::noise_above_model));
  check.measured_over_model[2] = 1.49;  // texture is on some levels, a wrong gain on all
  EXPECT_FALSE(has(check, NoiseFinding::noise_above_model));
}

// A 3 x 3 mean over sites of one colour: the noise of the finest level falls to about (1/9)^2, that of the coarsest
// stays.
TEST(NoiseCheck, FindsRawsThatWereDenoisedBeforeAndTakesTheirNoiseAsMeasured) {
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  const auto raw = exposed(camera, flat(20, 20, 20), 2048, 1536, 94);
  auto smooth = raw.clone();
  for (int y = 2; y + 2 < raw.height(); ++y) {
    for (int x = 2; x + 2 < raw.width(); ++x) {
      float sum = 0;
      for (int j = -2; j <= 2; j += 2) {
        for (int i = -2; i <= 2; i += 2) sum += raw.at(x + i, y + j);
      }
      smooth.at(x, y) = sum / 9;
    }
  }
  const auto check = check_noise({smooth.view(), camera.phase}, camera.noise(), two_threads);
  EXPECT_TRUE(has(check, NoiseFinding::noise_below_model));
  // (1 - z) (1 + z + z^2) / 3 = (1 - z^3) / 3 has 1/9 of the variance of 1 - z, each way. Values three cells apart go
  // with each other by -1/2: 1.5 times the error of white noise, of the tenth of 128 x 96 blocks of 48 details. The
  // figure that chooses the blocks goes with them too: up to a sixth less is left.
  const double error = 1.5 * std::sqrt(2 / (48 * 1228.0));
  EXPECT_LT(81 * check.measured_over_model[0].value(), 1 + 5 * error);
  EXPECT_GT(81 * check.measured_over_model[0].value(), 1 - 1.0 / 6 - 5 * error);
  // The coarsest details hardly know of it: those of eight blocks, less four standard errors.
  EXPECT_GT(check.measured_over_model[4].value(), 1 - 4 * std::sqrt(2 / (48 * 8.0)));
  const auto scale = denoise::variance_scale_of(check);
  EXPECT_EQ(scale[0], (check.across_over_model[0].value() + check.across_over_model[1].value()) / 2);
  EXPECT_LT(scale[0], 0.3);
  EXPECT_EQ(scale[4], 1);
}

TEST(NoiseCheck, FindsAPedestalThatIsTooHighAndNotOneThatIsRight) {
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  const auto raw = exposed(camera, flat(0, 0, 0), 1024, 768, 95);
  const double window_error_e = std::sqrt(4.25 / 81);
  const auto lowered = [&](double by_e, bool everywhere) {
    auto out = raw.clone();
    for (int y = 0; y < (everywhere ? 768 : 16); ++y) {
      for (int x = 0; x < (everywhere ? 1024 : 200); ++x) out.at(x, y) -= static_cast<float>(by_e);
    }
    return check_noise({out.view(), camera.phase}, camera.noise(), two_threads);
  };
  // Normal tails: beyond 4 standard deviations 3.2e-5, 3 of them 1.3e-3, none a half.
  EXPECT_FALSE(has(lowered(0, true), NoiseFinding::black_suspicious));
  EXPECT_FALSE(has(lowered(window_error_e, true), NoiseFinding::black_suspicious));
  const auto found = lowered(4 * window_error_e, true);
  EXPECT_TRUE(has(found, NoiseFinding::black_suspicious));
  EXPECT_GT(found.fraction_negative[0], 0.3);
  EXPECT_GT(found.fraction_negative[2], 0.3);
  EXPECT_GT(found.fraction_negative[1], 0.9);  // the mean of two sites has half the variance
  EXPECT_NE(denoise::remarks_on(found).front().text.find("the black level is suspicious: "), std::string::npos);
  // In 12 of 42 x 56 windows: a fault of the sensor's edge, and no pedestal.
  EXPECT_FALSE(has(lowered(100, false), NoiseFinding::black_suspicious));
}

// Twice the standard deviation that the model has, and no light: only the window's own tells that nothing is negative.
TEST(NoiseCheck, DoesNotTakeUnknownNoiseForAPedestal) {
  Camera camera{.read_noise_e = 6};
  const auto raw = exposed(camera, flat(0, 0, 0), 1024, 768, 96);
  camera.read_noise_e = 3;
  const auto check = check_noise({raw.view(), camera.phase}, camera.noise(), two_threads);
  EXPECT_FALSE(has(check, NoiseFinding::black_suspicious));
  EXPECT_TRUE(has(check, NoiseFinding::noise_above_model));
}

TEST(NoiseCheck, FindsDarkFramesAndNotThoseWithALight) {
  const Camera camera{.dark_e = {20, 20, 20, 20}};
  auto raw = exposed(camera, flat(0, 0, 0), 1024, 768, 97);
  EXPECT_TRUE(has(check_noise({raw.view(), camera.phase}, camera.noise(), two_threads), NoiseFinding::all_dark));
  for (int y = 300; y < 360; ++y) {
    for (int x = 500; x < 560; ++x) raw.at(x, y) += 20;
  }
  const auto lit = check_noise({raw.view(), camera.phase}, camera.noise(), two_threads);
  EXPECT_FALSE(has(lit, NoiseFinding::all_dark));
  EXPECT_LT(lit.fraction_without_signal, 1);
}

TEST(NoiseCheck, CountsSaturatedSites) {
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  auto raw = exposed(camera, flat(100, 100, 100), 512, 400, 98);
  auto noise = camera.noise();
  noise.saturation_e = {1000, 1000, 1000};
  for (int y = 0; y < 200; ++y) std::fill(raw.row(y), raw.row(y) + 512, 1000.0f);
  const auto half = check_noise({raw.view(), camera.phase}, noise, two_threads);
  EXPECT_EQ(half.fraction_saturated, 0.5);
  EXPECT_FALSE(has(half, NoiseFinding::all_saturated));
  EXPECT_NEAR(half.measured_over_model[0].value(), 1, 5 * std::sqrt(2 / (48 * 38.0)) + 0.002);  // 384 blocks are left
  for (int y = 0; y < 398; ++y) std::fill(raw.row(y), raw.row(y) + 512, 2000.0f);
  const auto all = check_noise({raw.view(), camera.phase}, noise, two_threads);
  EXPECT_TRUE(has(all, NoiseFinding::all_saturated));
  EXPECT_FALSE(has(all, NoiseFinding::all_dark)) << "nothing is known of what is saturated";
  EXPECT_FALSE(all.measured_over_model[0].has_value());
}

TEST(NoiseCheck, MeasuresNoLevelOfWhichThereAreNotEightBlocks) {
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  for (const int width : {2, 17, 18, 63, 64, 130}) {
    const auto raw = exposed(camera, flat(5, 5, 5), width, 33, 99);
    const auto check = check_noise({raw.view(), camera.phase}, camera.noise(), two_threads);
    EXPECT_EQ(check.measured_over_model[0].has_value(), width / 16 * 2 >= 8) << width;
    EXPECT_FALSE(check.measured_over_model[1].has_value());
    EXPECT_EQ(check.windows, width / 18);
  }
}

TEST(NoiseCheck, OfHugeNegativeAndMissingValuesIsFinite) {
  constexpr float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  const Camera camera;
  for (const float e : {0.0f, -1e30f, 3e38f, -inf, inf, nan, 1e-40f}) {
    Plane<float> raw(300, 200);
    std::fill(raw.data(), raw.data() + raw.size(), e);
    const auto check = check_noise({raw.view(), camera.phase}, {}, two_threads);
    for (const auto& ratio : check.measured_over_model) EXPECT_TRUE(std::isfinite(ratio.value_or(0)));
    for (const double share : check.fraction_negative) EXPECT_TRUE(share >= 0 && share <= 1);
    EXPECT_TRUE(check.fraction_without_signal >= 0 && check.fraction_without_signal <= 1);
    EXPECT_EQ(check.fraction_saturated, e == inf ? 1 : 0);
    denoise::remarks_on(check);
  }
}

}  // namespace
}  // namespace lowlux
