#include "calib/noise/sensor_class.h"

#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "isp/model/sensor/sensor_db.h"
#include "tests/support/frames.h"

namespace lowlux::calib {
namespace {

RawDn frame_of(double white_dn, std::optional<double> iso) {
  RawDn raw = test::bayer_frame(2, 2, BayerPhase::rggb, [](int, int) { return 0; });
  raw.white_dn.fill(white_dn);
  raw.info.iso = iso;
  return raw;
}

TEST(SensorClass, IsSmallWithShortLensesOrFewBits) {
  RawDn raw = frame_of(16383, 100);
  EXPECT_EQ(class_noise(raw, 1000).kind, SensorClass::large);
  raw.info.focal_length_mm = 4.2;
  EXPECT_EQ(class_noise(raw, 1000).kind, SensorClass::small);
  raw.info.focal_length_mm = 50;
  EXPECT_EQ(class_noise(raw, 1000).kind, SensorClass::large);
  EXPECT_EQ(class_noise(frame_of(1023, 100), 1000).kind, SensorClass::small);
  EXPECT_EQ(class_noise(frame_of(1024, 100), 1000).kind, SensorClass::large);
}

TEST(SensorClass, HasElectronsInverseToTheIso) {
  const auto electrons = [](std::optional<double> iso) {
    return 1000 / class_noise(frame_of(16383, iso), 1000).figures.gain_dn_per_e;
  };
  EXPECT_DOUBLE_EQ(electrons(100), large_sensor_e);
  EXPECT_DOUBLE_EQ(electrons(1600), large_sensor_e / 16);
  EXPECT_DOUBLE_EQ(electrons(50), 2 * large_sensor_e);
  EXPECT_DOUBLE_EQ(electrons(1), 2 * large_sensor_e);
  EXPECT_DOUBLE_EQ(electrons(std::nullopt), large_sensor_e / 4);
  EXPECT_GT(class_noise(frame_of(16383, {}), 1000).figures.gain_factor, large_sensor_factor);
}

// Cameras whose figures were measured by others, at ISO 100, 400, 1600 and 6400. The prior was chosen with such data in
// view: this shows that its uncertainty is the scatter of cameras, neither much less nor much more.
TEST(SensorClass, IsOffByItsStatedUncertaintyOverMeasuredCameras) {
  double gain_square = 0, read_square = 0;
  int settings = 0;
  for (const std::string_view name : isp::sensor_names()) {
    if (!name.starts_with("ELD_")) continue;
    for (const std::string_view gain : isp::gain_settings(name)) {
      const auto sensor = isp::sensor_named(name, gain, {});
      ASSERT_TRUE(sensor) << sensor.error().message;
      const SensorModel& model = sensor->model;
      const auto noise =
          class_noise(frame_of(model.white_level_dn, sensor->iso), model.white_level_dn - model.black_level_dn);
      const auto& f = noise.figures;
      gain_square += std::pow(std::log(f.gain_dn_per_e / model.system_gain_dn_per_e) / std::log(f.gain_factor), 2);
      read_square += std::pow(std::log(f.read_noise_e / model.read_noise_e) / std::log(f.read_noise_factor), 2);
      ++settings;
    }
  }
  ASSERT_GE(settings, 10);
  RecordProperty("gain", std::to_string(std::sqrt(gain_square / settings)));
  RecordProperty("read", std::to_string(std::sqrt(read_square / settings)));
  // Five cameras are independent, their settings are not: the rms of five normal deviates is within 0.31 and 1.78 in
  // 99.8 of 100 cases (chi-square of 5 degrees of freedom: 0.48 to 15.9 for p = 0.007 on either side).
  EXPECT_GT(std::sqrt(gain_square / settings), 0.31);
  EXPECT_LT(std::sqrt(gain_square / settings), 1.78);
  EXPECT_GT(std::sqrt(read_square / settings), 0.31);
  EXPECT_LT(std::sqrt(read_square / settings), 1.78);
}

}  // namespace
}  // namespace lowlux::calib
