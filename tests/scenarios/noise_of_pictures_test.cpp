#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "denoise/check/noise_check.h"
#include "isp/base/executor.h"
#include "tests/sensor_bench/picture_raw.h"
#include "tests/support/executors.h"

namespace lowlux::noise_of_pictures_test {
namespace {

using test::two_threads;

using denoise::NoiseFinding;

constexpr double dark_e = 2, read_noise_e = 1.5;

/// A raw of the picture in electrons, times the error of the gain.
Plane<float> electrons(const RawDn& raw, const SensorModel& sensor, double factor) {
  Plane<float> out(raw.active.width, raw.active.height);
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      const double dn = raw.dn.at(raw.active.x + x, raw.active.y + y) - sensor.black_level_dn;
      out.at(x, y) = static_cast<float>(factor * dn / sensor.system_gain_dn_per_e);
    }
  }
  return out;
}

denoise::NoiseCheck checked(const RawDn& raw, const SensorModel& sensor, double factor) {
  const denoise::RawNoise noise{
      .dark_mean_e = {dark_e, dark_e, dark_e, dark_e},
      .variance_e2 = {read_noise_e * read_noise_e, read_noise_e * read_noise_e, read_noise_e * read_noise_e}};
  return denoise::check_noise({electrons(raw, sensor, factor).view(), raw.phase}, noise, two_threads);
}

bool has(const denoise::NoiseCheck& check, NoiseFinding finding) {
  const auto remarks = denoise::remarks_on(check);
  return std::any_of(remarks.begin(), remarks.end(), [&](const auto& remark) { return remark.finding == finding; });
}

// A gain that is 4 times too high gives 4 to 16 times the model's variance, one that is too low the inverse. Behind a
// lens, the flattest tenth of a picture's blocks has little texture on the finest level.
TEST(NoiseOfPictures, TellsAGainThatIsOffByFourFromOneThatIsRight) {
  const bool nightly = std::getenv("LOWLUX_NIGHTLY") != nullptr;
  const SensorModel sensor{.name = "noise of pictures",
                           .system_gain_dn_per_e = 4,
                           .read_noise_e = read_noise_e,
                           .full_well_e = 9000,
                           .bits = 16,
                           .black_level_dn = 400,
                           .white_level_dn = 65535,
                           .dark_current_e_per_s = {30 * dark_e, 30 * dark_e, 30 * dark_e}};
  InlineExecutor one;
  std::printf("variance over the model's, finest level first, with the right gain\n");
  for (const char* name : std::span(test::clean_pictures).first(nightly ? test::clean_pictures.size() : 2)) {
    const auto light = test::picture_light(name, one, 0.9);
    ASSERT_TRUE(light) << light.error().message;
    for (const double mean_e : {4.0, 20.0, 200.0}) {
      const RawDn raw = test::take_picture(*light, sensor, {.mean_green_e = mean_e}, one);
      const auto right = checked(raw, sensor, 1);
      std::printf("%-15s %4.0f e- ", name, mean_e);
      for (const auto& ratio : right.measured_over_model) std::printf(" %8.2f", ratio.value_or(0));
      std::printf("\n");
      EXPECT_TRUE(denoise::remarks_on(right).empty()) << name << " at " << mean_e;
      EXPECT_GT(right.measured_over_model[0].value(), 0.9) << name << " at " << mean_e;
      EXPECT_LT(right.measured_over_model[0].value(), denoise::largest_ratio) << name << " at " << mean_e;
      EXPECT_TRUE(has(checked(raw, sensor, 4), NoiseFinding::noise_above_model)) << name << " at " << mean_e;
      EXPECT_TRUE(has(checked(raw, sensor, 0.25), NoiseFinding::noise_below_model)) << name << " at " << mean_e;
    }
  }
}

}  // namespace
}  // namespace lowlux::noise_of_pictures_test
