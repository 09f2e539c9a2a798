#include "isp/cli/noise/noise_source.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "calib/noise/sensor_class.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/raw/to_linear.h"
#include "tests/support/frames.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::cli::noise_source_test {
namespace {

using Source = NoiseOrigin::Source;

/// Returns a frame of 384 x 384 pixels of a sensor: even light of so many electrons, or sixteen steps up to 16 times
/// it.
RawFrame frame_of(const SensorModel& sensor, double mean_e, bool is_even, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  RawFrame frame;
  frame.raw = test::bayer_frame(384, 384, BayerPhase::rggb, [&](int x, int y) {
    const double light_e = is_even ? mean_e : mean_e * (1 + (x / 50 + y / 50) % 16);
    std::poisson_distribution<int> photons(light_e);
    const double charge_e = photons(engine) + sensor.read_noise_e * normal(engine);
    const double dn = sensor.black_level_dn + sensor.system_gain_dn_per_e * charge_e;
    return static_cast<int>(std::lround(std::clamp(dn, 0.0, sensor.white_level_dn)));
  });
  frame.raw.black_tag->pattern_dn = {sensor.black_level_dn};
  frame.raw.white_dn.fill(sensor.white_level_dn);
  return frame;
}

class NoiseSourceOrder : public ::testing::Test {
 protected:
  void SetUp() override {
    automatic_.denoise.mode = isp::DenoiseChoice::Mode::automatic;
    setenv("XDG_DATA_DIRS", scratch_.path().c_str(), 1);
  }
  void TearDown() override { unsetenv("XDG_DATA_DIRS"); }

  void install_darktable(const std::string& json) const {
    const std::string folder = scratch_.file("darktable");
    std::filesystem::create_directories(folder);
    std::ofstream(folder + "/noiseprofiles.json") << json;
  }

  std::optional<NoiseOrigin> found(RawFrame& frame, const std::optional<calib::NoiseFigures>& given = {}) {
    InlineExecutor one;
    const auto origin = find_noise(automatic_, given, frame, one);
    EXPECT_TRUE(origin) << origin.error().message;
    return origin ? *origin : std::nullopt;
  }

  std::optional<Source> source_of(RawFrame& frame) {
    const auto origin = found(frame);
    return origin ? std::optional(origin->source) : std::nullopt;
  }

  test::ScratchDirectory scratch_;
  isp::DevelopOptions automatic_;
  const SensorModel sensor_{.system_gain_dn_per_e = 0.4,
                            .read_noise_e = 4,
                            .full_well_e = 30'000,
                            .bits = 14,
                            .black_level_dn = 512,
                            .white_level_dn = 12'512};
};

constexpr const char* acme_table = R"({"version": 0, "noiseprofiles": [{"maker": "Acme", "models": [{"model": "One",
    "profiles": [{"iso": 100, "a": [1e-5, 3.667e-6, 1e-5], "b": [0, 0, 0]}]}]}]})";

