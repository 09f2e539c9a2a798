#include "calib/dark/dark_dose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

namespace lowlux::calib {
namespace {

constexpr double pedestal = 512, current = 30;  // [DN], [DN/s] at 20 C

std::vector<DarkLevel> levels_at(const std::vector<DarkExposure>& exposures, double doubling_c = 8) {
  std::vector<DarkLevel> out;
  for (const DarkExposure& e : exposures) {
    const double off_c = e.temperature_c.value_or(20) - 20;
    out.push_back({e, 4, pedestal + current * e.time_s * std::exp2(off_c / doubling_c), 1e-6});
  }
  return out;
}

double level_of(const DarkWeights& w, const std::vector<DarkLevel>& levels) {
  double sum = w.of_pedestal * pedestal;
  for (std::size_t i = 0; i < levels.size(); ++i) sum += w.of_level[i] * levels[i].level_dn;
  return sum;
}

double sum_of(const DarkWeights& w) { return std::accumulate(w.of_level.begin(), w.of_level.end(), w.of_pedestal); }

std::string refusal(const std::vector<DarkExposure>& darks, const DarkExposure& picture,
                    const DarkScaling& known = {}) {
  const auto w = compute_dark_weights(levels_at(darks), picture, known);
  return w ? "" : w.error().message;
}

TEST(WeighDarks, TheSameSettingIsThePlainMeanWhateverElseThereIs) {
  auto levels = levels_at({{2, 20}, {10, 20}, {2, 20.8}});
  levels[2].frames = 12;
  const auto w = compute_dark_weights(levels, {2.01, 20.1}, {});
  ASSERT_TRUE(w);
  EXPECT_TRUE(w->same_setting);
  EXPECT_EQ(w->of_level, (std::vector<double>{0.25, 0, 0.75}));
  EXPECT_EQ(w->scale, 1);
  EXPECT_TRUE(w->warnings.empty());
}

TEST(WeighDarks, SeveralTimesGiveALineThatIsExactForWhatIsLinear) {
  for (const double time_s : {0.5, 3.0, 7.0}) {
    const auto levels = levels_at({{0, 20}, {2, 20}, {10, 20}});
    const auto w = compute_dark_weights(levels, {time_s, 20}, {});
    ASSERT_TRUE(w) << time_s;
    EXPECT_NEAR(level_of(*w, levels), pedestal + current * time_s, 1e-9);  // double rounding
    EXPECT_NEAR(sum_of(*w), 1, 1e-12);
    EXPECT_EQ(w->of_pedestal, 0);
    EXPECT_NEAR(w->scale, time_s / 10, 1e-12);
    EXPECT_TRUE(w->warnings.empty());
  }
}

TEST(WeighDarks, OneTimeIsScaledAboveThePedestal) {
  const auto levels = levels_at({{4, 20}});
  const auto w = compute_dark_weights(levels, {2, 20}, {.pedestal_dn = pedestal});
  ASSERT_TRUE(w);
  EXPECT_EQ(w->of_level, std::vector<double>{0.5});
  EXPECT_EQ(w->of_pedestal, 0.5);
  EXPECT_NE(refusal({{4, 20}}, {2, 20}).find("shortest exposure time"), std::string::npos);
}

TEST(WeighDarks, OtherTemperaturesAreScaledByTheDoubling) {
  const auto levels = levels_at({{4, 28}});
  const auto w = compute_dark_weights(levels, {4, 20}, {.doubling_c = 8, .pedestal_dn = pedestal});
  ASSERT_TRUE(w);
  EXPECT_EQ(w->of_level, std::vector<double>{0.5});
  EXPECT_EQ(w->doubling_c, 8);
  ASSERT_EQ(w->warnings.size(), 1U);
  EXPECT_NE(w->warnings[0].find("extrapolated"), std::string::npos);
  EXPECT_NE(refusal({{4, 28}}, {4, 20}, {.pedestal_dn = pedestal}).find("--dark-doubling"), std::string::npos);
}

TEST(WeighDarks, DarksOfTwoTemperaturesTellTheDoublingThemselves) {
  for (const double doubling_c : {5.0, 6.3, 9.0}) {
    const auto levels = levels_at({{0.1, 20}, {5, 20}, {5, 30}}, doubling_c);
    const auto fitted = fitted_doubling_c(levels, std::nullopt);
    ASSERT_TRUE(fitted);
    EXPECT_NEAR(*fitted, doubling_c, 2e-3 * doubling_c);  // half a step of the search
    const auto w = compute_dark_weights(levels, {5, 25}, {});
    ASSERT_TRUE(w);
    const double truth = pedestal + current * 5 * std::exp2(5 / doubling_c);
    // Off by half a step: ln 2 * 5 / doubling * 0.2 % of the dark charge.
    EXPECT_NEAR(level_of(*w, levels), truth, 2e-3 * (truth - pedestal));
    EXPECT_TRUE(w->warnings.empty());
    EXPECT_NEAR(fitted_doubling_c(levels_at({{5, 20}, {5, 30}}, doubling_c), pedestal).value(), doubling_c,
                2e-3 * doubling_c);
  }
}

TEST(WeighDarks, ADoublingThatTheDarksDoNotTellIsNotMadeUp) {
  EXPECT_FALSE(fitted_doubling_c(levels_at({{5, 20}, {5, 30}}), std::nullopt));           // the pedestal is unknown
  EXPECT_FALSE(fitted_doubling_c(levels_at({{0, 20}, {5, 20}, {0, 30}}), std::nullopt));  // no charge when warm
  auto noisy = levels_at({{0, 20}, {5, 20}, {5, 30}});
  for (DarkLevel& level : noisy) level.variance_dn2 = 1e6;
  EXPECT_FALSE(fitted_doubling_c(noisy, std::nullopt));
  auto unstated = levels_at({{0, 20}, {5, 20}, {5, {}}});
  EXPECT_FALSE(fitted_doubling_c(unstated, std::nullopt));
}

TEST(WeighDarks, BeyondTheDarksThereIsAWarningAndBeyondFourTimesNothing) {
  const auto warned = [](double time_s) {
    const auto w = compute_dark_weights(levels_at({{1, 20}, {10, 20}}), {time_s, 20}, {});
    return w && !w->warnings.empty();
  };
  EXPECT_FALSE(warned(5));
  EXPECT_TRUE(warned(20));
  EXPECT_TRUE(warned(0.5));  // below the shortest, and no bias frames
  EXPECT_EQ(refusal({{1, 20}, {10, 20}}, {39.9, 20}), "");
  EXPECT_NE(refusal({{1, 20}, {10, 20}}, {40.1, 20}).find("more than the limit of 4 times"), std::string::npos);
  EXPECT_NE(refusal({{0, 20}}, {1, 20}), "");
  EXPECT_NE(refusal({}, {1, 20}).find("no dark frames"), std::string::npos);
}

TEST(WeighDarks, TemperaturesThatAreNotStatedAreTakenForEqualAndSaidSo) {
  const auto w = compute_dark_weights(levels_at({{4, {}}}), {4, 20}, {});
  ASSERT_TRUE(w);
  EXPECT_EQ(w->of_level, std::vector<double>{1});
  ASSERT_EQ(w->warnings.size(), 1U);
  EXPECT_NE(w->warnings[0].find("do not state"), std::string::npos);
}

}  // namespace
}  // namespace lowlux::calib
