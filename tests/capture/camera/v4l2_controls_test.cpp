#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <array>
#include <cerrno>
#include <chrono>

#include "tests/capture/camera/v4l2_opened.h"

namespace lowlux::test {
namespace {

constexpr std::uint32_t modify_layout = 0x0400;    // V4L2_CTRL_FLAG_MODIFY_LAYOUT
constexpr std::uint32_t black_level = 0x0098090b;  // V4L2_CID_BLACK_LEVEL

/// The facts of the first frame.
capture::FrameFacts facts_of(FakeV4l2& fake, capture::Camera& camera) {
  fake.frames = {{.sequence = 0}};
  EXPECT_TRUE(camera.start());
  return camera.next(std::chrono::seconds(1)).value().facts;
}

TEST(V4l2Rate, IsSetAndReadBack) {
  FakeV4l2 fake;
  EXPECT_EQ(opened(fake, {.request = {.frame_rate_hz = 0.25}})->format().frame_rate_hz, 0.25);
  const auto film = opened(fake, {.request = {.frame_rate_hz = 29.97}});
  EXPECT_NEAR(*film->format().frame_rate_hz, 29.97, 0.5e-4);  // Hz: half the fraction's fineness
  fake.only_interval = 5;
  const auto slow = opened(fake, {.request = {.frame_rate_hz = 30}});
  EXPECT_EQ(slow->format().frame_rate_hz, 5.0);
  EXPECT_NE(joined(slow->warnings()).find("frame rate of 30 Hz: the driver keeps 5 Hz"), std::string::npos);
}

TEST(V4l2Rate, IsUnknownWhereTheDriverDoesNotTell) {
  FakeV4l2 fake;
  fake.interval[0] = 0;
  EXPECT_FALSE(opened(fake)->format().frame_rate_hz);
  fake.sets_interval = false;
  EXPECT_EQ(opened(fake, {.request = {.frame_rate_hz = 30}})->warnings().size(), 1u);
  EXPECT_EQ(fake.calls[VIDIOC_S_PARM], 0);
  fake.faults[VIDIOC_G_PARM] = {ENOTTY};
  EXPECT_TRUE(opened(fake)->warnings().empty());
}

TEST(V4l2Exposure, IsSetInHundredsOfMicrosecondsAfterTheAutomaticIsOff) {
  FakeV4l2 fake;
  fake.controls = {{V4L2_CID_EXPOSURE_AUTO, {V4L2_EXPOSURE_APERTURE_PRIORITY, 0, 3}},
                   {V4L2_CID_EXPOSURE_ABSOLUTE, {3, 1, 10000}}};
  EXPECT_FALSE(facts_of(fake, *opened(fake)).exposure_s);  // automatic: not known
  const auto camera = opened(fake, {.request = {.exposure_s = 0.03334}});
  EXPECT_EQ(fake.controls[V4L2_CID_EXPOSURE_AUTO].value, V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(fake.controls[V4L2_CID_EXPOSURE_ABSOLUTE].value, 333);
  EXPECT_TRUE(camera->warnings().empty()) << joined(camera->warnings());
  EXPECT_NEAR(*facts_of(fake, *camera).exposure_s, 0.0333, 1e-15);  // s: rounding of doubles
}

TEST(V4l2Exposure, OutsideTheDriversRangeTheNearestIsSetAndTold) {
  FakeV4l2 fake;
  fake.controls = {{V4L2_CID_EXPOSURE_ABSOLUTE, {3, 1, 3000, 7}}};
  const auto camera = opened(fake, {.request = {.exposure_s = 4}});
  EXPECT_EQ(fake.controls[V4L2_CID_EXPOSURE_ABSOLUTE].value, 1 + 7 * 428);
  EXPECT_NE(joined(camera->warnings()).find("exposure of 4 s: the driver sets 0.2997 s"), std::string::npos);
  EXPECT_EQ(fake.misuses, 0);                                // on a step
  fake.controls[V4L2_CID_EXPOSURE_ABSOLUTE].maximum = 3002;  // half a step and more beyond the last
  EXPECT_TRUE(opened(fake, {.request = {.exposure_s = 4}}));
  EXPECT_EQ(fake.controls[V4L2_CID_EXPOSURE_ABSOLUTE].value, 1 + 7 * 428);
}

TEST(V4l2Exposure, ShutterPriorityWillDoAndAnAutomaticThatStaysIsTold) {
  FakeV4l2 fake;
  fake.controls = {{V4L2_CID_EXPOSURE_AUTO, {3, 2, 3}}, {V4L2_CID_EXPOSURE_ABSOLUTE, {3, 1, 3000}}};
  EXPECT_TRUE(opened(fake, {.request = {.exposure_s = 0.01}})->warnings().empty());
  EXPECT_EQ(fake.controls[V4L2_CID_EXPOSURE_AUTO].value, V4L2_EXPOSURE_SHUTTER_PRIORITY);
  fake.controls[V4L2_CID_EXPOSURE_AUTO] = {3, 3, 3};
  const auto camera = opened(fake, {.request = {.exposure_s = 0.01}});
  EXPECT_NE(joined(camera->warnings()).find("cannot be switched off"), std::string::npos);
  EXPECT_FALSE(facts_of(fake, *camera).exposure_s);
}

TEST(V4l2Exposure, InLinesNeedsThePixelRateAndTheBlankingOnTheNode) {
  FakeV4l2 fake;
  fake.controls = {{V4L2_CID_EXPOSURE, {4, 4, 5000}}, {V4L2_CID_HBLANK, {68, 68, 68}}};
  EXPECT_EQ(opened(fake, {.request = {.exposure_s = 0.01}})->warnings().size(), 1u);
  EXPECT_FALSE(facts_of(fake, *opened(fake)).exposure_s);
  fake.pixel_rate_hz = 1'000'000;  // (32 + 68) / 1 MHz: 100 us a line
  EXPECT_TRUE(opened(fake, {.request = {.exposure_s = 0.01}})->warnings().empty());
  EXPECT_EQ(fake.controls[V4L2_CID_EXPOSURE].value, 100);
  fake.crop_width = 132;  // (132 + 68) / 1 MHz: the part of the sensor that is read, scaled to the format
  const auto camera = opened(fake, {.request = {.exposure_s = 0.01}});
  EXPECT_EQ(fake.controls[V4L2_CID_EXPOSURE].value, 50);
  EXPECT_NEAR(*facts_of(fake, *camera).exposure_s, 0.01, 1e-15);  // s: rounding of doubles
}

TEST(V4l2Exposure, LongerThanAFrameMakesTheFrameLonger) {
  FakeV4l2 fake;
  give_sensor_of_lines(fake, 60000);
  const auto camera = opened(fake, {.request = {.exposure_s = 2}});
  EXPECT_TRUE(camera->warnings().empty()) << joined(camera->warnings());
  EXPECT_EQ(fake.controls[V4L2_CID_EXPOSURE].value, 20000);
  EXPECT_NEAR(fake.controls[V4L2_CID_VBLANK].value, 20000 - sensor_lines + 4, 1);  // lines: no more than it takes
  EXPECT_NEAR(*facts_of(fake, *camera).exposure_s, 2, 1e-12);                      // s: rounding of doubles
  EXPECT_EQ(fake.misuses, 0);
}

TEST(V4l2Exposure, WithTheMostBlankingIsTheLongest) {
  FakeV4l2 fake;
  give_sensor_of_lines(fake, 1000);
  const auto camera = opened(fake, {.request = {.exposure_s = 2}});
  EXPECT_EQ(fake.controls[V4L2_CID_EXPOSURE].value, sensor_lines + 1000 - 4);
  EXPECT_NE(joined(camera->warnings()).find("the driver sets 0.1476 s"), std::string::npos);
  fake.controls[V4L2_CID_VBLANK].flags = V4L2_CTRL_FLAG_READ_ONLY;
  fake.controls[V4L2_CID_VBLANK].value = 20;
  fake.on_set_control(V4L2_CID_VBLANK);
  EXPECT_FALSE(opened(fake, {.request = {.exposure_s = 2}})->warnings().empty());
  EXPECT_EQ(fake.controls[V4L2_CID_EXPOSURE].value, sensor_lines + 16);
  EXPECT_EQ(fake.misuses, 0);
}

TEST(V4l2Exposure, ControlsThatRefuseOrChangeByThemselvesAreTold) {
  FakeV4l2 fake;
  EXPECT_EQ(opened(fake, {.request = {.exposure_s = 0.01, .analogue_gain = 1}})->warnings().size(), 2u);
  fake.controls = {{V4L2_CID_EXPOSURE_ABSOLUTE, {3, 1, 3000}}};
  fake.faults[VIDIOC_S_CTRL] = {EIO};
  EXPECT_EQ(opened(fake, {.request = {.exposure_s = 0.01}})->warnings().size(), 1u);
  fake.faults.clear();
  fake.controls[V4L2_CID_EXPOSURE_ABSOLUTE].flags = V4L2_CTRL_FLAG_READ_ONLY;
  EXPECT_EQ(opened(fake, {.request = {.exposure_s = 0.01}})->warnings().size(), 1u);
  EXPECT_TRUE(facts_of(fake, *opened(fake)).exposure_s);
  for (const std::uint32_t flag : {V4L2_CTRL_FLAG_VOLATILE, V4L2_CTRL_FLAG_INACTIVE, V4L2_CTRL_FLAG_DISABLED}) {
    fake.controls[V4L2_CID_EXPOSURE_ABSOLUTE].flags = flag;
    EXPECT_FALSE(facts_of(fake, *opened(fake)).exposure_s) << flag;
  }
}

TEST(V4l2Gain, IsSetByTheDriversCodeAndKnownOnlyAtItsLeast) {
  FakeV4l2 fake;
  fake.controls = {{V4L2_CID_ANALOGUE_GAIN, {7, 0, 232}}, {V4L2_CID_AUTOGAIN, {1, 0, 1}}, {V4L2_CID_GAIN, {3, 0, 9}}};
  auto camera = opened(fake, {.gain_code = 100});
  EXPECT_EQ(fake.controls[V4L2_CID_ANALOGUE_GAIN].value, 100);
  EXPECT_EQ(fake.controls[V4L2_CID_AUTOGAIN].value, 0);
  EXPECT_FALSE(facts_of(fake, *camera).analogue_gain);
  camera.reset();

  auto least = opened(fake, {.request = {.analogue_gain = 1}});
  EXPECT_EQ(fake.controls[V4L2_CID_ANALOGUE_GAIN].value, 0);
  EXPECT_TRUE(least->warnings().empty());
  EXPECT_EQ(facts_of(fake, *least).analogue_gain, 1.0);
  least.reset();
  fake.controls[V4L2_CID_AUTOGAIN].value = 1;
  EXPECT_FALSE(facts_of(fake, *opened(fake)).analogue_gain);
  EXPECT_EQ(fake.controls[V4L2_CID_GAIN].value, 3);
}

TEST(V4l2Gain, FactorsThatV4l2DoesNotKnowAreNotGuessed) {
  FakeV4l2 fake;
  fake.controls = {{V4L2_CID_ANALOGUE_GAIN, {7, 0, 232}}};
  EXPECT_NE(joined(opened(fake, {.request = {.analogue_gain = 2}})->warnings()).find("0 to 232"), std::string::npos);
  EXPECT_EQ(fake.controls[V4L2_CID_ANALOGUE_GAIN].value, 7);
  const Error error = refused(fake, {.gain_code = 233});
  EXPECT_EQ(error.code, ErrorCode::invalid_argument);
  EXPECT_TRUE(has(error, "0 to 232"));
  fake.controls = {{V4L2_CID_GAIN, {7, 0, 16}}};
  EXPECT_EQ(opened(fake, {.request = {.analogue_gain = 1}})->warnings().size(), 1u);
  EXPECT_TRUE(opened(fake, {.gain_code = 16})->warnings().empty());
  EXPECT_EQ(fake.controls[V4L2_CID_GAIN].value, 16);
  EXPECT_FALSE(facts_of(fake, *opened(fake)).analogue_gain);
}

TEST(V4l2Gain, WhatTheDriverDoesNotKeepIsTold) {
  FakeV4l2 fake;
  fake.controls = {{V4L2_CID_AUTOGAIN, {1, 0, 1}}, {V4L2_CID_GAIN, {7, 0, 16, 2}}};
  fake.on_set_control = [&](std::uint32_t) { fake.controls[V4L2_CID_AUTOGAIN].value = 1; };
  const auto camera = opened(fake, {.gain_code = 5});
  EXPECT_EQ(camera->warnings().size(), 2u) << joined(camera->warnings());
}

TEST(V4l2BlackLevel, IsThatOfTheDriverWhereItCanBeOne) {
  FakeV4l2 fake;
  fake.controls = {{black_level, {64, 0, 4095}}};
  const std::array<double, 4> expected{64, 64, 64, 64};
  EXPECT_EQ(facts_of(fake, *opened(fake)).black_level_dn, expected);
  for (const int value : {-1, 1023, 4095}) {
    fake.controls[black_level].value = value;
    EXPECT_FALSE(facts_of(fake, *opened(fake)).black_level_dn) << value;
  }
  fake.controls.clear();
  EXPECT_FALSE(facts_of(fake, *opened(fake)).black_level_dn);
}

TEST(V4l2Flips, AreSetFirstSoThatTheFormatHasTheOrderTheyMake) {
  FakeV4l2 fake;
  fake.controls = {{V4L2_CID_HFLIP, {0, 0, 1, 1, modify_layout}}, {V4L2_CID_VFLIP, {1, 0, 1, 1, modify_layout}}};
  // Mirroring an even number of columns moves red to odd columns, of rows to odd rows.
  fake.on_set_control = [&](std::uint32_t) {
    constexpr std::uint32_t orders[] = {V4L2_PIX_FMT_SRGGB10, V4L2_PIX_FMT_SGRBG10, V4L2_PIX_FMT_SGBRG10,
                                        V4L2_PIX_FMT_SBGGR10};
    fake.formats = {{orders[fake.controls[V4L2_CID_HFLIP].value + 2 * fake.controls[V4L2_CID_VFLIP].value], 2, {}}};
  };
  fake.on_set_control(V4L2_CID_HFLIP);
  for (const bool horizontal : {false, true}) {
    for (const bool vertical : {true, false}) {
      const auto camera = opened(fake, {.request = {.flip_horizontal = horizontal, .flip_vertical = vertical}});
      EXPECT_EQ(camera->format().raw.phase, static_cast<BayerPhase>((horizontal ? 1 : 0) + (vertical ? 2 : 0)));
      EXPECT_TRUE(camera->warnings().empty()) << joined(camera->warnings());
    }
  }
}

TEST(V4l2Flips, OfADriverThatIsSilentAboutTheOrderAreToldAndItsOrderIsTaken) {
  FakeV4l2 fake;
  fake.controls = {{V4L2_CID_HFLIP, {0, 0, 1}}};
  const auto camera = opened(fake, {.request = {.flip_horizontal = true}});
  EXPECT_EQ(camera->format().raw.phase, BayerPhase::rggb);
  EXPECT_NE(joined(camera->warnings()).find("its horizontal flip changes the order"), std::string::npos);
  fake.formats = {{V4L2_PIX_FMT_Y12, 2, {{16, 12}}}};
  EXPECT_TRUE(opened(fake)->warnings().empty());  // monochrome has none
}

TEST(V4l2Flips, ThatAreNotHadAreTold) {
  FakeV4l2 fake;
  EXPECT_EQ(opened(fake, {.request = {.flip_vertical = true}})->warnings().size(), 1u);
  EXPECT_TRUE(opened(fake, {.request = {.flip_vertical = false}})->warnings().empty());
  fake.controls = {{V4L2_CID_VFLIP, {0, 0, 1, 1, modify_layout}}};
  fake.on_set_control = [&](std::uint32_t id) { fake.controls[id].value = 0; };
  EXPECT_EQ(opened(fake, {.request = {.flip_vertical = true}})->warnings().size(), 1u);
  fake.faults[VIDIOC_S_CTRL] = {EBUSY};
  EXPECT_EQ(opened(fake, {.request = {.flip_vertical = true}})->warnings().size(), 1u);
}

}  // namespace
}  // namespace lowlux::test
