#include "capture/libcamera/libcamera_facts.h"

#include <array>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

#include "capture/libcamera/start_controls.h"

namespace lowlux::capture::libcamera_facts_test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

TEST(LibcameraFacts, NothingIsKnownOfAFrameWithoutControls) {
  const FrameFacts facts = frame_facts({}, 10);
  EXPECT_FALSE(facts.exposure_s || facts.analogue_gain || facts.digital_gain || facts.black_level_dn ||
               facts.colour_gains || facts.colour_matrix || facts.colour_temperature_k || facts.lux ||
               facts.temperature_c);
}

TEST(LibcameraFacts, UnitsAreTheOnesOfLowlux) {
  const FrameFacts facts = frame_facts({.exposure_us = 33333,
                                        .analogue_gain = 2.5F,
                                        .digital_gain = 1.25F,
                                        .black_levels = {{4096, 4097, 0, 65535}},
                                        .colour_gains = {{1.5F, 2.0F}},
                                        .colour_matrix = {{1, 2, 3, 4, 5, 6, 7, 8, -9}},
                                        .colour_temperature_k = 5500,
                                        .lux = 0.0F,
                                        .temperature_c = -20.0F},
                                       10);
  EXPECT_DOUBLE_EQ(facts.exposure_s.value(), 0.033333);
  EXPECT_EQ(facts.analogue_gain, 2.5);
  EXPECT_EQ(facts.digital_gain, 1.25);
  // v / 65536 * 2^10: powers of two, so without rounding; the quarter of 4097 / 64 is kept.
  EXPECT_EQ(facts.black_level_dn, (std::array<double, 4>{64, 64.015625, 0, 1023.984375}));
  EXPECT_EQ(facts.colour_gains, (std::array<double, 2>{1.5, 2}));
  EXPECT_EQ(facts.colour_matrix, (std::array<double, 9>{1, 2, 3, 4, 5, 6, 7, 8, -9}));
  EXPECT_EQ(facts.colour_temperature_k, 5500);
  EXPECT_EQ(facts.lux, 0);
  EXPECT_EQ(facts.temperature_c, -20);
}

TEST(LibcameraFacts, ABlackLevelScalesWithTheBitsOfTheStream) {
  for (const auto& [bits, black_dn] : {std::pair(8, 16.0), {10, 64.0}, {12, 256.0}, {14, 1024.0}, {16, 4096.0}}) {
    const FrameFacts facts = frame_facts({.black_levels = {{4096, 4096, 4096, 4096}}}, bits);
    EXPECT_EQ(facts.black_level_dn.value()[3], black_dn) << bits;
  }
}

TEST(LibcameraFacts, WhatCannotBeIsLeftOutAloneAndTheRestStays) {
  for (const float ill : {nan, infinity, -infinity, -1.0F}) {
    const FrameFacts facts = frame_facts(
        {.exposure_us = 1000, .analogue_gain = ill, .digital_gain = ill, .colour_gains = {{ill, 2}}, .lux = ill}, 10);
    EXPECT_FALSE(facts.analogue_gain || facts.digital_gain || facts.colour_gains || facts.lux) << ill;
    EXPECT_TRUE(facts.exposure_s) << ill;
  }
  for (const float ill : {nan, infinity, -infinity, -274.0F, -1e30F}) {
    EXPECT_FALSE(frame_facts({.temperature_c = ill}, 10).temperature_c) << ill;
  }
  for (const float ill : {nan, infinity}) {
    EXPECT_FALSE(frame_facts({.colour_matrix = {{1, 0, 0, 0, ill, 0, 0, 0, 1}}}, 10).colour_matrix) << ill;
  }
  for (const std::int32_t ill : {0, -1, std::numeric_limits<std::int32_t>::min()}) {
    EXPECT_FALSE(frame_facts({.exposure_us = ill}, 10).exposure_s) << ill;
    EXPECT_FALSE(frame_facts({.colour_temperature_k = ill}, 10).colour_temperature_k) << ill;
  }
  for (const std::int32_t ill : {-1, 65536, std::numeric_limits<std::int32_t>::min()}) {
    EXPECT_FALSE(frame_facts({.black_levels = {{4096, 4096, ill, 4096}}}, 10).black_level_dn) << ill;
  }
}

