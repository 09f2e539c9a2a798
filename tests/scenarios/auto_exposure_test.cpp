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
/// the peak of the light, in frames of the exposure in effect, is 1 % brighter: less is not worth a change.
double best_snr(const MeteredCamera& camera) {
  const double brighter = 1.01 * camera.peak(camera.in_effect.exposure_s);
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
      if (camera.clipped_fraction(at, brighter) > limits.clipped_fraction) continue;
      best = std::max(best, isp::midtone_snr(at, camera.truth(), camera.setup.gains, limits));
    }
  }
  return best;
}

/// Returns the ratio of the setting in effect relative to the best one, as powers; 1 where every setting clips.
double snr_of_best(const MeteredCamera& camera) {
  const double best = best_snr(camera);
  if (best <= 0) return 1;
  return isp::midtone_snr(camera.in_effect, camera.truth(), camera.setup.gains, camera.setup.limits) / best;
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

/// Returns the largest gap between the phases of the flicker that 12 frames show, in periods.
double largest_gap(double flicker_hz, double frame_s) {
  std::vector<double> phases;
  for (int i = 0; i < 12; ++i) phases.push_back(std::fmod(i * flicker_hz * frame_s, 1.0));
  std::ranges::sort(phases);
  double out = phases.front() + 1 - phases.back();
  for (std::size_t i = 1; i < phases.size(); ++i) out = std::max(out, phases[i] - phases[i - 1]);
  return out;
}

/// Draws a camera under lamps of 10 to 100 % modulation, whose aliases in the frames are fast or slow.
MeteredCamera flickering_camera(std::mt19937& random, bool slowly) {
  MeteredCamera camera = drawn_camera(random);
  const bool is_50_hz = random() % 2 == 0;
  camera.flicker_hz = is_50_hz ? 100 : 120;
  camera.flicker_depth = uniform(random, 0.1, 1);
  isp::ExposureLimits& limits = camera.setup.limits;
  limits.mains = random() % 2 == 0 ? isp::Mains::either : is_50_hz ? isp::Mains::hz50 : isp::Mains::hz60;
  double gap = 0;
  do {
    const double rate_hz = std::vector<double>{15, 24, 25, 30, 60}[random() % 5];
    const double deviation = slowly ? 5e-4 : random() % 2 == 0 ? 0 : 0.03;
    camera.frame_s = 1 / (rate_hz * (1 + uniform(random, -deviation, deviation)));
    gap = largest_gap(camera.flicker_hz, camera.frame_s);
    // Phases that come back exactly are at most three to a period: 1/3. Others must lie closer.
    if (!slowly && deviation == 0 && gap < 0.99) break;
  } while (slowly ? gap < 0.5 : gap > 0.25);
  limits.longest_s = std::min(limits.longest_s, camera.frame_s);
  return camera;
}

/// Returns a light that fills the pixels in a time between 0.3 ms and `longest_s`.
double bright_light(std::mt19937& random, const MeteredCamera& camera, double longest_s) {
  const double time_s = std::exp(uniform(random, std::log(0.0003), std::log(longest_s)));
  return camera.setup.gains.front().sensor.full_well_e / camera.scene.back().e_per_s / time_s;
}

/// Steps of light of up to three decades, up or down, under lamps whose phases 12 frames show: the bounds are those of
/// steady light.
TEST(AutoExposure, SettlesAsFastUnderLampsThatFlicker) {
  const unsigned seed = 20261128;
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  int slowest[2] = {0, 0};
  double worst = 1;
  for (int trial = 0; trial < 50; ++trial) {
    MeteredCamera camera = flickering_camera(random, false);
    isp::ExposureController controller(camera.setup);
    isp::ExposureMeter meter(camera.format);
    const double first_light = bright_light(random, camera, 0.02);
    const double lights[] = {first_light, first_light * std::pow(10, uniform(random, -3, 3)),
                             bright_light(random, camera, 0.009)};
    for (const double light : lights) {
      camera.light = light;
      const int limit = camera.states ? frames_to_settle : frames_to_settle_blindly;
      const Outcome outcome = run(camera, controller, meter, limit);
      slowest[camera.states] = std::max(slowest[camera.states], outcome.frames);
      SCOPED_TRACE(testing::Message() << "trial " << trial << " light " << light << " rate " << 1 / camera.frame_s
                                      << " flicker " << camera.flicker_hz << " depth " << camera.flicker_depth);
      EXPECT_LE(outcome.frames, limit);
      EXPECT_EQ(outcome.changes, 0);
      if (controller.choice().clips) continue;
      worst = std::min(worst, snr_of_best(camera));
      EXPECT_GE(snr_of_best(camera), 0.7);
      double clipped = 0;  // on average; a highlight may pass its limit by 1.5 %, as above
      for (int i = 0; i < frames_observed; ++i) {
        ++camera.frame;
        const double now = 0.98 * camera.light_of_frame(camera.in_effect.exposure_s) / camera.light;
        clipped += camera.clipped_fraction(camera.in_effect, now) / frames_observed;
      }
      EXPECT_LE(clipped, camera.setup.limits.clipped_fraction);
    }
  }
  std::printf("settled within %d frames, %d without stated exposures; power of the ratio at least %.3f of the best\n",
              slowest[1], slowest[0], worst);
}

/// Describes a slow change of light, relative to its start.
struct SlowChange {
  const char* name;
  double longest_s;  // that the first light would allow
  int frames;
  double (*light)(double part);  // after a part of the change
};

constexpr SlowChange slow_changes[] = {
    {"fall from 3 ms", 0.003, 40, [](double part) { return std::pow(0.4, part); }},
    {"fall from 27 ms", 0.027, 40, [](double part) { return std::pow(0.4, part); }},
    {"dusk", 0.002, 1000, [](double part) { return std::pow(0.002, part); }},
    {"daylight", 0.02, 900, [](double part) { return 1 + 1.5 * std::pow(std::sin(6.283185307 * part), 2); }},
};

/// Light that changes slowly is followed, with lamps or without: nothing seen earlier keeps exposures short for long.
TEST(AutoExposure, FollowsSlowChangesOfLight) {
  const unsigned seed = 20261130;
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  double worst[2] = {1, 1};
  for (const isp::Mains mains : {isp::Mains::off, isp::Mains::hz50, isp::Mains::hz60, isp::Mains::either}) {
    for (const bool flickers : {false, true}) {
      if (flickers && mains == isp::Mains::off) continue;  // no exposure is then taken to be under lamps
      for (const SlowChange& change : slow_changes) {
        MeteredCamera camera = drawn_camera(random);
        camera.states = true;
        camera.frame_s = 1 / 28.3;  // 12 frames show the phases of 100 and 120 Hz
        camera.flicker_hz = mains == isp::Mains::hz60 ? 120 : 100;
        camera.flicker_depth = flickers ? 0.3 : 0;
        camera.setup.limits.mains = mains;
        camera.setup.limits.longest_s = camera.frame_s;
        isp::ExposureController controller(camera.setup);
        isp::ExposureMeter meter(camera.format);
        const double first =
            camera.setup.gains.front().sensor.full_well_e / camera.scene.back().e_per_s / change.longest_s;
        camera.light = first;
        for (int i = 0; i < frames_to_settle_blindly; ++i) camera.step(controller, meter);
        for (int i = 1; i <= change.frames; ++i) {
          camera.light = first * change.light(static_cast<double>(i) / change.frames);
          camera.step(controller, meter);
        }
        for (int i = 0; i < frames_observed; ++i) camera.step(controller, meter);
        const double reached = snr_of_best(camera);
        worst[flickers] = std::min(worst[flickers], reached);
        EXPECT_GE(reached, flickers ? 0.6 : 0.9) << change.name << " mains " << static_cast<int>(mains) << " flickers "
                                                 << flickers << " exposure " << camera.in_effect.exposure_s;
      }
    }
  }
  std::printf("power of the ratio %d frames after slow changes: at least %.3f of the best, %.3f under lamps\n",
              frames_observed, worst[0], worst[1]);
}

/// Flicker whose alias takes hundreds of frames looks like light that changes slowly, and is followed like it.
TEST(AutoExposure, FollowsASlowAliasOfFlickerInFewSteps) {
  const unsigned seed = 20261129;
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  constexpr int trials = 40;
  double changes = 0;
  for (int trial = 0; trial < trials; ++trial) {
    MeteredCamera camera = flickering_camera(random, true);
    isp::ExposureController controller(camera.setup);
    isp::ExposureMeter meter(camera.format);
    camera.light = bright_light(random, camera, 0.009);
    changes += run(camera, controller, meter, camera.states ? frames_to_settle : frames_to_settle_blindly).changes;
  }
  std::printf("%.2f changes in %d frames\n", changes / trials, frames_observed);
  EXPECT_LT(changes / trials, 2.5);
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
