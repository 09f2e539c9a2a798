#include "calib/dark/master_dark.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "calib/dark/dark_frame.h"
#include "calib/dark/dark_library.h"
#include "tests/sensor_bench/sensor_bench.h"

namespace lowlux::calib {
namespace {

using test::SensorBench;

constexpr isp::Exposure exposure{4, 20};

DarkGroup darks_of(const SensorBench& bench, int frames, std::uint32_t first = 100) {
  DarkLibrary library;
  for (int i = 0; i < frames; ++i) EXPECT_TRUE(library.add(bench.frame(exposure, first + i)));
  return std::move(library.groups().front());
}

// Mean of frames as another program writes it: no variances, and whole codes or floats.
DarkGroup master_of(const DarkGroup& frames, bool rounded) {
  DarkGroup out{.setting = frames.setting, .frames = 1, .rounded = rounded};
  out.mean_dn = frames.mean_dn.clone();
  out.variance_dn2 = Plane<float>(frames.mean_dn.width(), frames.mean_dn.height());
  std::fill_n(out.variance_dn2.data(), out.variance_dn2.size(), 0.0f);
  float* const first = out.mean_dn.data();
  if (rounded) std::transform(first, first + out.mean_dn.size(), first, [](float v) { return std::round(v); });
  return out;
}

// EMVA 1288: variance of a code = K^2 sigma_d^2 + 1/12 + K (level - pedestal).
DarkNoiseModel noise_of(const SensorModel& sensor) {
  const double k = sensor.system_gain_dn_per_e;
  DarkNoiseModel out;
  out.gain_dn_per_e.fill(k);
  // Rows change from frame to frame, too; neighbours in a row share that, so that it is not in their differences.
  out.read_variance_dn2.fill(k * k * sensor.read_noise_e * sensor.read_noise_e + rounding_dn2);
  return out;
}

PerSite<double> pedestal_of(const SensorModel& sensor) {
  return {sensor.black_level_dn, sensor.black_level_dn, sensor.black_level_dn, sensor.black_level_dn};
}

RawDn picture_of(SensorBench bench, double rate_e_per_s, std::uint32_t index = 7) {
  bench.rate_e_per_s = {rate_e_per_s, rate_e_per_s, rate_e_per_s};
  return bench.frame(exposure, index);
}

const std::vector<SensorModel> sensors{test::modern_small(), test::hot_sensor()};

TEST(MasterDark, TheNumberOfExposuresFollowsFromTheNoiseInSpiteOfPatternAndHotPixels) {
  for (const SensorModel& sensor : sensors) {
    const SensorBench bench{.sensor = sensor, .width = 512, .height = 512};
    const RawDn picture = picture_of(bench, 5);
    for (const int frames : {1, 4, 16}) {
      const DarkGroup darks = darks_of(bench, frames);
      for (const bool rounded : {false, true}) {
        const double found = estimate_exposures(master_of(darks, rounded || frames == 1), picture, noise_of(sensor),
                                                pedestal_of(sensor));
        // Standard error: 65,536 pairs of half a difference, and the product with the image's noise, of about 5 times
        // the variance of one dark exposure; relative to V / n. A tenth is for the tails of charge of single pixels.
        const double error = std::sqrt((2 + 5.0 * frames) / 65536);
        EXPECT_NEAR(found, frames, frames * (5 * error + 0.1) + 0.5) << sensor.name << ", rounded " << rounded;
      }
    }
  }
}

/// Several masters as raw files, each the rounded mean of so many frames.
DarkGroup masters_of(const SensorBench& bench, int files, int frames) {
  DarkLibrary library;
  for (int file = 0; file < files; ++file) {
    const DarkGroup darks = darks_of(bench, frames, static_cast<std::uint32_t>(100 + 1000 * file));
    RawDn raw = bench.frame(exposure, 0);
    for (int y = 0; y < raw.dn.height(); ++y) {
      for (int x = 0; x < raw.dn.width(); ++x) {
        raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(darks.mean_dn.at(x, y)));
      }
    }
    EXPECT_TRUE(library.add(raw));
  }
  return std::move(library.groups().front());
}

TEST(MasterDark, TheNumberOfExposuresOfSeveralMastersFollowsFromTheNoiseBetweenThem) {
  SensorModel sensor = test::hot_sensor();
  sensor.system_gain_dn_per_e = 2;  // the means of 16 frames scatter by more than half a code
  sensor.full_well_e /= 3;
  const SensorBench bench{.sensor = sensor, .width = 128, .height = 128};
  const RawDn picture = picture_of(bench, 5);
  DarkNoiseModel tripled = noise_of(sensor);
  for (double& gain : tripled.gain_dn_per_e) gain *= 3;
  for (double& variance : tripled.read_variance_dn2) variance *= 3;
  for (const int files : {2, 3, 5}) {
    for (const int frames : {1, 2, 5, 8, 16}) {
      const DarkGroup group = masters_of(bench, files, frames);
      const double found = estimate_exposures_between(group, picture, noise_of(sensor), pedestal_of(sensor));
      if (frames < 4) {
        EXPECT_EQ(found, 1) << frames << " exposures in " << files << " files";
        if (frames > 1) continue;
        EXPECT_EQ(estimate_exposures_between(group, picture, tripled, pedestal_of(sensor)), 1) << "of a wrong model";
        continue;
      }
      // The variance between the files, of 16,384 pixels, is known to sqrt(2 / n); rounding adds 1/12 DN^2 to it, and a
      // tenth is for the charge of single pixels, as above.
      const double error = std::sqrt(2 / (16384.0 * (files - 1)));
      EXPECT_NEAR(found, frames, frames * (5 * error + 0.1) + 0.5) << files << " files";
    }
  }
}

TEST(MasterDark, OfAnotherExposureTimeThePatternCountsAsNoiseSoThatTheNumberIsALowerBound) {
  const SensorBench bench{.sensor = test::hot_sensor(), .width = 256, .height = 256};
  const DarkGroup master = master_of(darks_of(bench, 16), false);
  RawDn picture = picture_of(bench, 5);
  picture.info.exposure_s = 2;
  const double bound = estimate_exposures(master, picture, noise_of(bench.sensor), pedestal_of(bench.sensor));
  EXPECT_GE(bound, 1);
  EXPECT_LT(bound, 8);  // a fifth of 16 e- is the spread of the charge: 10 e-^2, the noise of 16 exposures 1.3 e-^2
}

TEST(MasterDark, GivesTheDarkFrameOfTheFramesItIsTheMeanOf) {
  for (const SensorModel& sensor : sensors) {
    const SensorBench bench{.sensor = sensor, .width = 256, .height = 256};
    const RawDn picture = picture_of(bench, 5);
    const DarkGroup darks = darks_of(bench, 16);
    const auto of_frames = make_dark_frame({&darks, 1}, picture, {});
    for (const bool rounded : {false, true}) {
      const DarkGroup master = master_of(darks, rounded);
      const DarkRequest request{.noise_fraction = 0.2,
                                .pedestal_dn = pedestal_of(sensor),
                                .noise = noise_of(sensor),
                                .exposures_per_file = {16}};
      const auto dark = make_dark_frame({&master, 1}, picture, request);
      ASSERT_TRUE(of_frames && dark);
      EXPECT_EQ(dark->frames, 16);
      EXPECT_EQ(dark->files, 1);
      EXPECT_FALSE(dark->estimated);
      EXPECT_EQ(dark->pattern_fraction, 1);
      EXPECT_TRUE(dark->warnings.empty());
      const double half_code = rounded ? 0.5 : 0;
      for (std::size_t i = 0; i < dark->dn.size(); ++i) {
        ASSERT_NEAR(dark->dn.data()[i], of_frames->dn.data()[i], half_code);
      }
      double one_dn2 = 0;
      for (int site = 0; site < 4; ++site) {
        // The mean variance of 16 frames is known to sqrt(2 / 15 / 16384) = 0.3 %; a tenth is for charge that differs.
        EXPECT_NEAR(dark->noise_std_dn[site], of_frames->noise_std_dn[site], 0.1 * of_frames->noise_std_dn[site]);
        one_dn2 += dark->noise_std_dn[site] * dark->noise_std_dn[site] / 4;
      }
      EXPECT_NEAR(dark->noise_fraction, 1.0 / 16 + (rounded ? rounding_dn2 / one_dn2 : 0), 1e-3);
    }
  }
}

TEST(MasterDark, WithoutANoiseModelItIsSubtractedAsASingleDarkAndNotRefused) {
  const SensorBench bench{.sensor = test::modern_small(), .width = 256, .height = 256};
  const DarkGroup master = master_of(darks_of(bench, 64), false);
  const RawDn picture = picture_of(bench, 0.5);
  const auto dark = make_dark_frame({&master, 1}, picture, {});
  ASSERT_TRUE(dark);
  EXPECT_EQ(dark->frames, 1);
  EXPECT_EQ(dark->warnings.size(), 1U);
  EXPECT_TRUE(check_below_picture(picture, *dark));
  SensorBench lit = bench;
  lit.rate_e_per_s = {100, 100, 100};  // 400 e- more than the image has
  const DarkGroup bright = master_of(darks_of(lit, 64), false);
  const auto refused = make_dark_frame({&bright, 1}, picture, {});
  ASSERT_TRUE(refused);
  EXPECT_FALSE(check_below_picture(picture, *refused));
}

TEST(MasterDark, HotPixelsAreListedForRepairByTheNoiseOfTheirCharge) {
  SensorBench bench{.sensor = test::hot_sensor(), .width = 256, .height = 256};
  bench.sensor.hot_pixel_current_e_per_s = 2000;
  const DarkGroup darks = darks_of(bench, 16), master = master_of(darks, true);
  const RawDn picture = picture_of(bench, 5);
  const auto of_frames = make_dark_frame({&darks, 1}, picture, {});
  const auto dark = make_dark_frame(
      {&master, 1}, picture,
      {.pedestal_dn = pedestal_of(bench.sensor), .noise = noise_of(bench.sensor), .exposures_per_file = {16}});
  ASSERT_TRUE(of_frames && dark);
  int shared = 0;
  for (const DefectRect& d : dark->unknown) {
    shared += std::ranges::any_of(of_frames->unknown, [&](const DefectRect& o) { return o.x == d.x && o.y == d.y; });
  }
  EXPECT_GT(shared, 50);
  // The frames' own measured variances add pixels, by chance: a chi-square of 15 degrees.
  // The gain they give differs from the nominal one by about 1 %, which moves a few pixels over the limit.
  EXPECT_GE(shared, 0.97 * static_cast<double>(dark->unknown.size()));
  EXPECT_GT(shared, 0.7 * static_cast<double>(of_frames->unknown.size()));
}

TEST(MasterDark, OfAFileWithoutSettingsHasThoseOfTheImage) {
  const SensorBench bench{.sensor = test::modern_small(), .width = 64, .height = 48};
  RawDn picture = picture_of(bench, 5);
  picture.active = {4, 2, 56, 44};
  Plane<float> readout(64, 48);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) readout.at(x, y) = static_cast<float>(bench.sensor.black_level_dn + x + 0.01 * y);
  }
  const auto pedestal = pedestal_of(bench.sensor);
  const auto cut = group_of_master(readout, false, {}, picture, pedestal);
  ASSERT_TRUE(cut) << cut.error().message;
  EXPECT_EQ(cut->setting, *setting_of(picture));
  EXPECT_EQ(cut->mean_dn.at(0, 0), readout.at(4, 2));
  EXPECT_EQ(cut->mean_dn.at(55, 43), readout.at(59, 45));
  FrameInfo stated;
  stated.iso = 12345;
  EXPECT_EQ(group_of_master(readout, false, stated, picture, pedestal)->setting.iso, 12345);
  const Plane<float> odd(63, 48);
  EXPECT_NE(group_of_master(odd, false, {}, picture, pedestal).error().message.find("63 x 48"), std::string::npos);
  for (std::size_t i = 0; i < readout.size(); ++i) readout.data()[i] -= static_cast<float>(bench.sensor.black_level_dn);
  const auto without_bias = group_of_master(readout, false, {}, picture, pedestal);
  ASSERT_FALSE(without_bias);
  EXPECT_NE(without_bias.error().message.find("bias"), std::string::npos);
  EXPECT_TRUE(group_of_master(readout, false, {}, picture, std::nullopt));
}

TEST(MasterDark, ANumberOfExposuresOutOfRangeIsRefused) {
  const SensorBench bench{.sensor = test::modern_small(), .width = 64, .height = 48};
  const DarkGroup master = master_of(darks_of(bench, 2), true);
  for (const double count : {0.5, -1.0, 1e9, std::nan("")}) {
    const auto dark = make_dark_frame({&master, 1}, picture_of(bench, 5), {.exposures_per_file = {count}});
    ASSERT_FALSE(dark) << count;
    EXPECT_EQ(dark.error().code, ErrorCode::invalid_argument);
  }
}

}  // namespace
}  // namespace lowlux::calib
