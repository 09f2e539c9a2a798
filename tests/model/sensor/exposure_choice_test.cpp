#include "isp/model/sensor/exposure_choice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "isp/model/sensor/exposure_controller.h"
#include "isp/model/sensor/saturation_limits.h"

namespace lowlux::isp {
namespace {

/// Gains of a sensor with noise before and after its amplifier.
std::vector<GainStep> gains_of(const std::vector<double>& factors) {
  std::vector<GainStep> out;
  for (const double factor : factors) {
    GainStep gain{.factor = factor, .sensor = {}};
    gain.sensor.system_gain_dn_per_e = 0.2 * factor;
    gain.sensor.read_noise_e = std::hypot(1.0, 8 / factor);
    gain.sensor.full_well_e = 20000;
    gain.sensor.black_level_dn = 95;
    out.push_back(gain);
  }
  return out;
}

ExposureLimits limits_of(double longest_s, double step_s = 0, Mains mains = Mains::off) {
  return {.times = {1e-4, 10, step_s}, .longest_s = longest_s, .mains = mains};
}

TEST(AllowedTime, IsAWholeNumberOfHalfPeriodsOfTheMainsFromOneOn) {
  for (const auto& [mains, hz] : {std::pair{Mains::hz50, 100.0}, std::pair{Mains::hz60, 120.0}}) {
    for (int n = 1; n < 200; ++n) {
      EXPECT_NEAR(allowed_time_s(n / hz, limits_of(10, 0, mains)), n / hz, 1e-12) << n;
      EXPECT_NEAR(allowed_time_s((n + 0.99) / hz, limits_of(10, 0, mains)), n / hz, 1e-12) << n;
    }
    EXPECT_EQ(allowed_time_s(0.99 / hz, limits_of(10, 0, mains)), 0.99 / hz);  // less than one: as it is
  }
  EXPECT_EQ(allowed_time_s(0.0137, limits_of(10)), 0.0137);
  EXPECT_EQ(allowed_time_s(1e-5, limits_of(10)), 1e-4);  // the camera's shortest
  EXPECT_EQ(allowed_time_s(99, limits_of(10)), 10);
}

TEST(AllowedTime, LeavesATenthOfTheFlickerOfEitherMains) {
  const ExposureLimits limits = limits_of(10, 0, Mains::either);
  double last_s = 0;
  for (double longest_s = 1 / 110.0; longest_s < 1; longest_s *= 1.003) {
    const double time_s = allowed_time_s(longest_s, limits);
    EXPECT_LE(time_s, longest_s * (1 + 1e-9));
    EXPECT_GE(time_s, longest_s - 1 / 110.0);
    EXPECT_GE(time_s, last_s);
    last_s = time_s;
    for (const double flicker_hz : {100.0, 120.0}) {
      const double phase = std::numbers::pi * flicker_hz * time_s;
      EXPECT_LE(std::abs(std::sin(phase) / phase), 0.1) << time_s;
    }
  }
}

TEST(AllowedTime, IsOneOfTheCamerasSteps) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> draw(0, 1);
  for (int i = 0; i < 2000; ++i) {
    const double step_s = std::pow(10, -5 + 2 * draw(random)), longest_s = std::pow(10, -3.5 + 3 * draw(random));
    for (const Mains mains : {Mains::off, Mains::hz50, Mains::hz60, Mains::either}) {
      const double time_s = allowed_time_s(longest_s, limits_of(10, step_s, mains));
      const double steps = (time_s - 1e-4) / step_s;
      EXPECT_NEAR(steps, std::round(steps), 1e-5);
      EXPECT_LE(time_s, std::max(longest_s, 1e-4) + 1.1e-6 * step_s);
      if (mains == Mains::off) {
        EXPECT_GT(time_s + step_s, longest_s);
      }
    }
  }
}

TEST(ChooseExposure, InTheDarkTakesTheLongestTimeAndTheGainWithLeastNoise) {
  const auto gains = gains_of({1, 2, 4, 8, 16});
  const ExposureChoice choice =
      choose_exposure({.midtone_e_per_s = 10, .highlight_e_per_s = 100}, gains, limits_of(0.04));
  EXPECT_EQ(choice.setting.exposure_s, 0.04);
  EXPECT_EQ(choice.setting.gain, 4u);
  EXPECT_EQ(choice.limit, ExposureLimit::motion);
  // Closed form: (K mu)^2 / (K^2 (mu + sigma^2) + 1/12).
  const double gain = 0.2 * 16, variance = gain * gain * (0.4 + 1 + 0.25) + 1.0 / 12;
  EXPECT_NEAR(choice.snr, gain * gain * 0.16 / variance, 1e-9);
}

TEST(ChooseExposure, InTheLightFillsTheRangeOfTheLowestGain) {
  const auto gains = gains_of({1, 2, 4});
  const ExposureLimits limits = limits_of(0.04);
  const ExposureChoice choice = choose_exposure({.midtone_e_per_s = 1e5, .highlight_e_per_s = 4e6}, gains, limits);
  EXPECT_EQ(choice.setting.gain, 0u);
  EXPECT_FALSE(choice.clips);
  // 20000 e- are the well and the range; of the range, 3 % are spared, and noise may clip a thousandth: z = 3.0902.
  const double charge_e = 4e6 * choice.setting.exposure_s;
  EXPECT_NEAR(charge_e + 3.0902 * std::sqrt(charge_e + 65), 0.97 * 20000, 0.1);
  EXPECT_EQ(choice.limit, ExposureLimit::converter_range);
}

TEST(ChooseExposure, TakesTheLowestGainOfThoseThatAreAsGood) {
  auto gains = gains_of({1, 2, 4});
  for (GainStep& gain : gains) gain.sensor.read_noise_e = 2;
  EXPECT_EQ(choose_exposure({.midtone_e_per_s = 1e4, .highlight_e_per_s = 1e4}, gains, limits_of(0.04)).setting.gain,
            0u);
}

TEST(ChooseExposure, KeepsToTheLargestGainAllowed) {
  const auto gains = gains_of({1, 2, 4, 8});
  ExposureLimits limits = limits_of(0.04);
  limits.max_factor = 5;
  EXPECT_EQ(choose_exposure({.midtone_e_per_s = 1, .highlight_e_per_s = 1}, gains, limits).setting.gain, 2u);
  limits.max_factor = 0.5;  // the lowest gain is used in any case
  EXPECT_EQ(choose_exposure({.midtone_e_per_s = 1, .highlight_e_per_s = 1}, gains, limits).setting.gain, 0u);
}

TEST(ChooseExposure, TakesTheLeastWhereEverythingClips) {
  const auto gains = gains_of({1, 2, 4});
  const ExposureChoice choice =
      choose_exposure({.midtone_e_per_s = 1e9, .highlight_e_per_s = 1e12}, gains, limits_of(1));
  EXPECT_TRUE(choice.clips);
  EXPECT_EQ(choice.setting.gain, 0u);
  EXPECT_EQ(choice.setting.exposure_s, 1e-4);
}

TEST(ExposureController, TakesWhatTheDriverMakesOfATimeForALimit) {
  ExposureController controller({.gains = gains_of({1, 2, 4}), .limits = limits_of(1), .at = {0.01, 0}});
  const MeteredCodes dark{.midtone_dn = 1, .highlight_dn = 12, .range_dn = 4000, .clipped_fraction = 0};
  const auto wanted = controller.take(dark, std::nullopt);
  ASSERT_TRUE(wanted);
  EXPECT_EQ(wanted->exposure_s, 1);
  controller.was_set(0.25);  // the driver's longest
  for (int i = 0; i < 100; ++i) {
    const MeteredCodes brighter{.midtone_dn = 25 * 4, .highlight_dn = 300, .range_dn = 4000, .clipped_fraction = 0};
    EXPECT_FALSE(controller.take(brighter, std::nullopt)) << i;
  }
  EXPECT_TRUE(controller.settled());
  EXPECT_EQ(controller.setting().exposure_s, 0.25);
}

TEST(ExposureController, WaitsForTheFrameThatStatesTheSettingButNotForEver) {
  ExposureController controller(
      {.gains = gains_of({1, 2, 4}), .limits = limits_of(0.04), .at = {0.01, 0}, .latency_frames = 6});
  const MeteredCodes dark{.midtone_dn = 1, .highlight_dn = 12, .range_dn = 4000, .clipped_fraction = 0};
  ASSERT_TRUE(controller.take(dark, StatedExposure{0.01, 1}));
  EXPECT_TRUE(controller.awaits());
  controller.take(dark, StatedExposure{0.01, 1});
  EXPECT_TRUE(controller.awaits());
  controller.take(dark, StatedExposure{0.04, 4});
  EXPECT_FALSE(controller.awaits());
  controller.reset({0.01, 0});
  ASSERT_TRUE(controller.take(dark, StatedExposure{0.01, 1}));
  for (int i = 0; i < 6; ++i) controller.take(dark, StatedExposure{0.02, 2});  // a camera that does as it likes
  EXPECT_FALSE(controller.awaits());
}

}  // namespace
}  // namespace lowlux::isp
