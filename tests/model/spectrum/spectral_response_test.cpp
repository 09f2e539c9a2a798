#include "isp/model/spectrum/spectral_response.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <string_view>

#include "isp/model/sensor/noise_budget.h"
#include "isp/model/sensor/photon.h"
#include "isp/model/spectrum/cie_data.h"
#include "tests/support/numbers.h"

namespace lowlux::isp {
namespace {

using test::inf;
using test::nan;

double largest(const Vector3& v) { return *std::max_element(v.begin(), v.end()); }

double peak(const SpectralResponse& response) {
  double value = 0;
  for (const Spectrum& channel : response.quantum_efficiency) {
    value = std::max(value, std::ranges::max(channel.values()));
  }
  return value;
}

TEST(SpectralResponse, OfTheThesisFillsItsWellWithAHundredCandelas) {
  const NamedSensor thesis = *sensor_named("thesis", "", {});
  const auto response = spectral_response(thesis, {});
  ASSERT_TRUE(response);
  const Spectrum d65 = *light_named("D65");
  // 255 DN / 0.028334 are 8999.8 e-; the gain has five digits.
  EXPECT_NEAR(largest(electron_rate(*response, *radiance_of(d65, 100))), 9000, 0.5);
  EXPECT_NEAR(largest(electron_rate(*response, *radiance_of(d65, 0.1))), 9, 5e-4);
  EXPECT_EQ(response->quantum_efficiency[1].wavelengths_nm()[1], 384);
}

NamedSensor nikon() { return *sensor_named("ELD_NikonD850", "ISO 1600", {}); }

TEST(SpectralResponse, TheLuminanceGivenIsTheOneThatFillsAPixel) {
  for (const double white_cd_m2 : {0.01, 3.0, 1e5}) {
    const NamedSensor sensor = nikon();
    const auto response = spectral_response(sensor, {2, white_cd_m2});
    ASSERT_TRUE(response);
    const Vector3 rate = electron_rate(*response, *radiance_of(*light_named("D65"), white_cd_m2));
    EXPECT_NEAR(largest(rate) / saturation_charge_e(sensor.model), 1, 1e-12);
    EXPECT_NEAR(saturation_luminance_cd_m2(sensor.model, *response, 1) / white_cd_m2, 1, 1e-12);
    EXPECT_NEAR(saturation_luminance_cd_m2(sensor.model, *response, 0.25) / white_cd_m2, 4, 1e-11);
  }
}

TEST(SpectralResponse, PixelPitchAndPeakEfficiencyMakeTheEtendueOfAnIdealLens) {
  NamedSensor sensor = nikon();
  sensor.pixel_pitch_um = 4.35;
  sensor.peak_quantum_efficiency = 0.6;
  const auto response = spectral_response(sensor, {1.4, {}});
  ASSERT_TRUE(response);
  EXPECT_NEAR(response->etendue_m2_sr / (4.35e-6 * 4.35e-6 * std::numbers::pi / (4 * 1.4 * 1.4)), 1, 1e-14);
  EXPECT_NEAR(peak(*response), 0.6, 1e-15);
  // Twice the f-number, a quarter of the light.
  EXPECT_NEAR(spectral_response(sensor, {2.8, {}})->etendue_m2_sr / response->etendue_m2_sr, 0.25, 1e-14);
}

TEST(SpectralResponse, TheSpeedSaysWhatSaturatesAndTheLuminanceGivenComesBeforeAll) {
  NamedSensor sensor = nikon();
  ASSERT_EQ(sensor.iso, 1600);
  const auto by_speed = spectral_response(sensor, {2, {}});
  ASSERT_TRUE(by_speed);
  EXPECT_NEAR(saturation_luminance_cd_m2(sensor.model, *by_speed, 1) / (78 * 4 / (0.65 * 1600)), 1, 1e-12);
  EXPECT_EQ(peak(*by_speed), assumed_peak_quantum_efficiency);
  sensor.pixel_pitch_um = 4;
  sensor.peak_quantum_efficiency = 0.5;
  EXPECT_NEAR(saturation_luminance_cd_m2(sensor.model, *spectral_response(sensor, {2, 17.0}), 1), 17, 1e-10);
}

TEST(SpectralResponse, ASpeedThatIsGivenComesBeforePitchAndEfficiencyOneOfTheTableAfter) {
  NamedSensor sensor = nikon();
  sensor.pixel_pitch_um = 4;
  sensor.peak_quantum_efficiency = 0.5;
  const double by_speed_cd_m2 = 78 * 4 / (0.65 * 1600);
  const auto saturation = [&] { return saturation_luminance_cd_m2(sensor.model, *spectral_response(sensor, {}), 1); };
  EXPECT_GT(std::fabs(saturation() / by_speed_cd_m2 - 1), 0.01) << "the lens decides";
  sensor.iso_given = true;
  EXPECT_NEAR(saturation() / by_speed_cd_m2, 1, 1e-12);  // roundings
  NamedSensor thesis = *sensor_named("thesis", "", {});
  thesis.iso = 200;
  thesis.iso_given = true;
  EXPECT_NEAR(saturation_luminance_cd_m2(thesis.model, *spectral_response(thesis, {}), 1) / (78 * 4 / (0.65 * 200)), 1,
              1e-12);
}

/// Draws figures of a possible converter and pixel, each of them given or not.
SensorFigures draw_electronics(std::mt19937& random) {
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  const auto is_given = [&] { return random() % 2 == 0; };
  SensorFigures out;
  const int bits = 8 + static_cast<int>(random() % 9);
  if (is_given()) out.bits = bits;
  if (is_given()) out.system_gain_dn_per_e = std::exp(uniform(-4, 3));
  if (is_given()) out.full_well_e = std::exp(uniform(5, 12));
  if (is_given()) out.black_level_dn = std::floor(uniform(0, 100));
  if (out.black_level_dn && is_given()) out.white_level_dn = std::floor(uniform(150, 255));
  if (is_given()) out.read_noise_e = uniform(0.5, 30);
  return out;
}

TEST(SpectralResponse, FiguresOfPixelAndConverterDoNotChangeTheElectronsOfLight) {
  const Spectrum white = *radiance_of(*light_named("D65"), 1);
  for (const std::string_view name : {"ELD_NikonD850", "ELD_SonyA7S2", "ELD_CanonEOS700D", "thesis", "QSI_532"}) {
    for (const std::string_view gain : gain_settings(name)) {
      const double published = largest(electron_rate(*spectral_response(*sensor_named(name, gain, {}), {}), white));
      for (unsigned seed = 0; seed < 20; ++seed) {
        std::mt19937 random(seed);
        SensorFigures given = draw_electronics(random);
        NamedSensor sensor = *sensor_named(name, gain, given);
        EXPECT_NEAR(largest(electron_rate(*spectral_response(sensor, {}), white)) / published, 1, 1e-12)
            << name << ' ' << gain << ", seed " << seed;  // roundings
        given.iso = 250;
        sensor = *sensor_named(name, gain, given);
        EXPECT_NEAR(
            saturation_luminance_cd_m2(sensor.model, *spectral_response(sensor, {}), 1) / (78 * 4 / (0.65 * 250)), 1,
            1e-12)
            << name << ' ' << gain << ", seed " << seed << ": a speed that is given is that of these figures";
      }
    }
  }
}

TEST(SpectralResponse, WithoutAScaleOnlyWhatIsMissingIsAskedFor) {
  NamedSensor sensor = nikon();
  sensor.iso = std::nullopt;
  const auto asked = [&] { return spectral_response(sensor, {}).error().message; };
  EXPECT_NE(asked().find("give --pixel-pitch and --peak-qe, or --iso"), std::string::npos) << asked();
  sensor.pixel_pitch_um = 4;
  EXPECT_NE(asked().find("give --peak-qe, or --iso"), std::string::npos) << asked();
  sensor.pixel_pitch_um = std::nullopt;
  sensor.peak_quantum_efficiency = 0.5;
  EXPECT_NE(asked().find("give --pixel-pitch, or --iso"), std::string::npos) << asked();
}

TEST(SpectralResponse, ElectronsOfALineAreItsPhotonsTimesItsEfficiency) {
  SpectralResponse response{"test",
                            {*Spectrum::of({400, 700}, {0.1, 0.4}), *Spectrum::of({400, 700}, {0.3, 0.3}),
                             *Spectrum::of({400, 500}, {0.2, 0.2})},
                            2e-12};
  const Spectrum line = *Spectrum::of({549, 550, 552}, {0, 3, 0});  // triangles: the node stands for 1.5 nm
  const Vector3 rate = electron_rate(response, line);
  const double photons = 3 * 1.5 / photon_energy_j(550) * 2e-12;
  EXPECT_NEAR(rate[0] / (photons * 0.25), 1, 1e-14);
  EXPECT_NEAR(rate[1] / (photons * 0.3), 1, 1e-14);
  EXPECT_EQ(rate[2], 0) << "beyond its table a filter passes nothing";
}

TEST(SpectralResponse, ElectronsAreLinearInRadiance) {
  const auto response = *spectral_response(nikon(), {2, 100.0});
  const Vector3 one = electron_rate(response, *radiance_of(*light_named("A"), 1));
  const Vector3 many = electron_rate(response, *radiance_of(*light_named("A"), 1e6));
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(many[k] / one[k], 1e6, 1e-6);
}

TEST(RadianceOf, HasTheLuminanceAskedForWhateverTheScaleOfTheLight) {
  for (const double scale : {1e-300, 1.0, 1e300}) {
    const Spectrum light = *Spectrum::of({400, 500, 610, 700}, {scale, 2 * scale, 0.5 * scale, scale});
    for (const double luminance : {0.0, 1e-12, 1.0, 1e12}) {
      const auto radiance = radiance_of(light, luminance);
      ASSERT_TRUE(radiance) << scale;
      EXPECT_NEAR(xyz_cd_m2(*radiance).y, luminance, 1e-14 * luminance);
    }
  }
  EXPECT_FALSE(radiance_of(*Spectrum::of({400, 700}, {0, 0}), 1));
  EXPECT_FALSE(radiance_of(*Spectrum::of({900, 1000}, {1, 1}), 1));
  EXPECT_FALSE(radiance_of(*Spectrum::of({400, 700}, {-1, -1}), 1));
  EXPECT_FALSE(radiance_of(*Spectrum::of({400, 700}, {1e308, 1e308}), 1)) << "a luminance beyond double";
  EXPECT_FALSE(radiance_of(*Spectrum::of({550, 560, 1000}, {1e-300, 1e-300, 1e300}), 1)) << "so is a radiance";
}

void expect_refused(const NamedSensor& sensor, const Optics& optics, ErrorCode code, const char* part) {
  const auto refused = spectral_response(sensor, optics);
  ASSERT_FALSE(refused) << part;
  EXPECT_EQ(refused.error().code, code);
  EXPECT_NE(refused.error().message.find(part), std::string::npos) << refused.error().message;
}

TEST(SpectralResponse, WhatIsUnknownOrImpossibleIsRefused) {
  constexpr auto invalid = ErrorCode::invalid_argument;
  for (const double f_number : {0.49, 1000.1, -2.0, nan, inf}) {
    expect_refused(nikon(), {f_number, 1.0}, invalid, "f-number");
  }
  for (const double white : {0.0, -1.0, 1.1e12, nan, inf}) expect_refused(nikon(), {2, white}, invalid, "luminance");
  EXPECT_TRUE(spectral_response(nikon(), {0.5, 1e12}));
  EXPECT_TRUE(spectral_response(nikon(), {1000, 1e-12}));
  NamedSensor sensor = nikon();
  for (const double efficiency : {0.0, 1.01, nan}) {
    sensor.peak_quantum_efficiency = efficiency;
    expect_refused(sensor, {}, invalid, "quantum efficiency");
  }
  sensor.peak_quantum_efficiency = 1;
  for (const double pitch : {0.0, -1.0, 1001.0, nan}) {
    sensor.pixel_pitch_um = pitch;
    expect_refused(sensor, {}, invalid, "pitch");
  }
  sensor = nikon();
  for (const double iso : {0.0, -100.0, nan, inf}) {
    sensor.iso = iso;
    expect_refused(sensor, {}, invalid, "ISO");
  }
  sensor.iso = std::nullopt;
  expect_refused(sensor, {}, ErrorCode::insufficient, "--white-luminance");
  sensor = nikon();
  sensor.camera = "Nikon_D580";
  expect_refused(sensor, {}, ErrorCode::invalid_argument, "Nikon_D850");
}

}  // namespace
}  // namespace lowlux::isp
