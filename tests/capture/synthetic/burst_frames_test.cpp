#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "isp/model/spectrum/cie_data.h"
#include "tests/capture/synthetic/burst_scene.h"
#include "tests/support/sensor_frames.h"

namespace lowlux::capture {
namespace {

using isp::NoiseSourceSet;
using test::burst_of;
using test::equal;

isp::NamedSensor noisy_sensor() {
  isp::NamedSensor out = test::plain_sensor();
  out.model.read_noise_e = 2.5;
  out.model.prnu = 0.01;
  out.model.row_noise_e = 0.8;
  out.model.column_noise_e = 0.6;
  return out;
}

BurstOptions everything() {
  BurstOptions burst;
  burst.reduction = 2, burst.shake_px = 9, burst.roll_deg = 3, burst.dither_px = 0.5;
  burst.field_rotation_deg = 1, burst.drift_y_px = 0.3, burst.horizon_px = 40;
  burst.movers = 2, burst.bracket_ev = {0, -2, 1};
  return burst;
}

Scene busy_scene(int width, int height) {
  Scene scene = test::grey_scene(width, height,
                                 [](int u, int v) { return 0.1 + 0.4 * std::pow(std::sin(0.3 * u + 0.1 * v), 2); });
  EXPECT_TRUE(add_stars(scene, 40, 0.5, 4, 2));
  EXPECT_TRUE(add_lamp(scene, 20, 50, *isp::light_named("A"), 30));
  return scene;
}

TEST(BurstFrames, AreTheSameInAnyOrderForEveryNumberOfThreads) {
  for (const bool planned : {false, true}) {
    SyntheticOptions options;
    options.masked_columns = 4;
    if (planned) options.effects.tolerance = isp::Tolerance{};
    if (planned) options.lens_blur_px = 1.2;
    const BurstSource one = burst_of(busy_scene(131, 117), everything(), options, noisy_sensor());
    InlineExecutor executor;
    std::vector<RawFrame> expected;
    for (std::uint32_t i = 0; i < 4; ++i) expected.push_back(*one.frame(i, executor));
    const CameraRgb signal = one.signal_e(2, executor);
    const SceneLinear xyz = one.xyz_cd_m2(0, executor);
    for (const int threads : {2, 3, 7}) {
      PoolExecutor pool(threads);
      const auto again = BurstSource::of(busy_scene(131, 117), noisy_sensor(), test::response_of(noisy_sensor()),
                                         options, everything(), pool);
      ASSERT_TRUE(again) << again.error().message;
      for (const std::uint32_t i : {3U, 0U, 2U, 1U}) {
        EXPECT_TRUE(equal(again->frame(i, pool)->raw.dn, expected[i].raw.dn)) << i << ' ' << threads;
      }
      for (int k = 0; k < 3; ++k) {
        EXPECT_TRUE(equal(again->signal_e(2, pool).plane[k], signal.plane[k])) << threads;
        EXPECT_TRUE(equal(again->xyz_cd_m2(0, pool).plane[k], xyz.plane[k])) << threads;
      }
    }
  }
}

TEST(BurstFrames, OfASceneAtRestAreThoseOfTheSingleScene) {
  InlineExecutor executor;
  SyntheticOptions options;
  options.lens_blur_px = 0.6;
  options.phase = BayerPhase::gbrg;
  options.effects.tolerance = isp::Tolerance{};
  const auto single = test::source_of(busy_scene(65, 43), noisy_sensor(), options);
  ASSERT_TRUE(single);
  const BurstSource burst = burst_of(busy_scene(65, 43), {}, options, noisy_sensor());
  for (const std::uint32_t i : {0U, 5U}) {
    EXPECT_TRUE(equal(burst.frame(i, executor)->raw.dn, single->frame(i, executor).raw.dn));
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_TRUE(equal(burst.signal_e(0, executor).plane[k], single->signal_e(executor).plane[k]));
    EXPECT_TRUE(equal(burst.xyz_cd_m2(0, executor).plane[k], single->xyz_cd_m2(executor).plane[k]));
  }
}

TEST(BurstFrames, TheMosaicIsTheTruthSeenThroughTheFilters) {
  InlineExecutor executor;
  SyntheticOptions options;
  options.phase = BayerPhase::bggr;
  options.exposure.time_s = 0.25;
  options.effects.effects = {isp::Effect::lens_blur};
  for (const std::uint32_t i : {0U, 1U, 2U}) {
    options.lens_blur_px = 0.7 * i;
    const BurstSource source = burst_of(busy_scene(131, 117), everything(), options);
    const Plane<float> mosaic = source.mosaic_e(i, executor);
    const CameraRgb signal = source.signal_e(i, executor);
    const Plane<float> dn = source.exposed(i, executor)->frame_dn(i, nullptr, executor);
    ASSERT_EQ(mosaic.width(), 65);
    ASSERT_EQ(mosaic.height(), 58);
    for (int y = 0; y < 58; ++y) {
      for (int x = 0; x < 65; ++x) {
        const float expected = signal.plane[static_cast<int>(colour_at(BayerPhase::bggr, x, y))].at(x, y);
        ASSERT_EQ(mosaic.at(x, y), expected);
        ASSERT_NEAR(dn.at(x, y), 512 + 0.5 * expected, 1e-6 * (512 + expected)) << "floats";
      }
    }
  }
}

TEST(BurstFrames, ABracketHasItsTimesInFilesTruthAndNoise) {
  InlineExecutor executor;
  SyntheticOptions options;
  options.exposure.time_s = 0.5;
  BurstOptions burst;
  burst.bracket_ev = {-4, 0, 1};
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.read_noise_e = 3;
  const BurstSource source = burst_of(*flat_scene(test::setup_of(256, 256, 2)), burst, options, sensor);
  const float unit = source.mosaic_e(1, executor).at(0, 1);  // green at 0 EV
  for (std::uint32_t i = 0; i < 6; ++i) {
    const double factor = std::exp2(burst.bracket_ev[i % 3]);
    const RawFrame frame = *source.frame(i, executor);
    EXPECT_EQ(frame.raw.info.exposure_s, 0.5 * factor);
    EXPECT_EQ(source.truth(i).exposure_s, 0.5 * factor);
    EXPECT_NEAR(source.mosaic_e(i, executor).at(0, 1), unit * factor, 1e-6 * unit * factor);
    std::vector<double> greens;
    for (int y = 0; y < 256; ++y) {
      for (int x = 1 - y % 2; x < 256; x += 2) greens.push_back((frame.raw.dn.at(x, y) - 512.0) / 0.5);
    }
    const test::SampleMoments m = test::moments_of(greens);
    const double variance = unit * factor + 9 + 4.0 / 12;  // shot, read, quantisation by 2 e-
    EXPECT_NEAR(m.mean, unit * factor, 5 * m.mean_error);
    EXPECT_NEAR(m.variance, variance, 5 * m.variance_error);
  }
  EXPECT_EQ(source.frame(0, executor)->raw.info.iso, source.frame(2, executor)->raw.info.iso);
}

TEST(BurstFrames, OddAndTinyScenesAreMade) {
  InlineExecutor executor;
  for (const auto& [width, height] : {std::pair{2, 2}, {3, 44}, {64, 2}, {67, 31}}) {
    BurstOptions burst = everything();
    burst.horizon_px.reset();
    burst.mover_size_px = 1;
    const auto level = [](int u, int v) { return 0.1 + 0.01 * ((u * 7 + v * 3) % 40); };
    const BurstSource source = burst_of(test::grey_scene(width, height, level), burst);
    for (const std::uint32_t i : {0U, 7U}) {
      const Plane<float> mosaic = source.mosaic_e(i, executor);
      EXPECT_EQ(mosaic.width(), width / 2);
      EXPECT_EQ(mosaic.height(), height / 2);
      EXPECT_TRUE(std::all_of(mosaic.data(), mosaic.data() + mosaic.size(), [](float v) { return v > 0 && v < 1e6F; }));
    }
  }
}

TEST(BurstFrames, NoFrameHasABlackBorder) {
  InlineExecutor executor;
  BurstOptions burst;
  burst.reduction = 2, burst.shake_px = 60, burst.roll_deg = 20;
  const BurstSource source = burst_of(test::grey_scene(180, 160, [](int, int) { return 0.5; }), burst);
  const float level = source.signal_e(0, executor).plane[1].at(40, 40);
  for (std::uint32_t i = 0; i < 8; ++i) {
    const CameraRgb signal = source.signal_e(i, executor);
    for (std::size_t at = 0; at < signal.plane[1].size(); ++at) {
      ASSERT_NEAR(signal.plane[1].data()[at], level, 1e-6 * level);
    }
  }
}

void expect_refused(const BurstOptions& burst, const SyntheticOptions& options, const std::string& clue) {
  InlineExecutor executor;
  const isp::NamedSensor sensor = test::plain_sensor();
  const auto source = BurstSource::of(*flat_scene(test::setup_of(64, 48, 1)), sensor, test::response_of(sensor),
                                      options, burst, executor);
  ASSERT_FALSE(source) << clue;
  EXPECT_EQ(source.error().code, ErrorCode::invalid_argument);
  EXPECT_NE(source.error().message.find(clue), std::string::npos) << source.error().message;
}

TEST(BurstFrames, WhatCannotBeIsRefused) {
  expect_refused({.shake_px = std::numeric_limits<double>::quiet_NaN(), .reduction = 2}, {}, "hand shake");
  expect_refused({.roll_deg = -1, .reduction = 2}, {}, "roll");
  expect_refused({.shake_px = 3}, {}, "reduction");
  expect_refused({.horizon_px = 24, .reduction = 2}, {}, "horizon");  // the image has 24 rows
  SyntheticOptions options;
  options.sampling = PhotonSampling::published;
  expect_refused({.shake_px = 3, .reduction = 2}, options, "published");
  options = {};
  options.exposure.time_s = 1000;
  expect_refused({.bracket_ev = {0, 20}}, options, "exposure time");
  options.exposure.time_s = -1;
  expect_refused({}, options, "exposure time");
  options = {};
  options.masked_columns = 3;
  expect_refused({}, options, "masked columns");
}

TEST(BurstFrames, AnExposureBeyondTheSamplerIsAnErrorOfItsFrame) {
  InlineExecutor executor;
  SyntheticOptions options;
  options.effects.effects = NoiseSourceSet::all().without(isp::Effect::clipping);
  const BurstSource source =
      burst_of(*flat_scene(test::setup_of(8, 8, 100)), {.bracket_ev = {0, 10}}, options);  // 3e4 and 3e7 e-
  EXPECT_TRUE(source.frame(0, executor));
  const auto frame = source.frame(1, executor);
  ASSERT_FALSE(frame);
  EXPECT_NE(frame.error().message.find("sampler's limit"), std::string::npos);
}

}  // namespace
}  // namespace lowlux::capture