TEST_F(NoiseSourceOrder, IsGivenThenProfileThenFileThenPictureThenWhatIsKnown) {
  install_darktable(acme_table);
  const auto acme = [this](bool is_even) {
    RawFrame frame = frame_of(sensor_, 40, is_even, 1);
    frame.raw.info.make = "Acme";
    frame.raw.info.model = "One";
    frame.raw.info.iso = 100;
    return frame;
  };
  const calib::NoiseFigures given{.gain_dn_per_e = 3, .read_noise_e = 7};
  for (const auto stated : {NoiseProfile::Source::profile, NoiseProfile::Source::file}) {
    RawFrame frame = acme(true);
    frame.noise = NoiseProfile{.scale = {1e-4, 1e-4, 1e-4}, .offset = {1e-8, 1e-8, 1e-8}, .source = stated};
    const auto origin = found(frame);
    ASSERT_TRUE(origin);
    EXPECT_EQ(origin->source, stated == NoiseProfile::Source::profile ? Source::profile : Source::file);
    EXPECT_EQ(frame.noise->scale[1], 1e-4);
    const auto own = found(frame, given);
    ASSERT_TRUE(own);
    EXPECT_EQ(own->source, Source::given);
    EXPECT_NEAR(frame.noise->scale[1] * 12'000, 3, 1e-9);
    EXPECT_NEAR(frame.noise->offset[1] * 12'000 * 12'000, 21 * 21 + 1.0 / 12, 1e-6);
    EXPECT_TRUE(frame.warnings.empty());
  }
  RawFrame stairs = acme(false);
  EXPECT_EQ(source_of(stairs), Source::picture);
  RawFrame even = acme(true);
  EXPECT_EQ(source_of(even), Source::darktable);
  EXPECT_EQ(even.warnings.size(), 1U);
  RawFrame unnamed = acme(true);
  unnamed.raw.info.model = "Two";
  EXPECT_EQ(source_of(unnamed), Source::sensor_class);
  RawFrame raspberry = acme(true);
  raspberry.raw.info.make = "Raspberry Pi";
  raspberry.raw.info.model = "/base/soc/i2c0mux/i2c@1/imx477@1a";
  EXPECT_EQ(source_of(raspberry), Source::raspberry_pi);
}

TEST_F(NoiseSourceOrder, AssumedReadNoiseIsThatOfTheModelWithoutQuantisation) {
  for (const double read_noise_e : {1.5, 4.0, 12.0}) {
    for (const bool is_raspberry : {false, true}) {
      FrameInfo info{.make = "Acme", .model = "Two", .iso = 100};
      if (is_raspberry) info = {.make = "Raspberry Pi", .model = "/base/soc/i2c0mux/i2c@1/imx477@1a", .iso = 100};
      RawDn described = frame_of(sensor_, 40, true, 1).raw;
      described.info = info;
      std::vector<std::string> ignored;
      const NoiseOrigin known = known_noise(described, 12'000, ignored);
      SensorModel sensor = sensor_;
      sensor.system_gain_dn_per_e = known.figures->gain_dn_per_e;  // the image does not contradict what is known
      sensor.read_noise_e = read_noise_e;
      RawFrame frame = frame_of(sensor, 40, true, 1);
      frame.raw.info = info;
      const auto origin = found(frame);
      ASSERT_TRUE(origin && origin->figures);
      EXPECT_EQ(origin->source, is_raspberry ? Source::raspberry_pi : Source::sensor_class);
      const double read_dn2 = frame.noise->offset[1] * 12'000 * 12'000 - 1.0 / 12;
      EXPECT_NEAR(origin->figures->read_noise_e, std::sqrt(read_dn2) / origin->figures->gain_dn_per_e, 1e-6);
      EXPECT_LE(origin->figures->read_noise_factor, known.figures->read_noise_factor);
    }
  }
}

TEST_F(NoiseSourceOrder, SkipsATableThatCannotBeReadWithAWarning) {
  install_darktable("{ not JSON");
  RawFrame frame = frame_of(sensor_, 40, true, 3);
  frame.raw.info.make = "Acme";
  frame.raw.info.model = "One";
  frame.raw.info.iso = 100;
  EXPECT_EQ(source_of(frame), Source::sensor_class);
  ASSERT_EQ(frame.warnings.size(), 2U);
  EXPECT_NE(frame.warnings[0].find("noiseprofiles.json"), std::string::npos) << frame.warnings[0];
}

TEST_F(NoiseSourceOrder, AssumesNothingWhereNoiseStays) {
  RawFrame frame = frame_of(sensor_, 40, true, 4);
  isp::DevelopOptions off_options;
  off_options.denoise.mode = isp::DenoiseChoice::Mode::off;
  InlineExecutor one;
  const auto off = find_noise(off_options, {}, frame, one);
  ASSERT_TRUE(off);
  EXPECT_FALSE(*off);
  EXPECT_FALSE(frame.noise);
  const auto huge = find_noise(automatic_, calib::NoiseFigures{.gain_dn_per_e = 1e-6, .read_noise_e = 1}, frame, one);
  ASSERT_FALSE(huge);  // 1.2e10 electrons at white
  EXPECT_EQ(huge.error().code, ErrorCode::invalid_argument);
}

// Even frames of sensors of a class, and of sensors whose gain is 4 to 16 times above or below that of their class. An
// even frame shows the sum of the noise of light and the read noise, so that the gain is mostly that of the class. The
// frame shows all the same that the class does not fit: then the uncertainty has to cover the gain.
TEST_F(NoiseSourceOrder, StatesAnUncertaintyThatCoversSensorsOutsideTheirClass) {
  constexpr int sensors = 24;
  constexpr double range_dn = 12'000;
  std::mt19937_64 engine(20);
  std::normal_distribution<double> normal;
  const auto log_uniform = [&](double low, double high) {
    return std::exp(std::uniform_real_distribution<double>(std::log(low), std::log(high))(engine));
  };
  for (const bool is_outside : {false, true}) {
    double within_one = 0, within_two = 0, count = 0;
    for (std::uint64_t seed = 1; count < sensors; ++seed) {
      ASSERT_LE(seed, std::uint64_t{20} * sensors) << "images show the noise of nearly all sensors";
      const double iso = log_uniform(100, 6400), class_electrons = 100 / iso * calib::large_sensor_e;
      const double outside = engine() % 2 == 0 ? log_uniform(4, 16) : 1 / log_uniform(4, 16);
      const double ratio = is_outside ? outside : std::exp(std::log(calib::large_sensor_factor) * normal(engine));
      const double electrons = class_electrons / ratio;
      const double read_factor = std::exp(std::log(calib::read_noise_factor) * normal(engine));
      SensorModel sensor = sensor_;
      sensor.system_gain_dn_per_e = range_dn / electrons;
      sensor.read_noise_e = calib::class_read_noise_e(electrons) * read_factor;
      RawFrame frame = frame_of(sensor, log_uniform(1, electrons / 8), true, seed);
      frame.raw.info.iso = iso;
      const auto origin = found(frame);
      ASSERT_TRUE(origin && origin->figures);
      if (origin->source != Source::sensor_class) continue;  // the image showed its noise
      const double error = std::abs(std::log(origin->figures->gain_dn_per_e / sensor.system_gain_dn_per_e));
      within_one += error < std::log(origin->figures->gain_factor) ? 1 : 0;
      within_two += error < 2 * std::log(origin->figures->gain_factor) ? 1 : 0;
      count += 1;
    }
    std::printf("sensors %s their class: gain within the stated factor in %.0f %%, within its square in %.0f %%\n",
                is_outside ? "outside" : "of", 100 * within_one / count, 100 * within_two / count);
    if (!is_outside) {
      EXPECT_GT(within_one / count, 2.0 / 3 - 3 * std::sqrt(2.0 / 9 / sensors));
    }
    EXPECT_GT(within_two / count, 0.7);
  }
}

// Sources and errors over simulated sensors whose figures were measured by others, as a table: a dark even wall, whose
// gain no image shows, and steps of light. The noise that is assumed has to be that of the image where it shows it.
TEST_F(NoiseSourceOrder, IsNearTheTruthOnSimulatedSensors) {
  std::printf("%-18s %-10s %-7s %-13s %9s %9s %9s\n", "sensor", "setting", "scene", "source", "gain", "stated +-",
              "std");
  for (const std::string_view name : isp::sensor_names()) {
    if (!name.starts_with("ELD_") && name != "RaspberryPi_HQ") continue;
    const auto settings = isp::gain_settings(name);
    const auto sensor = isp::sensor_named(name, settings.back(), {});
    const auto used = sensor ? sensor : isp::sensor_named(name, settings.front(), {});
    ASSERT_TRUE(used) << used.error().message;
    for (const bool is_even : {true, false}) {
      RawFrame frame = frame_of(used->model, 20, is_even, 5);
      frame.raw.info.iso = used->iso;
      if (name == "RaspberryPi_HQ") {
        frame.raw.info.make = "Raspberry Pi";
        frame.raw.info.model = "imx477";
        frame.raw.info.iso = 100;
      }
      const auto origin = found(frame);
      ASSERT_TRUE(origin && origin->figures);
      EXPECT_EQ(origin->is_adjusted, is_even);
      const double gain = origin->figures->gain_dn_per_e / used->model.system_gain_dn_per_e;
      const double range_dn = used->model.white_level_dn - used->model.black_level_dn;
      const double k = used->model.system_gain_dn_per_e;
      const double truth_dn2 = k * k * (20 + std::pow(used->model.read_noise_e, 2)) + 1.0 / 12;
      const double model_dn2 =
          (frame.noise->scale[1] * 20 * k / range_dn + frame.noise->offset[1]) * range_dn * range_dn;
      const double std = std::sqrt(model_dn2 / truth_dn2);
      std::printf("%-18s %-10s %-7s %-13s %9.3f %9.3f %9.3f\n", std::string(name).c_str(), used->gain_setting.c_str(),
                  is_even ? "even" : "steps", std::string(name_of(origin->source)).c_str(), gain,
                  origin->figures->gain_factor, std);
      EXPECT_EQ(origin->source == Source::picture, !is_even) << name;
      EXPECT_LT(std::abs(std::log(gain)), 3 * std::log(origin->figures->gain_factor)) << name;
      EXPECT_NEAR(std, 1, 0.05) << name;  // 147,456 pixels: 0.2 % of noise, and 2 % for the choice of flat samples
    }
  }
}

}  // namespace
}  // namespace lowlux::cli::noise_source_test
