#pragma once

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "capture/v4l2/v4l2_source.h"
#include "isp/base/packed/raw_format.h"
#include "tests/support/error_words.h"
#include "tests/support/fake_v4l2.h"

namespace lowlux::test {

inline constexpr RawFormat srggb10{10, RawPacking::little16, SensorLayout::bayer, BayerPhase::rggb};

inline std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

/// The fake's camera; ends the test where it does not open.
inline std::unique_ptr<capture::Camera> opened(FakeV4l2& fake, const capture::V4l2Options& options = {}) {
  auto camera = capture::open_v4l2("/dev/video0", options, fake.system());
  if (!camera) ADD_FAILURE() << camera.error().message;
  return std::move(camera).value();
}

/// Lines of the sensor that give_sensor_of_lines simulates.
inline constexpr int sensor_lines = 480;

/// Gives the driver the controls of a sensor: lines of 100 us, 20 to `max_blanking` lines of blanking, and no exposure
/// longer than lines and blanking less four lines.
inline void give_sensor_of_lines(FakeV4l2& fake, int max_blanking) {
  fake.controls = {{V4L2_CID_EXPOSURE, {4, 4, sensor_lines + 16}},
                   {V4L2_CID_VBLANK, {20, 20, max_blanking}},
                   {V4L2_CID_HBLANK, {68, 68, 68}}};
  fake.pixel_rate_hz = 1'000'000;  // (32 + 68) / 1 MHz
  fake.on_set_control = [&fake](std::uint32_t id) {
    auto& exposure = fake.controls[V4L2_CID_EXPOSURE];
    if (id == V4L2_CID_VBLANK) exposure.maximum = sensor_lines + fake.controls[id].value - 4;
    exposure.value = std::min(exposure.value, exposure.maximum);
  };
}

/// The error of opening, after which nothing may be left open.
inline Error refused(FakeV4l2& fake, const capture::V4l2Options& options = {}) {
  const auto camera = capture::open_v4l2("/dev/video0", options, fake.system());
  EXPECT_EQ(fake.misuses, 0);
  EXPECT_EQ(fake.open_files, 0);
  if (camera) {
    ADD_FAILURE() << "opened";
    return {};
  }
  EXPECT_EQ(camera.error().where, "/dev/video0");
  EXPECT_FALSE(camera.error().message.ends_with('.'));
  return camera.error();
}

/// The same, streaming.
inline std::unique_ptr<capture::Camera> started(FakeV4l2& fake, const capture::V4l2Options& options = {}) {
  auto camera = opened(fake, options);
  const auto ok = camera->start();
  EXPECT_TRUE(ok) << ok.error().message;
  return camera;
}

/// That all was closed, unmapped and handed back, and no call was one that no driver would take.
inline void expect_clean(const FakeV4l2& fake) {
  EXPECT_EQ(fake.open_files, 0);
  EXPECT_EQ(fake.open_maps, 0);
  EXPECT_EQ(fake.misuses, 0);
  EXPECT_EQ(fake.accesses, 0);
}

}  // namespace lowlux::test
