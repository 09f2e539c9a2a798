#include "isp/model/sensor/bracket_advice.h"
#include "tests/support/numbers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace lowlux::isp {
namespace {

using test::inf;

/// Draws scenes from wide ranges: 0.5 to 300 e- in the darkest tenth, lamps 1/8 to 1000 times the limit.
class Scenes {
 public:
  explicit Scenes(std::uint64_t seed) : random_(seed) {}

  double between(double least, double most) {
    return least * std::pow(most / least, std::uniform_real_distribution<>(0, 1)(random_));
  }

  BracketRequest request() {
    BracketRequest out;
    out.scene = {.exposure_s = between(1e-3, 10),
                 .darkest_e = between(0.5, 300),
                 .dark_charge_e = between(1e-3, 30),
                 .noise_variance_e2 = between(0.5, 100),
                 .saturation_e = between(2000, 60000),
                 .highlight_fraction = between(0.125, 1000)};
    out.snr = between(10, 1000);
    out.longest_exposure_s = out.scene.exposure_s * between(0.25, 1000);
    return out;
  }

 private:
  std::mt19937_64 random_;
};

/// Returns the sum of signal^2 / variance over the frames that do not saturate at a level, in plain double.
double oracle_snr(const BracketScene& s, const std::vector<BracketExposure>& exposures, double signal_e) {
  double weight = 0;
  for (const BracketExposure& e : exposures) {
    const double ratio = e.exposure_s / s.exposure_s;
    const double charge = ratio * (signal_e + s.dark_charge_e);
    if (charge > s.saturation_e * (1 + 1e-6)) continue;
    weight += e.frames * ratio * ratio / (charge + s.noise_variance_e2);
  }
  return weight * signal_e * signal_e;
}

double frames_of(const BracketAdvice& advice) {
  double sum = 0;
  for (const BracketExposure& e : advice.exposures) sum += e.frames;
  return sum;
}

/// Returns the signal, in the raw's exposure, that fills an exposure to the limit.
double filling_signal(const BracketScene& s, double exposure_s) {
  return s.saturation_e * s.exposure_s / exposure_s - s.dark_charge_e;
}

TEST(BracketAdvice, ReachesTheRequestedRatioAtEveryLevelWithNoFrameToSpare) {
  constexpr std::uint64_t seed = 2611;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Scenes scenes(seed);
  int brackets = 0, refused = 0;
  for (int i = 0; i < 3000; ++i) {
    const BracketRequest r = scenes.request();
    const BracketScene& s = r.scene;
    const auto advice = advise_bracket(r);
    if (!advice) {
      ++refused;
      continue;
    }
    const std::vector<BracketExposure>& exposures = advice->exposures;
    EXPECT_NEAR(advice->snr / oracle_snr(s, exposures, s.darkest_e), 1, 1e-9);
    EXPECT_GE(advice->snr, r.snr * (1 - 1e-8));
    EXPECT_LE(exposures.front().exposure_s / s.exposure_s * s.highlight_fraction, 1 + 1e-9);
    EXPECT_LE(exposures.back().exposure_s, r.longest_exposure_s * (1 + 1e-9));
    brackets += advice->is_bracket() ? 1 : 0;
    for (std::size_t k = 0; k < exposures.size(); ++k) {
      const bool last = k + 1 == exposures.size();
      const double next = last ? 0 : exposures[k + 1].exposure_s;
      EXPECT_LE(next / exposures[k].exposure_s, 16 * (1 + 1e-9));  // 4 EV
      // Just above the level at which the next exposure saturates, the shorter ones are on their own.
      const double level = last ? s.darkest_e : filling_signal(s, next);
      std::vector<BracketExposure> used(exposures.begin(), exposures.begin() + static_cast<std::ptrdiff_t>(k) + 1);
      EXPECT_GE(oracle_snr(s, used, level), r.snr * (1 - 1e-8)) << i << ' ' << k;
      if (exposures[k].frames == 1) continue;
      used[k].frames -= 1;
      EXPECT_LT(oracle_snr(s, used, level), r.snr * (1 + 1e-8)) << i << ' ' << k;
    }
  }
  EXPECT_GT(brackets, 500);
  EXPECT_LT(refused, 300);
}

TEST(BracketAdvice, EqualFramesAreTheFewestAndABracketTakesFewer) {
  constexpr std::uint64_t seed = 2612;
  Scenes scenes(seed);
  for (int i = 0; i < 1000; ++i) {
    const BracketRequest r = scenes.request();
    const auto advice = advise_bracket(r);
    if (!advice) continue;
    const double shortest = advice->exposures.front().exposure_s;
    const double one = oracle_snr(r.scene, {{shortest, 1}}, r.scene.darkest_e);
    const double equal = std::max(1.0, std::ceil(r.snr / one * (1 - 1e-9)));
    if (advice->is_bracket()) {
      EXPECT_LT(frames_of(*advice), equal) << seed << ' ' << i;
    } else {
      EXPECT_EQ(frames_of(*advice), equal) << seed << ' ' << i;
    }
    const double like_raw = advice->raw_snr * advice->frames_like_raw;
    EXPECT_GE(like_raw, r.snr * (1 - 1e-8));
    EXPECT_TRUE(advice->frames_like_raw == 1 || like_raw - advice->raw_snr < r.snr * (1 + 1e-8));
  }
}

TEST(BracketAdvice, OfPhotonsAloneIsTheirNumber) {
  // Without read noise and dark charge the ratio is the number of photons: 100 e- in total.
  BracketRequest r{.scene = {.exposure_s = 0.1, .darkest_e = 4, .saturation_e = 4000, .highlight_fraction = 1},
                   .snr = 100};
  const auto held = advise_bracket(r);
  ASSERT_TRUE(held);
  EXPECT_NEAR(held->shadow_exposure_s, 2.5, 1e-9);
  EXPECT_EQ(held->frames_like_raw, 25);
  ASSERT_EQ(held->exposures.size(), 3u);  // 0.1 s to 2.5 s by at most 4 EV, 5 frames would be those of a bracket
  EXPECT_EQ(held->exposures[2].frames, 1);
  r.scene.highlight_fraction = 0.01;
  const auto longer = advise_bracket(r);
  ASSERT_TRUE(longer);
  EXPECT_FALSE(longer->is_bracket());
  EXPECT_NEAR(longer->exposures[0].exposure_s, 2.5, 1e-9);
  EXPECT_EQ(longer->exposures[0].frames, 1);
  r.longest_exposure_s = 0.2;
  const auto limited = advise_bracket(r);
  ASSERT_TRUE(limited);
  EXPECT_FALSE(limited->is_bracket());
  EXPECT_EQ(limited->exposures[0].frames, 13);  // of 8 e-
  EXPECT_NEAR(limited->snr, 104, 1e-9);
}

TEST(BracketAdvice, IsThatOfDrawnFramesWithinTheirStatistics) {
  constexpr std::uint64_t seed = 2613;
  Scenes scenes(seed);
  std::mt19937_64 random(seed);
  int tried = 0;
  for (int i = 0; tried < 20; ++i) {
    const BracketRequest r = scenes.request();
    const auto advice = advise_bracket(r);
    if (!advice || frames_of(*advice) > 50) continue;
    ++tried;
    const BracketScene& s = r.scene;
    constexpr int pixels = 20000;
    double sum = 0, sum2 = 0;
    for (int pixel = 0; pixel < pixels; ++pixel) {
      double value = 0, weights = 0;
      for (const BracketExposure& e : advice->exposures) {
        const double light = e.exposure_s / s.exposure_s, charge = light * (s.darkest_e + s.dark_charge_e);
        const double weight = light * light / (charge + s.noise_variance_e2);
        std::poisson_distribution<int> photons(charge);
        std::normal_distribution<> noise(0, std::sqrt(s.noise_variance_e2));
        for (int frame = 0; frame < e.frames; ++frame) {
          value += weight * (photons(random) + noise(random) - light * s.dark_charge_e) / light;
          weights += weight;
        }
      }
      sum += value / weights;
      sum2 += value / weights * (value / weights);
    }
    const double mean = sum / pixels, variance = sum2 / pixels - mean * mean;
    const double predicted = s.darkest_e * s.darkest_e / advice->snr;
    EXPECT_NEAR(mean, s.darkest_e, 5 * std::sqrt(predicted / pixels)) << seed << ' ' << i;
    // The variance of a sample variance is (2 + excess kurtosis) / n; that of a Poisson mean is below 1 / m.
    EXPECT_NEAR(variance / predicted, 1, 5 * std::sqrt((2 + 1 / s.darkest_e) / pixels)) << seed << ' ' << i;
  }
}

TEST(BracketAdvice, RefusesImpossibleFiguresAndEndlessSeries) {
  const BracketRequest good{.scene = {.exposure_s = 0.1, .darkest_e = 4, .saturation_e = 4000, .highlight_fraction = 1},
                            .snr = 100};
  ASSERT_TRUE(advise_bracket(good));
  BracketRequest r = good;
  r.scene.darkest_e = 0;
  EXPECT_EQ(advise_bracket(r).error().code, ErrorCode::invalid_argument);
  r = good;
  r.scene.highlight_fraction = inf;
  EXPECT_EQ(advise_bracket(r).error().code, ErrorCode::invalid_argument);
  r = good;
  r.scene.noise_variance_e2 = -1;
  EXPECT_EQ(advise_bracket(r).error().code, ErrorCode::invalid_argument);
  r = good;
  r.scene.darkest_e = 1e-3;
  r.longest_exposure_s = 0.1;
  EXPECT_EQ(advise_bracket(r).error().code, ErrorCode::insufficient);
}

}  // namespace
}  // namespace lowlux::isp
