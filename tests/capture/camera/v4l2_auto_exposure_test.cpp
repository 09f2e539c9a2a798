#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <optional>
#include <vector>

#include "tests/capture/camera/v4l2_opened.h"

namespace lowlux::test {
namespace {

using capture::CameraGain;

const std::vector<CameraGain> codes{{1, 16}, {2, 32}, {4, 64}};

FakeV4l2 camera_with_controls() {
  FakeV4l2 fake;
  fake.controls = {{V4L2_CID_EXPOSURE_AUTO, {V4L2_EXPOSURE_AUTO, 0, 3}},
                   {V4L2_CID_EXPOSURE_ABSOLUTE, {3, 1, 2000}},
                   {V4L2_CID_AUTOGAIN, {1, 0, 1}},
                   {V4L2_CID_ANALOGUE_GAIN, {16, 16, 255}}};
  return fake;
}

/// The error of taking the exposure over: one line that names the device.
Error not_taken(FakeV4l2& fake, const capture::V4l2Options& options = {}) {
  const auto camera = opened(fake, options);
  const auto taken = camera->take_exposure();
  if (taken) {
    ADD_FAILURE() << "taken";
    return {};
  }
  EXPECT_EQ(taken.error().where, "/dev/video0");
  EXPECT_EQ(taken.error().message.find('\n'), std::string::npos);
  return taken.error();
}

TEST(V4l2AutoExposure, EndsTheDriversOwnAndStatesWhatCanBeSet) {
  FakeV4l2 fake = camera_with_controls();
  const auto camera = opened(fake, {.gain_codes = codes});
  const auto controls = camera->take_exposure();
  ASSERT_TRUE(controls) << controls.error().message;
  EXPECT_EQ(fake.controls[V4L2_CID_EXPOSURE_AUTO].value, V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(fake.controls[V4L2_CID_AUTOGAIN].value, 0);
  EXPECT_DOUBLE_EQ(controls->min_s, 1e-4);
  EXPECT_DOUBLE_EQ(controls->max_s, 0.2);
  EXPECT_DOUBLE_EQ(controls->step_s, 1e-4);
  ASSERT_EQ(controls->gains.size(), 3u);
  EXPECT_EQ(controls->gains[2].code, 64);
  EXPECT_TRUE(opened(fake)->take_exposure()->gains.empty());  // without codes the gain stays
}

TEST(V4l2AutoExposure, SetsTimeAndGainWhileItStreams) {
  FakeV4l2 fake = camera_with_controls();
  const auto camera = opened(fake, {.gain_codes = codes});
  ASSERT_TRUE(camera->take_exposure());
  ASSERT_TRUE(camera->start());
  EXPECT_NEAR(camera->set_exposure({.exposure_s = 0.01667, .gain = codes[1]}).value(), 0.0167, 1e-12);
  EXPECT_EQ(fake.controls[V4L2_CID_EXPOSURE_ABSOLUTE].value, 167);
  EXPECT_EQ(fake.controls[V4L2_CID_ANALOGUE_GAIN].value, 32);
  const int before = fake.calls[VIDIOC_S_CTRL];
  ASSERT_TRUE(camera->set_exposure({.exposure_s = 0.02, .gain = codes[1]}));
  EXPECT_EQ(fake.calls[VIDIOC_S_CTRL], before + 1);  // a gain that is set already is not set again
  fake.frames = {{.sequence = 0}};
  // Frames under way may still have another exposure: none is stated.
  EXPECT_FALSE(camera->next(std::chrono::seconds(1)).value().facts.exposure_s);
  camera->stop();
  EXPECT_EQ(fake.misuses, 0);
}

TEST(V4l2AutoExposure, StatesAGainThatItDoesNotSet) {
  for (const bool sets_gain : {false, true}) {
    FakeV4l2 fake = camera_with_controls();
    fake.controls[V4L2_CID_AUTOGAIN].value = 0;
    const auto camera = opened(fake, {.gain_codes = sets_gain ? codes : std::vector<CameraGain>{}});
    ASSERT_TRUE(camera->take_exposure());
    ASSERT_TRUE(camera->start());
    fake.frames = {{.sequence = 0}};
    const auto frame = camera->next(std::chrono::seconds(1));
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_FALSE(frame->facts.exposure_s);
    // The gain is at its minimum, which is the factor 1.
    EXPECT_EQ(frame->facts.analogue_gain, sets_gain ? std::nullopt : std::optional(1.0));
  }
}

TEST(V4l2AutoExposure, InLinesHasTheUnitOfALine) {
  FakeV4l2 fake;
  fake.controls = {{V4L2_CID_EXPOSURE, {4, 4, 5000, 4}}, {V4L2_CID_HBLANK, {68, 68, 68}}};
  fake.pixel_rate_hz = 10'000'000;  // (32 + 68) / 10 MHz
  const auto camera = opened(fake);
  const auto controls = camera->take_exposure();
  ASSERT_TRUE(controls) << controls.error().message;
  EXPECT_DOUBLE_EQ(controls->min_s, 40e-6);
  EXPECT_DOUBLE_EQ(controls->step_s, 40e-6);
  EXPECT_NEAR(camera->set_exposure({.exposure_s = 0.001}).value(), 0.001, 1e-12);
  EXPECT_EQ(fake.controls[V4L2_CID_EXPOSURE].value, 100);
}

TEST(V4l2AutoExposure, LengthensFramesForLongExposuresAndShortensThemAgain) {
  FakeV4l2 fake;
  give_sensor_of_lines(fake, 9520);
  const auto camera = opened(fake);
  const auto controls = camera->take_exposure();
  ASSERT_TRUE(controls) << controls.error().message;
  EXPECT_NEAR(controls->max_s, 0.9996, 1e-12);  // s: 480 + 9520 - 4 lines
  for (const double wanted_s : {0.01, 0.0496, 0.0497, 0.9996, 0.5, 0.01, 0.3}) {
    EXPECT_NEAR(camera->set_exposure({.exposure_s = wanted_s}).value(), wanted_s, 1e-12);
    const int needed = std::max(20, static_cast<int>(std::lround(wanted_s / 1e-4)) - sensor_lines + 4);
    EXPECT_NEAR(fake.controls[V4L2_CID_VBLANK].value, needed, wanted_s < 0.04 ? 0 : 1) << wanted_s;
  }
  EXPECT_NEAR(camera->set_exposure({.exposure_s = 5}).value(), 0.9996, 1e-12);
  EXPECT_EQ(fake.misuses, 0);
}

TEST(V4l2AutoExposure, StatesTheTimeThatADriverClampsTo) {
  FakeV4l2 fake = camera_with_controls();
  const auto camera = opened(fake);
  ASSERT_TRUE(camera->take_exposure());
  fake.on_set_control = [&](std::uint32_t id) {  // frames of 1/30 s hold no more
    if (id == V4L2_CID_EXPOSURE_ABSOLUTE) fake.controls[id].value = std::min(fake.controls[id].value, 333);
  };
  EXPECT_NEAR(camera->set_exposure({.exposure_s = 0.1}).value(), 0.0333, 1e-12);
}

TEST(V4l2AutoExposure, SaysInOneLineWhatTheDriverLacks) {
  FakeV4l2 none;
  EXPECT_TRUE(has(not_taken(none), "no control of the exposure time"));
  FakeV4l2 fake = camera_with_controls();
  fake.controls[V4L2_CID_EXPOSURE_ABSOLUTE].flags = V4L2_CTRL_FLAG_READ_ONLY;
  EXPECT_TRUE(has(not_taken(fake), "no control of the exposure time"));
  fake = camera_with_controls();
  fake.controls[V4L2_CID_EXPOSURE_AUTO] = {V4L2_EXPOSURE_APERTURE_PRIORITY, 3, 3};
  EXPECT_TRUE(has(not_taken(fake), "cannot be switched off"));
  fake = camera_with_controls();
  fake.on_set_control = [&](std::uint32_t) { fake.controls[V4L2_CID_AUTOGAIN].value = 1; };
  EXPECT_TRUE(has(not_taken(fake, {.gain_codes = codes}), "automatic gain cannot be switched off"));
  fake = camera_with_controls();
  fake.controls.erase(V4L2_CID_ANALOGUE_GAIN);
  EXPECT_TRUE(has(not_taken(fake, {.gain_codes = codes}), "no control of its gain"));
  fake = camera_with_controls();
  const Error beyond = not_taken(fake, {.gain_codes = {{1, 16}, {32, 512}}});
  EXPECT_EQ(beyond.code, ErrorCode::invalid_argument);
  EXPECT_TRUE(has(beyond, "gain code 512"));
  EXPECT_TRUE(has(beyond, "16 to 255"));
  fake.controls[V4L2_CID_ANALOGUE_GAIN].step = 16;
  EXPECT_TRUE(has(not_taken(fake, {.gain_codes = {{1, 17}}}), "in steps of 16"));
}

TEST(V4l2AutoExposure, SaysInOneLineWhatTheDriverRefusesLater) {
  FakeV4l2 fake = camera_with_controls();
  const auto camera = opened(fake, {.gain_codes = codes});
  ASSERT_TRUE(camera->take_exposure());
  fake.on_set_control = [&](std::uint32_t id) {
    if (id == V4L2_CID_ANALOGUE_GAIN) fake.controls[id].value = 40;
  };
  const auto other = camera->set_exposure({.exposure_s = 0.01, .gain = codes[2]});
  ASSERT_FALSE(other);
  EXPECT_TRUE(has(other.error(), "sets gain code 40 where 64 was asked for"));
  fake.on_set_control = nullptr;
  for (const int code : {EIO, EBUSY, EINVAL}) {
    fake.faults[VIDIOC_S_CTRL] = {code};
    const auto refused = camera->set_exposure({.exposure_s = 0.01, .gain = codes[0]});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().where, "/dev/video0");
    EXPECT_EQ(refused.error().message.find('\n'), std::string::npos);
  }
  fake.faults[VIDIOC_S_CTRL] = {ENODEV};
  EXPECT_EQ(camera->set_exposure({.exposure_s = 0.01}).error().code, ErrorCode::not_found);
}

}  // namespace
}  // namespace lowlux::test