TEST(LibcameraFacts, PlaceholdersOfZeroAreNoFacts) {
  const FrameFacts facts = frame_facts({.exposure_us = 0,
                                        .analogue_gain = 0.0F,
                                        .digital_gain = 0.0F,
                                        .colour_gains = {{0, 0}},
                                        .colour_matrix = std::array<float, 9>{},
                                        .colour_temperature_k = 0},
                                       12);
  EXPECT_FALSE(facts.exposure_s || facts.analogue_gain || facts.digital_gain || facts.colour_gains ||
               facts.colour_matrix || facts.colour_temperature_k);
}

OfferedControls all_controls() {
  return {.ae_enable = true,
          .exposure_us = {.offered = true, .range = {{100, 66666}}},
          .analogue_gain = {.offered = true, .range = {{1, 16}}},
          .frame_duration_us = {.offered = true, .range = {{16666, 120000}}}};
}

TEST(StartControls, NothingIsSetThatNobodyAskedFor) {
  const StartControls controls = start_controls({}, all_controls());
  EXPECT_FALSE(controls.ae_off || controls.exposure_us || controls.analogue_gain || controls.frame_duration_us);
  EXPECT_TRUE(controls.warnings.empty());
}

TEST(StartControls, AutomaticExposureEndsWhereExposureOrGainIsGiven) {
  const StartControls both = start_controls({.exposure_s = 0.01, .analogue_gain = 8.0}, all_controls());
  EXPECT_TRUE(both.ae_off);
  EXPECT_EQ(both.exposure_us, 10000);
  EXPECT_EQ(both.analogue_gain, 8.0F);
  EXPECT_FALSE(both.frame_duration_us);
  EXPECT_TRUE(both.warnings.empty());
  EXPECT_TRUE(start_controls({.analogue_gain = 8.0}, all_controls()).ae_off);
  OfferedControls offered = all_controls();
  offered.ae_enable = false;
  EXPECT_FALSE(start_controls({.exposure_s = 0.01}, offered).ae_off);
}

TEST(StartControls, AFrameRateFixesTheFrameDuration) {
  const StartControls controls = start_controls({.frame_rate_hz = 25.0, .exposure_s = 0.04}, all_controls());
  EXPECT_EQ(controls.frame_duration_us, (std::array<std::int64_t, 2>{40000, 40000}));
  EXPECT_TRUE(controls.warnings.empty());
}

TEST(StartControls, ALongExposureAsksForFramesThatHoldIt) {
  const StartControls within = start_controls({.exposure_s = 0.05}, all_controls());
  EXPECT_EQ(within.frame_duration_us, (std::array<std::int64_t, 2>{50000, 120000}));
  const StartControls beyond = start_controls({.exposure_s = 10.0}, all_controls());
  EXPECT_EQ(beyond.frame_duration_us, (std::array<std::int64_t, 2>{10000000, 20000000}));
  OfferedControls offered = all_controls();
  offered.frame_duration_us = {};
  EXPECT_FALSE(start_controls({.exposure_s = 10.0}, offered).frame_duration_us);
}

TEST(StartControls, WhatTheCameraLacksBecomesAWarningForEach) {
  const StartControls controls =
      start_controls({.frame_rate_hz = 25.0, .exposure_s = 0.01, .analogue_gain = 2.0}, {.ae_enable = true});
  EXPECT_FALSE(controls.ae_off || controls.exposure_us || controls.analogue_gain || controls.frame_duration_us);
  ASSERT_EQ(controls.warnings.size(), 3U);
  EXPECT_EQ(controls.warnings[0], "the camera has no control of its exposure [us]: 10000 is not set");
}

TEST(StartControls, ValuesBeyondTheStatedRangeAreSetWithAWarning) {
  const StartControls controls = start_controls({.exposure_s = 1.0, .analogue_gain = 0.5}, all_controls());
  EXPECT_EQ(controls.exposure_us, 1000000);
  EXPECT_EQ(controls.analogue_gain, 0.5F);
  ASSERT_EQ(controls.warnings.size(), 2U);
  EXPECT_EQ(controls.warnings[0],
            "the camera states a range of 100 to 66666 for its exposure [us], asked for is 1000000: "
            "it may take the nearest");
  OfferedControls offered = all_controls();
  offered.exposure_us.range.reset();
  EXPECT_TRUE(start_controls({.exposure_s = 1.0}, offered).warnings.empty());
}

