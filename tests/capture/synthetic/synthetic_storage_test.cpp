#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "capture/synthetic/synthetic_source.h"
#include "isp/model/sensor/scene_luminance.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/model/spectrum/spectral_response.h"
#include "tests/support/sensor_frames.h"
#include "tests/support/synthetic_camera.h"

// What a synthetic camera's frames tell of themselves, as a DNG would.
namespace lowlux::capture {
namespace {

using isp::Effect;
using isp::NoiseSourceSet;

SyntheticSource made(Scene scene, const isp::NamedSensor& sensor, const SyntheticOptions& options) {
  auto source = test::source_of(std::move(scene), sensor, options);
  EXPECT_TRUE(source) << (source ? "" : source.error().message);
  return *std::move(source);
}

SyntheticOptions with(NoiseSourceSet effects, double time_s = 1) {
  SyntheticOptions options;
  options.exposure.time_s = time_s;
  options.effects.effects = effects;
  return options;
}

/// Codes of green less black, over white less black.
std::vector<double> green_fractions(const RawFrame& frame) {
  const double black = frame.raw.black_tag->at(0, 0), range = frame.raw.white_dn[1] - black;
  std::vector<double> out;
  for (int y = 0; y < frame.raw.dn.height(); ++y) {
    for (int x = 0; x < frame.raw.dn.width(); ++x) {
      if (colour_at(frame.raw.phase, x, y) == CfaColour::green) {
        out.push_back((frame.raw.dn.at(x, y) - black) / range);
      }
    }
  }
  return out;
}

TEST(SyntheticStorage, WholeCodesAreStoredAsTheyAre) {
  InlineExecutor executor;
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.gain_setting = "ISO 1600";
  const SyntheticSource source =
      made(*flat_scene(test::setup_of(32, 32, 30)), sensor, with(NoiseSourceSet::all(), 0.5));
  const RawFrame frame = source.frame(0, executor);
  EXPECT_EQ(frame.raw.black_tag->at(5, 7), 512);
  EXPECT_EQ(frame.raw.white_dn, (std::array<double, 3>{512 + 15000, 512 + 15000, 512 + 15000})) << "the full well's";
  EXPECT_EQ(frame.raw.info.make, "lowlux");
  EXPECT_EQ(frame.raw.info.model, "plain ISO 1600");
  EXPECT_EQ(frame.raw.info.exposure_s, 0.5);
  EXPECT_EQ(frame.raw.info.temperature_c, 20);
  EXPECT_EQ(frame.raw.info.f_number, 2);
  EXPECT_EQ(frame.raw.default_crop, (Rect{0, 0, 32, 32}));
  const Plane<float> dn = source.frame_dn(0, executor);
  for (std::size_t i = 0; i < dn.size(); ++i) EXPECT_EQ(frame.raw.dn.data()[i], dn.data()[i]);
}

TEST(SyntheticStorage, TheModelNamesGainSettingsThatTheIsoDoesNotState) {
  InlineExecutor executor;
  const auto info_of = [&](const isp::NamedSensor& sensor, const isp::Optics& optics) {
    const auto source = SyntheticSource::of(*flat_scene(test::setup_of(8, 8, 1)), sensor,
                                            *isp::spectral_response(sensor, optics), {}, executor);
    EXPECT_TRUE(source) << (source ? "" : source.error().message);
    return source->frame(0, executor).raw.info;
  };
  isp::SensorFigures one_iso;
  one_iso.iso = 400;
  for (const std::string gain : {"ISO 100", "ISO 1600"}) {
    const auto sensor = isp::sensor_named("ELD_NikonD850", gain, {});
    ASSERT_TRUE(sensor) << sensor.error().message;
    const FrameInfo info = info_of(*sensor, {2});
    EXPECT_EQ(info.model, "ELD_NikonD850");
    EXPECT_NEAR(*info.iso, *sensor->iso, 0.01) << "whole numbers are stored";
    EXPECT_EQ(info_of(*sensor, {2, 100.0}).model, "ELD_NikonD850 " + gain);
    EXPECT_EQ(info_of(*isp::sensor_named("ELD_NikonD850", gain, one_iso), {2}).model, "ELD_NikonD850 " + gain);
  }
  const auto other = isp::sensor_named("HWK4123_low_gain", "", {});
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_EQ(info_of(*other, {2, 100.0}).model, "HWK4123_low_gain 1x");
}

TEST(SyntheticStorage, WhiteIsTheConverterWhereThatSaturatesFirst) {
  InlineExecutor executor;
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.system_gain_dn_per_e = 2;
  const RawFrame frame =
      made(*flat_scene(test::setup_of(8, 8, 1000)), sensor, with(NoiseSourceSet::all())).frame(0, executor);
  EXPECT_EQ(frame.raw.white_dn[0], 16383);
  EXPECT_EQ(frame.raw.dn.at(3, 3), 16383);
}

TEST(SyntheticStorage, SixteenBitsKeepTheFractionsOfWhatIsNotQuantised) {
  InlineExecutor executor;
  const isp::NamedSensor sensor = test::plain_sensor();
  const SyntheticSource source =
      made(*flat_scene(test::setup_of(64, 64, 30)), sensor, with(NoiseSourceSet::all().without(Effect::quantisation)));
  const RawFrame frame = source.frame(1, executor);
  const Plane<float> dn = source.frame_dn(1, executor);
  const double scale = frame.raw.black_tag->at(0, 0) / 512;
  EXPECT_EQ(scale, 4) << "65535 / 16383, whole";
  EXPECT_EQ(frame.raw.white_dn[2], scale * (512 + 15000));
  for (std::size_t i = 0; i < dn.size(); ++i) EXPECT_NEAR(frame.raw.dn.data()[i] / scale, dn.data()[i], 0.5 / scale);
}

TEST(SyntheticStorage, EffectsNoneStoresTheMeanItself) {
  InlineExecutor executor;
  const SyntheticSource source = made(*flat_scene(test::setup_of(16, 16, 30)), test::plain_sensor(), with({}));
  const RawFrame frame = source.frame(0, executor);
  const double scale = frame.raw.black_tag->at(0, 0) / 512;
  EXPECT_GT(scale, 1);
  const double signal_dn = 0.5 * source.signal_e(executor).plane[1].at(1, 0);
  for (const double fraction : green_fractions(frame)) {
    EXPECT_NEAR(fraction * 15000, signal_dn, 0.5 / scale + 1e-5 * signal_dn) << "half a stored code, and float";
  }
}

TEST(SyntheticStorage, ARaisedPedestalKeepsNegativeValuesWhereNothingClips) {
  InlineExecutor executor;
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.black_level_dn = 0;
  sensor.model.read_noise_e = 6;
  sensor.model.row_noise_e = 2;
  sensor.model.column_noise_e = 1;
  for (const NoiseSourceSet kept : {NoiseSourceSet::all().without(Effect::clipping),
                                    NoiseSourceSet::all().without(Effect::clipping).without(Effect::quantisation)}) {
    const SyntheticSource source = made(*dark_scene(test::setup_of(256, 256, 1)), sensor, with(kept));
    const RawFrame frame = source.frame(0, executor);
    const Plane<float> dn = source.frame_dn(0, executor);
    const double black = frame.raw.black_tag->at(0, 0);
    const double scale = (frame.raw.white_dn[0] - black) / 15000;
    EXPECT_GE(black / scale, 8 * 0.5 * std::sqrt(36 + 4 + 1.0)) << "eight standard deviations";
    EXPECT_LT(*std::min_element(dn.data(), dn.data() + dn.size()), -8);
    for (std::size_t i = 0; i < dn.size(); ++i) {
      ASSERT_NEAR((frame.raw.dn.data()[i] - black) / scale, dn.data()[i], 0.5 / scale + 1e-4);
    }
  }
  // With clipping the same sensor loses them.
  const RawFrame clipped =
      made(*dark_scene(test::setup_of(64, 64, 1)), sensor, with(NoiseSourceSet::all())).frame(0, executor);
  EXPECT_EQ(clipped.raw.black_tag->at(0, 0), 0);
  EXPECT_GT(std::count(clipped.raw.dn.data(), clipped.raw.dn.data() + clipped.raw.dn.size(), 0), 64 * 64 / 3);
}

TEST(SyntheticStorage, ASensorWithAPedestalKeepsItsOwn) {
  InlineExecutor executor;
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.read_noise_e = 6;
  const RawFrame frame =
      made(*dark_scene(test::setup_of(16, 16, 1)), sensor, with(NoiseSourceSet::all().without(Effect::clipping)))
          .frame(0, executor);
  EXPECT_EQ(frame.raw.black_tag->at(0, 0), 512);
}

TEST(SyntheticStorage, TheNoiseProfileIsTheVarianceOfFlats) {
  InlineExecutor executor;
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.read_noise_e = 5;
  sensor.model.dark_current_e_per_s.fill(30);
  for (const double luminance_cd_m2 : {0.0, 0.05, 1.0, 40.0}) {
    const RawFrame frame =
        made(*flat_scene(test::setup_of(512, 256, luminance_cd_m2)), sensor, with(NoiseSourceSet::all()))
            .frame(4, executor);
    ASSERT_TRUE(frame.noise);
    const test::SampleMoments m = test::moments_of(green_fractions(frame));
    // The profile at the mean; the mean's own standard error moves it by less than a hundredth of the variance's.
    EXPECT_NEAR(m.variance, frame.noise->scale[1] * m.mean + frame.noise->offset[1], 5.05 * m.variance_error)
        << luminance_cd_m2;
  }
}

TEST(SyntheticStorage, RowNoiseIsInTheProfileToo) {
  InlineExecutor executor;
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.read_noise_e = 3;
  sensor.model.row_noise_e = 4;
  const SyntheticSource source = made(*dark_scene(test::setup_of(2, 20000, 1)), sensor, with(NoiseSourceSet::all()));
  // One green in each row: rows are independent.
  const test::SampleMoments m = test::moments_of(green_fractions(source.frame(0, executor)));
  EXPECT_NEAR(m.variance, source.frame(0, executor).noise->offset[1], 5 * m.variance_error);
}

TEST(SyntheticStorage, SpeedAndExposureAgreeWithTheLuminanceThatSaturates) {
  InlineExecutor executor;
  struct Case {
    double gain_dn_per_e, full_well_e, time_s, f_number;
  };
  // The second has a full well far below the converter's range, the third far above.
  for (const Case& c : {Case{0.5, 30000, 1, 2}, {0.1, 30000, 0.01, 4}, {4, 30000, 8, 1.4}}) {
    isp::NamedSensor sensor = test::plain_sensor();
    sensor.model.system_gain_dn_per_e = c.gain_dn_per_e;
    sensor.model.full_well_e = c.full_well_e;
    SyntheticOptions options = with({}, c.time_s);
    options.f_number = c.f_number;
    const SpectralResponse response = test::response_of(sensor);
    const double saturating_cd_m2 = isp::saturation_luminance_cd_m2(sensor.model, response, c.time_s);
    const double luminance_cd_m2 = 0.3 * saturating_cd_m2;
    const RawFrame frame = made(*flat_scene(test::setup_of(8, 8, luminance_cd_m2)), sensor, options).frame(0, executor);
    const auto told = isp::saturation_luminance_cd_m2(frame.raw.info);
    ASSERT_TRUE(told);
    EXPECT_NEAR(*told / saturating_cd_m2, 1, 1e-12) << "the same formula there and back";
    // A pixel's luminance is its linear fraction of saturation times this: green sees most, under D65.
    for (const double fraction : green_fractions(frame)) EXPECT_NEAR(fraction * *told / luminance_cd_m2, 1, 0.002);
  }
}

TEST(SyntheticStorage, AWhiteThatSaturatesReadsWhite) {
  InlineExecutor executor;
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.system_gain_dn_per_e = 0.1;  // 30000 e- are 3000 of 15871 codes
  const double saturating_cd_m2 = isp::saturation_luminance_cd_m2(sensor.model, test::response_of(sensor), 1);
  const RawFrame frame =
      made(*flat_scene(test::setup_of(16, 16, 1.5 * saturating_cd_m2)), sensor, with(NoiseSourceSet::all()))
          .frame(0, executor);
  for (const double fraction : green_fractions(frame)) EXPECT_EQ(fraction, 1);
}

TEST(SyntheticStorage, TheNeutralIsTheColourOfTheScenesWhite) {
  InlineExecutor executor;
  for (const char* light : {"D65", "A", "HPS_generic"}) {
    const isp::NamedSensor sensor = test::plain_sensor();
    const RawFrame frame = made(*flat_scene(test::setup_of(8, 8, 10, light)), sensor, with({})).frame(0, executor);
    const Vector3 rate = isp::electron_rate(test::response_of(sensor), *isp::light_named(light));
    const double largest = *std::max_element(rate.begin(), rate.end());
    ASSERT_TRUE(frame.colour.as_shot_neutral);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR((*frame.colour.as_shot_neutral)[k], rate[k] / largest, 1e-12);
    EXPECT_EQ(frame.colour.calibrations.size(), 2u);
  }
}

// Noise of less than a code leaves a mean that depends on the place of the pedestal between codes.
TEST(SyntheticStorage, TheStatedBlackLevelIsTheMeanOfFramesWithoutLight) {
  constexpr std::uint64_t first_seed = 20261130;
  std::mt19937_64 random(first_seed);
  std::uniform_real_distribution<double> pedestal(40, 900), log_noise(std::log(0.02), std::log(5));
  for (int round = 0; round < 40; ++round) {
    isp::NamedSensor sensor = test::plain_sensor();
    SensorModel& m = sensor.model;
    m.quantisation = round % 2 == 0 ? Quantisation::floor : Quantisation::round;
    m.black_level_dn = pedestal(random);
    if (round % 4 >= 2) m.black_level_dn = std::round(m.black_level_dn);
    m.read_noise_e = round < 4 ? 0 : std::exp(log_noise(random)) / m.system_gain_dn_per_e;
    const auto seed = random();
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", pedestal " << m.black_level_dn << " DN, noise "
                                    << m.read_noise_e * m.system_gain_dn_per_e << " DN, "
                                    << (round % 2 == 0 ? "floor" : "round"));
    SyntheticOptions options = with(NoiseSourceSet::all());
    options.seed = seed;
    InlineExecutor executor;
    const RawFrame frame = made(*dark_scene(test::setup_of(256, 128, 1)), sensor, options).frame(0, executor);
    const std::vector<double> codes(frame.raw.dn.data(), frame.raw.dn.data() + frame.raw.dn.size());
    const test::SampleMoments found = test::moments_of(codes);
    // One code in the frame is the least that a rare one can change.
    EXPECT_NEAR(frame.raw.black_tag->at(0, 0), found.mean, 5 * std::max(found.mean_error, 1.0 / 32768));
  }
}

}  // namespace
}  // namespace lowlux::capture
