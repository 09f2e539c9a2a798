#include "calib/flat/flat_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/sensor_bench/sensor_bench.h"

namespace lowlux::calib::flat_field_test {
namespace {

using test::SensorBench;

constexpr isp::Exposure exposure{0.1, 20};
constexpr double prnu = 0.02, charge_e = 4000;  // at the centre, half of the range

SensorBench bench_with(double shading, double centre_e = charge_e, int side = 256) {
  SensorBench bench{.sensor = test::modern_small(), .width = side, .height = side, .shading = shading};
  bench.sensor.prnu = prnu;
  bench.rate_e_per_s.fill(centre_e / exposure.time_s);
  return bench;
}

DarkGroup flats_of(const SensorBench& bench, int frames, std::uint32_t first = 100) {
  DarkStack stack(StackedFrames::flats);
  for (int i = 0; i < frames; ++i) EXPECT_TRUE(stack.add(bench.frame(exposure, first + i)));
  return stack.average();
}

// EMVA 1288 in codes: variance = K^2 sigma_d^2 + 1/12 + K * signal.
FlatLevels levels_of(const SensorModel& sensor, bool with_noise) {
  FlatLevels out;
  out.black_dn.fill(sensor.black_level_dn);
  if (!with_noise) return out;
  const double k = sensor.system_gain_dn_per_e;
  out.noise.emplace();
  out.noise->gain_dn_per_e.fill(k);
  out.noise->read_variance_dn2.fill(k * k * sensor.read_noise_e * sensor.read_noise_e + rounding_dn2);
  return out;
}

// Relative variance of the shot and read noise of one frame, in the mean over the frame.
double relative_noise_of(const SensorBench& bench, double centre_e = charge_e) {
  const SensorModel& s = bench.sensor;
  const double k = s.system_gain_dn_per_e;
  double sum = 0;
  for (int x = 0; x < bench.width; ++x) {
    const double signal = centre_e * (1 - bench.shading * (static_cast<double>(x) / bench.width - 0.5));
    sum += (signal + s.read_noise_e * s.read_noise_e + rounding_dn2 / (k * k)) / (signal * signal);
  }
  return sum / bench.width;
}

std::string refusal(const SensorBench& bench) {
  const auto flat = make_flat_field(flats_of(bench, 2), levels_of(bench.sensor, false));
  return flat ? "" : flat.error().message;
}

TEST(FlatField, DividesOutVignettingAndResponseAndLeavesTheNoiseThatItStates) {
  const SensorBench bench = bench_with(0.8);
  const FlatLevels levels = levels_of(bench.sensor, false);
  const auto flat = make_flat_field(flats_of(bench, 16), levels);
  ASSERT_TRUE(flat) << flat.error().message;
  EXPECT_EQ(flat->frames, 16);
  // The light falls to 0.6 of that of the centre; the mean of two pixels at the border has an error of 1 %.
  EXPECT_NEAR(flat->max_gain, 1 / 0.6, 0.1);
  const auto n = static_cast<double>(bench.width) * bench.height;
  EXPECT_NEAR(flat->prnu, prnu, prnu * (5 * std::sqrt(1 / (2 * n)) + 0.01));
  const double noise2 = relative_noise_of(bench) / 16, weight = prnu * prnu / (prnu * prnu + noise2);
  EXPECT_NEAR(flat->pixel_fraction, weight, 0.01);
  EXPECT_NEAR(flat->noise * flat->noise, noise2 * (weight * weight * 80 / 81 + 1 / 81.0), 0.05 * noise2);

  const RawDn picture = bench.frame(exposure, 7);
  double sum = 0, squares = 0, raw_squares = 0;
  for (int y = 0; y < bench.height; ++y) {
    for (int x = 0; x < bench.width; ++x) {
      const double signal = (picture.dn.at(x, y) - levels.black_dn[0]) / (bench.sensor.system_gain_dn_per_e * charge_e);
      const double even = signal * flat->gain.gain[static_cast<std::size_t>(y) * bench.width + x] - 1;
      sum += even;
      squares += even * even;
      raw_squares += (signal - 1) * (signal - 1);
    }
  }
  const double left = std::pow((1 - weight) * prnu, 2),
               expected = relative_noise_of(bench) + flat->noise * flat->noise + left;
  EXPECT_NEAR(squares / n - std::pow(sum / n, 2), expected, expected * (5 * std::sqrt(2 / n) + 0.03));
  EXPECT_GT(raw_squares / n, 0.8 * 0.8 / 12);             // the variance of a line from 1.4 to 0.6
  EXPECT_NEAR(sum / n, 0, 5 * prnu / std::sqrt(n / 16));  // the middle quarter of width and height sets the level
}

TEST(FlatField, TheGainsOfTwoSetsOfFlatsDifferByTheNoiseThatIsStated) {
  const SensorBench bench = bench_with(0);
  for (const int frames : {1, 4}) {
    const FlatLevels levels = levels_of(bench.sensor, true);
    const auto a = make_flat_field(flats_of(bench, frames), levels);
    const auto b = make_flat_field(flats_of(bench, frames, 5000), levels);
    ASSERT_TRUE(a && b);
    double squares = 0;
    for (std::size_t i = 0; i < a->gain.gain.size(); ++i) {
      squares += std::pow(a->gain.gain[i] / b->gain.gain[i] - 1, 2) / 2;
    }
    const auto n = static_cast<double>(a->gain.gain.size());
    // Deviations beyond five standard deviations are kept in full, borders have fewer neighbours: 5 % for both.
    EXPECT_NEAR(squares / n, a->noise * a->noise, a->noise * a->noise * (5 * std::sqrt(2 / n) + 0.05)) << frames;
  }
}

// Vignetting to 0.43 of the brightest place: the noise of the gains is stated for each of them.
TEST(FlatField, TheNoiseOfEachGainIsStatedAsAFunctionOfTheGain) {
  const SensorBench bench = bench_with(0.8);
  for (const bool modelled : {true, false}) {
    const FlatLevels levels = levels_of(bench.sensor, modelled);
    const auto a = make_flat_field(flats_of(bench, 4), levels);
    const auto b = make_flat_field(flats_of(bench, 4, 5000), levels);
    ASSERT_TRUE(a && b);
    constexpr int bands = 4;
    double found_first = 0, found_last = 0;
    for (int band = 0; band < bands; ++band) {
      double found = 0, stated = 0, n = 0;
      for (int y = 8; y < bench.height - 8; ++y) {
        for (int x = 8 + band * 60; x < 8 + (band + 1) * 60; ++x) {
          const std::size_t i = static_cast<std::size_t>(y) * bench.width + x;
          const double gain = a->gain.gain[i];
          const GainNoise& noise = a->gain.noise[static_cast<std::size_t>(site_of(x, y))];
          found += std::pow(gain / b->gain.gain[i] - 1, 2) / 2;
          stated += noise.shot * gain + noise.read * gain * gain;
          ++n;
        }
      }
      // The mean weight of the frame is used in bright and dark parts: 5 %, as above.
      EXPECT_NEAR(found / n, stated / n, stated / n * (5 * std::sqrt(2 / n) + 0.05)) << modelled << " " << band;
      (band == 0 ? found_first : found_last) = found / n;
    }
    EXPECT_GT(found_last, 1.5 * found_first) << "the noise of the gains is not even";
  }
}

TEST(FlatField, ASingleFlatOfUnknownNoiseGivesVignettingOnly) {
  const SensorBench bench = bench_with(0.4);
  const auto flat = make_flat_field(flats_of(bench, 1), levels_of(bench.sensor, false));
  ASSERT_TRUE(flat);
  EXPECT_EQ(flat->pixel_fraction, 0);
  EXPECT_EQ(flat->prnu, 0);
  EXPECT_NEAR(flat->max_gain, 1 / 0.8, 0.1);
}

TEST(FlatField, DeadPixelsAreLeftToRepair) {
  const SensorBench bench = bench_with(0);
  DarkGroup flats = flats_of(bench, 4);
  flats.mean_dn.at(100, 100) = static_cast<float>(bench.sensor.black_level_dn);
  flats.mean_dn.at(50, 60) -= static_cast<float>(0.3 * bench.sensor.system_gain_dn_per_e * charge_e);  // dust
  const auto flat = make_flat_field(flats, levels_of(bench.sensor, false));
  ASSERT_TRUE(flat);
  const auto gain_at = [&](int x, int y) { return flat->gain.gain[static_cast<std::size_t>(y) * bench.width + x]; };
  EXPECT_NEAR(gain_at(100, 100), 1, 5 * prnu / 9);
  EXPECT_NEAR(gain_at(50, 60), 1 / 0.7, 0.15);  // response of the pixel itself: 5 times 2 %
  EXPECT_NEAR(gain_at(102, 100), 1, 5 * prnu + 0.01);
}

TEST(FlatField, FlatsThatCannotServeAreRefusedWithTheCause) {
  EXPECT_EQ(refusal(bench_with(0.8)), "");
  EXPECT_NE(refusal(bench_with(0, 20000)).find("clipped"), std::string::npos);
  EXPECT_NE(refusal(bench_with(0, 100)).find("too dark"), std::string::npos);
  EXPECT_NE(refusal(bench_with(1.998, 2000)).find("falls to"), std::string::npos);
  DarkGroup scene = flats_of(bench_with(0), 2);
  for (int y = 0; y < scene.mean_dn.height(); ++y) {
    for (int x = 0; x < scene.mean_dn.width(); ++x)
      scene.mean_dn.at(x, y) += static_cast<float>((x / 2 + y / 2) % 2 * 800);
  }
  const auto flat = make_flat_field(scene, levels_of(test::modern_small(), false));
  ASSERT_FALSE(flat);
  EXPECT_NE(flat.error().message.find("neighbouring pixels"), std::string::npos);
}

TEST(FlatField, FlatsThatDifferInSettingAreRefusedByTheirName) {
  const SensorBench bench = bench_with(0, charge_e, 32);
  DarkStack stack(StackedFrames::flats);
  ASSERT_TRUE(stack.add(bench.frame(exposure, 1)));
  RawDn other = bench.frame(exposure, 2);
  other.info.iso = 12345;
  const auto refused = stack.add(other);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("flat frame 2"), std::string::npos);
}

}  // namespace
}  // namespace lowlux::calib::flat_field_test
