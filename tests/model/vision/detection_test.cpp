#include "isp/model/vision/detection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "isp/model/vision/seeing.h"
#include "tests/reference/exact_ref.h"
#include "tests/support/numbers.h"

namespace lowlux::isp {
namespace {

using test::inf;
using test::nan;

double log_uniform(std::mt19937& random, double from, double to) {
  return std::exp(std::uniform_real_distribution<double>(std::log(from), std::log(to))(random));
}

TEST(SeeingModel, HasTheSmallestThresholdsWithinTheFalseAlarms) {
  for (const double requested : {0.5, 0.1, 0.01, 1e-3, 1e-6, 1e-12}) {
    const SeeingModel model = *seeing_model(40, requested);
    for (const DetectionLimit& limit : {model.rods, model.cones}) {
      const double dark = limit.patch.dark_counts;
      EXPECT_LE(reference::poisson_at_least(limit.threshold, dark), requested / 2);
      if (limit.threshold > 1) {
        EXPECT_GT(reference::poisson_at_least(limit.threshold - 1, dark), requested / 2);
      }
      EXPECT_NEAR(limit.false_alarm_rate, reference::poisson_at_least(limit.threshold, dark), 1e-12);
    }
    EXPECT_LE(model.false_alarm_rate, requested);
  }
}

TEST(SeeingModel, RefusesFiguresOutsideTheirRange) {
  for (const double bad : {0.0, 1.0, -0.1, 2.0, nan}) EXPECT_FALSE(seeing_model(40, bad)) << bad;
  for (const double bad : {-1.0, nan, inf}) EXPECT_FALSE(seeing_model(bad)) << bad;
}

TEST(ProbabilityOfSeeing, IsTheFalseAlarmsInTheDarkAndOneByDay) {
  const SeeingModel model = *seeing_model(40);
  for (const double none : {0.0, -1.0, -1e30, nan}) {
    EXPECT_EQ(probability_of_seeing(model, {none, none}), model.false_alarm_rate) << none;
  }
  EXPECT_NEAR(probability_of_seeing(model, {1e-30, 1e-30}), model.false_alarm_rate, 1e-12);
  for (const double light : {1.0, 1e4, 1e9, 1e300, inf}) EXPECT_EQ(probability_of_seeing(model, {light, light}), 1);
}

// Both tails by sums of Poisson terms in 50 digits; the means are rounded once or twice before.
TEST(ProbabilityOfSeeing, IsThatOfTwoPoissonTails) {
  constexpr unsigned seed = 5;
  RecordProperty("seed", seed);
  std::mt19937 random(seed);
  for (int i = 0; i < 300; ++i) {
    const SeeingModel model = *seeing_model(log_uniform(random, 3, 50));
    const LuminancePair light{log_uniform(random, 1e-9, 1e-2), log_uniform(random, 1e-9, 1e-3)};
    const auto missed = [&](const DetectionLimit& limit, double cd_m2) {
      return 1 - reference::poisson_at_least(limit.threshold,
                                             limit.patch.dark_counts + cd_m2 * limit.patch.counts_per_cd_m2);
    };
    ASSERT_NEAR(probability_of_seeing(model, light),
                1 - missed(model.rods, light.scotopic) * missed(model.cones, light.photopic), 1e-10);
  }
}

TEST(ProbabilityOfSeeing, NeverFallsWithMoreLight) {
  constexpr unsigned seed = 6;
  RecordProperty("seed", seed);
  std::mt19937 random(seed);
  const SeeingModel model = *seeing_model(45);
  for (int i = 0; i < 20000; ++i) {
    LuminancePair dim{log_uniform(random, 1e-9, 1e3), log_uniform(random, 1e-9, 1e3)}, bright = dim;
    (random() % 2 == 0 ? bright.photopic : bright.scotopic) *= log_uniform(random, 1, 100);
    ASSERT_LE(probability_of_seeing(model, dim), probability_of_seeing(model, bright) + 1e-15);
  }
}

// Rods see where cones do not: half of the patches are seen from about 1e-5 scotopic cd/m2 for an instant of 0.1 s, and
// by cones alone from about 0.01 cd/m2.
TEST(ProbabilityOfSeeing, PutsTheThresholdOfRodsFarBelowThatOfCones) {
  const SeeingModel model = *seeing_model(pupil_area_mm2(adapted_pupil_mm(0)));
  EXPECT_LT(probability_of_seeing(model, {0, 1e-6}), 0.1);
  EXPECT_GT(probability_of_seeing(model, {0, 1e-3}), 0.9);
  EXPECT_LT(probability_of_seeing(model, {1e-3, 0}), 0.1);
  EXPECT_GT(probability_of_seeing(model, {1, 0}), 0.9);
}

}  // namespace
}  // namespace lowlux::isp