TEST(StartControls, AnExposureLongerThanTheFramesAskedForIsSaid) {
  const StartControls controls = start_controls({.frame_rate_hz = 25.0, .exposure_s = 0.05}, all_controls());
  EXPECT_EQ(controls.frame_duration_us, (std::array<std::int64_t, 2>{40000, 40000}));
  ASSERT_EQ(controls.warnings.size(), 1U);
  EXPECT_EQ(controls.warnings[0],
            "an exposure of 0.05 s is longer than a frame at 25 Hz: the camera shortens one of them");
}

TEST(StartControls, FiguresBeyondLibcamerasIntegersAreTheirEnds) {
  const StartControls huge =
      start_controls({.frame_rate_hz = 1e-300, .exposure_s = 1e300, .analogue_gain = 1e300}, all_controls());
  EXPECT_EQ(huge.exposure_us, std::numeric_limits<std::int32_t>::max());
  EXPECT_EQ(huge.analogue_gain, std::numeric_limits<float>::max());
  EXPECT_EQ(huge.frame_duration_us.value()[1], 32000000000000);
  const StartControls tiny = start_controls({.frame_rate_hz = 1e300, .exposure_s = 1e-300}, all_controls());
  EXPECT_EQ(tiny.exposure_us, 1);
  EXPECT_EQ(tiny.frame_duration_us.value()[0], 1);
}

TEST(ExposureControls, AreTheRangesThatTheCameraStates) {
  const auto controls = exposure_controls({}, all_controls());
  ASSERT_TRUE(controls) << controls.error().message;
  EXPECT_DOUBLE_EQ(controls->min_s, 100e-6);
  EXPECT_DOUBLE_EQ(controls->max_s, 66666e-6);
  EXPECT_DOUBLE_EQ(controls->step_s, 1e-6);
  ASSERT_EQ(controls->gains.size(), 65u);  // 4 EV in sixteenths
  EXPECT_EQ(controls->gains.front().factor, 1);
  EXPECT_NEAR(controls->gains.back().factor, 16, 1e-9);
  EXPECT_TRUE(exposure_controls({.analogue_gain = 2}, all_controls())->gains.empty());  // given: it stays
}

TEST(ExposureControls, OfACameraWithoutAnExposureTimeAreAnError) {
  OfferedControls offered = all_controls();
  offered.exposure_us.range.reset();
  EXPECT_EQ(exposure_controls({}, offered).error().code, ErrorCode::unsupported);
  offered.exposure_us = {};
  EXPECT_NE(exposure_controls({}, offered).error().message.find("no control"), std::string::npos);
  offered = all_controls();
  offered.analogue_gain = {};
  EXPECT_TRUE(exposure_controls({}, offered)->gains.empty());
}

TEST(ExposureSettings, HoldTheFrameThatTheExposureTakes) {
  const CameraExposure night{.exposure_s = 0.05, .gain = CameraGain{.factor = 4, .code = 0}};
  const StartControls slow = exposure_settings({}, night, all_controls());
  EXPECT_TRUE(slow.ae_off);
  EXPECT_EQ(slow.exposure_us, 50000);
  EXPECT_EQ(slow.analogue_gain, 4.0F);
  EXPECT_EQ(slow.frame_duration_us, (std::array<std::int64_t, 2>{50000, 100000}));
  // Shorter again: frames of the usual rate, as a limit once set would stay.
  const StartControls fast = exposure_settings({}, {.exposure_s = 0.001, .gain = {}}, all_controls());
  EXPECT_EQ(fast.frame_duration_us, (std::array<std::int64_t, 2>{33333, 33333}));
  EXPECT_FALSE(fast.analogue_gain);
  const StartControls given = exposure_settings({.frame_rate_hz = 10}, night, all_controls());
  EXPECT_EQ(given.frame_duration_us, (std::array<std::int64_t, 2>{100000, 100000}));
}

}  // namespace
}  // namespace lowlux::capture::libcamera_facts_test
