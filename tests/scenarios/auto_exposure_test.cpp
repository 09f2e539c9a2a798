#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <utility>
#include <vector>

#include "tests/scenarios/metered_camera.h"

namespace lowlux::test {
namespace {

// Frames in which the loop settles after any change of light: with the exposure stated in each frame, or without.
constexpr int frames_to_settle = 45, frames_to_settle_blindly = 80;
constexpr int frames_observed = 60;

double uniform(std::mt19937& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// Returns the best ratio by trying every gain at every time the camera has, by the fraction of pixels that clip where
/// the light is 1 % brighter: less is not worth a change.
double best_snr(const MeteredCamera& camera) {
  const isp::ExposureLimits& limits = camera.setup.limits;
  const double flicker = isp::flicker_hz(limits.mains);
  double best = 0;
  for (std::size_t gain = 0; gain < camera.setup.gains.size(); ++gain) {
    const double last_s = std::min(limits.longest_s, limits.times.max_s) * (1 + 1e-9);
    for (int i = 0; limits.times.min_s + i * limits.times.step_s <= last_s; ++i) {
      const isp::ExposureSetting at{limits.times.min_s + i * limits.times.step_s, gain};
      if (flicker > 0 && at.exposure_s >= 1 / flicker) {
        const auto is_whole = [&](double hz) {
          const double whole_s = std::round(at.exposure_s * hz) / hz;
          return std::abs(at.exposure_s - whole_s) <= 0.51 * limits.times.step_s;
        };
        if (!is_whole(flicker) && !(limits.mains == isp::Mains::either && is_whole(20))) continue;
      }
      if (camera.clipped_fraction(at, 1.01) > limits.clipped_fraction) continue;
      best = std::max(best, isp::midtone_snr(at, camera.truth(), camera.setup.gains, limits));
    }
  }
  return best;
}

struct Outcome {
  int frames = 0;   // until the last change
  int changes = 0;  // afterwards
};

/// Runs the loop, and counts when it made its last change.
Outcome run(MeteredCamera& camera, isp::ExposureController& controller, isp::ExposureMeter& meter, int limit) {
  Outcome out;
  for (int i = 0; i < limit + frames_observed; ++i) {
    const int before = controller.changes();
    camera.step(controller, meter);
    if (controller.changes() == before) continue;
    out.frames = i + 1;
    if (i >= limit) ++out.changes;
  }
  return out;
}

TEST(AutoExposure, SettlesNearTheBestOfAllSettingsAfterEveryStepOfLight) {
  const unsigned seed = 20261125;
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  int slowest[2] = {0, 0};
  double worst = 1;
  for (int trial = 0; trial < 60; ++trial) {
    MeteredCamera camera = drawn_camera(random);
    isp::ExposureController controller(camera.setup);
    isp::ExposureMeter meter(camera.format);
    for (int step = 0; step < 3; ++step) {
      camera.light = std::exp(uniform(random, std::log(1.0), std::log(1e6)));
      const int limit = camera.states ? frames_to_settle : frames_to_settle_blindly;
      const Outcome outcome = run(camera, controller, meter, limit);
      slowest[camera.states] = std::max(slowest[camera.states], outcome.frames);
      SCOPED_TRACE(testing::Message() << "trial " << trial << " step " << step << " light " << camera.light);
      EXPECT_LE(outcome.frames, limit);
      EXPECT_EQ(outcome.changes, 0);
      const double best = best_snr(camera);
      const isp::ExposureSetting at = camera.in_effect;
      if (best > 0) {
        const double reached = isp::midtone_snr(at, camera.truth(), camera.setup.gains, camera.setup.limits);
        worst = std::min(worst, std::sqrt(reached / best));
        EXPECT_GE(std::sqrt(reached), 0.98 * std::sqrt(best)) << "exposure " << at.exposure_s << " gain " << at.gain;
        // A highlight may pass its limit by 1.5 % before a setting is left, and metering is noisy.
        EXPECT_LE(camera.clipped_fraction(at, 0.98), camera.setup.limits.clipped_fraction);
      } else {
        EXPECT_EQ(at.gain, 0u);  // everything clips
        EXPECT_NEAR(at.exposure_s, camera.setup.limits.times.min_s, 1e-9);
      }
    }
  }
  std::printf("settled within %d frames, %d without stated exposures; ratio at least %.4f of the best\n", slowest[1],
              slowest[0], worst);
}

/// Light so bright that exposures are shorter than half a period: frames of 30 Hz see it flicker.
TEST(AutoExposure, IsNotMovedByLampsThatFlicker) {
  const unsigned seed = 50;
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  for (int trial = 0; trial < 12; ++trial) {
    MeteredCamera camera = drawn_camera(random);
    camera.setup.limits.mains = trial % 2 == 0 ? isp::Mains::hz50 : isp::Mains::either;
    camera.frame_s = 1 / uniform(random, 29.5, 30);
    camera.flicker_depth = uniform(random, 0.1, 0.4);
    const isp::GainStep& lowest = camera.setup.gains.front();
    const double exposure_s = std::max(uniform(random, 0.001, 0.007), 10 * camera.setup.limits.times.step_s);
    camera.light = lowest.sensor.full_well_e / exposure_s / camera.scene.back().e_per_s;
    isp::ExposureController controller(camera.setup);
    isp::ExposureMeter meter(camera.format);
    const Outcome outcome = run(camera, controller, meter, 120);
    EXPECT_EQ(outcome.changes, 0) << trial;
    EXPECT_TRUE(controller.settled()) << trial;
    EXPECT_LT(controller.setting().exposure_s, 0.01) << trial;
    // No less than the peaks of the light leave.
    EXPECT_GT(controller.setting().exposure_s, 0.6 * exposure_s) << trial;
  }
}

/// Whole half periods: frames of lamps that flicker by 40 % have the same light to 1 %.
TEST(AutoExposure, MakesFramesOfLampsThatFlickerEquallyBright) {
  const unsigned seed = 60;
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  for (const auto& [mains, hz] : {std::pair{isp::Mains::hz50, 100.0}, std::pair{isp::Mains::hz60, 120.0},
                                  std::pair{isp::Mains::either, 100.0}, std::pair{isp::Mains::either, 120.0}}) {
    MeteredCamera camera = drawn_camera(random);
    camera.setup.limits.mains = mains;
    camera.setup.limits.times.step_s = 20e-6;
    camera.setup.limits.longest_s = 1.0 / 30;
    camera.frame_s = 1 / 29.7;
    camera.flicker_depth = 0.4;
    camera.flicker_hz = hz;
    camera.light = 200;
    isp::ExposureController controller(camera.setup);
    isp::ExposureMeter meter(camera.format);
    EXPECT_EQ(run(camera, controller, meter, 80).changes, 0);
    double least = 1e9, most = 0;
    for (int i = 0; i < 60; ++i) {
      ++camera.frame;
      const double light = camera.light_of_frame(controller.setting().exposure_s);
      least = std::min(least, light);
      most = std::max(most, light);
    }
    // What is left: a step of the camera's time; for either mains a tenth of the 40 %, both ways.
    EXPECT_LT(most / least, mains == isp::Mains::either ? 1.085 : 1.01);
  }
}

}  // namespace
}  // namespace lowlux::test
