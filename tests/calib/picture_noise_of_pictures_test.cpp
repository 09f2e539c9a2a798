#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <string>

#include <gtest/gtest.h>

#include "calib/picture/picture_noise.h"
#include "capture/file/dng_source.h"
#include "tests/sensor_bench/picture_raw.h"
#include "tests/sensor_bench/sensor_bench.h"

namespace lowlux::calib {
namespace {

// Mean electrons of the green pixels; fixed before the four pictures that nothing is tuned on were looked at.
constexpr std::initializer_list<double> levels_e{4, 10, 25, 100};
constexpr double lens_sigma_px = 0.9;

/// A sensor that clips at black: code 0 is both.
SensorModel clipping_sensor() {
  SensorModel out = test::modern_small();
  out.name = "clipped at black";
  out.black_level_dn = 0;
  out.system_gain_dn_per_e = 1.6;
  out.read_noise_e = 2.2;
  return out;
}

struct Outcome {
  int refused = 0;
  int missed = 0;
  int denoised = 0;  // false verdicts: these raws are not filtered
};

/// Fits all levels of one picture behind a lens: the gain is missed by more than 10 %, the offset by more than 10 % and
/// three standard errors.
void measure(const test::PictureLight& light, const SensorModel& sensor, std::initializer_list<double> levels,
             Outcome& outcome) {
  PoolExecutor executor(2);
  const double black = sensor.black_level_dn, gain = sensor.system_gain_dn_per_e;
  const double read_dn = gain * sensor.read_noise_e, offset = read_dn * read_dn + 1.0 / 12;
  for (const double mean_e : levels) {
    const RawDn raw = test::take_picture(light, sensor, {.mean_green_e = mean_e, .seed = 7}, executor);
    const auto found = fit_picture_noise(raw, {black, black, black, black}, {}, executor);
    if (!found) {
      ++outcome.refused;
      continue;
    }
    const double gain_off = std::abs(found->gain_dn_per_e.value - gain) / gain;
    const double offset_off = std::abs(found->offset_dn2.value - offset);
    const bool near = gain_off <= 0.1 && offset_off <= std::max(0.1 * offset, 3 * found->offset_dn2.standard_error);
    EXPECT_TRUE(near) << light.name << " at " << mean_e << " e-, " << sensor.name << ": gain off by " << gain_off
                      << ", offset by " << offset_off / offset << " +- " << found->offset_dn2.standard_error / offset;
    // Bright texture is stronger than noise (raw_traces.h): kodim08 and kodim19 at 100 e-.
    EXPECT_TRUE(!found->traces.denoised || mean_e > 25)
        << light.name << " at " << mean_e << ": " << found->traces.fine_to_coarse;
    outcome.denoised += found->traces.denoised ? 1 : 0;
    EXPECT_FALSE(found->traces.companded) << light.name << " at " << mean_e;
    EXPECT_FALSE(found->traces.block_grid) << light.name << " at " << mean_e << ": " << found->traces.grid_excess;
    outcome.missed += near ? 0 : 1;
  }
}

TEST(PictureNoiseOfPictures, IsThatOfTheSensorBehindALens) {
  PoolExecutor executor(2);
  for (const char* name : {"GoldenGate.exr", "kodim23.png"}) {
    const auto light = test::picture_light(name, executor, lens_sigma_px);
    ASSERT_TRUE(light) << light.error().message;
    Outcome outcome;
    measure(*light, test::modern_small(), {4.0, 100.0}, outcome);
    measure(*light, test::modern_large(), {10.0}, outcome);
    measure(*light, clipping_sensor(), {4.0, 25.0}, outcome);
    EXPECT_EQ(outcome.refused, 0) << name;
  }
}

TEST(PictureNoiseOfPictures, IsThatOfTheSensorWithoutALensWhereTheyAreSmooth) {
  PoolExecutor executor(2);
  const auto light = test::picture_light("kodim15.png", executor);
  ASSERT_TRUE(light) << light.error().message;
  Outcome outcome;
  measure(*light, test::modern_small(), levels_e, outcome);
  EXPECT_EQ(outcome.refused, 0);
}

TEST(PictureNoiseOfPictures, OfAllEightAtFourLevelsIsThatOfTheSensor) {
  PoolExecutor executor(2);
  std::vector<SensorModel> sensors{test::modern_small()};
  if (std::getenv("LOWLUX_NIGHTLY") != nullptr) {
    sensors.push_back(test::modern_large());
    sensors.push_back(clipping_sensor());
  }
  for (const SensorModel& sensor : sensors) {
    Outcome outcome;
    for (const char* name : test::clean_pictures) {
      const auto light = test::picture_light(name, executor, lens_sigma_px);
      ASSERT_TRUE(light) << light.error().message;
      measure(*light, sensor, levels_e, outcome);
    }
    EXPECT_EQ(outcome.missed, 0) << sensor.name;
    EXPECT_LE(outcome.refused, 3) << sensor.name;
    EXPECT_LE(outcome.denoised, 2) << sensor.name;
  }
}

// As sharp as the mosaic, texture can be as fine as noise: kodim08, facades and roofs from edge to edge, has no block
// without it. Measured: 0.31 at 60 e-, 0.21 at 25; the others 0.10 at most.
TEST(PictureNoiseOfPictures, OfAllEightWithoutALensIsWithinATenthButForFinestTexture) {
  PoolExecutor executor(2);
  const SensorModel sensor = test::modern_small();
  const double black = sensor.black_level_dn, gain = sensor.system_gain_dn_per_e;
  int refused = 0;
  for (const std::string name : test::clean_pictures) {
    const auto light = test::picture_light(name, executor);
    ASSERT_TRUE(light) << light.error().message;
    for (const double mean_e : {4.0, 10.0, 25.0, 60.0}) {
      const RawDn raw = test::take_picture(*light, sensor, {.mean_green_e = mean_e, .seed = 7}, executor);
      const auto found = fit_picture_noise(raw, {black, black, black, black}, {}, executor);
      if (!found) {
        ++refused;
        continue;
      }
      EXPECT_LE(std::abs(found->gain_dn_per_e.value / gain - 1), name == "kodim08.png" ? 0.33 : 0.1)
          << name << " at " << mean_e;
      EXPECT_FALSE(found->traces.denoised) << name << " at " << mean_e << ": " << found->traces.fine_to_coarse;
    }
  }
  EXPECT_LE(refused, 1);  // kodim05 at 60 e-
}

TEST(PictureNoiseOfRealRaws, IsSaneOrRefused) {
  PoolExecutor executor(2);
  for (const char* name : {"canon_kissx4_ml_colorchart.dng", "nikon_dsc1339_crop_rggb14.dng", "openisp_test_rggb10.dng",
                           "infiniteisp_indoor1_grbg8.dng", "n900_dog_small_grbg10in16.dng"}) {
    const auto frame = capture::read_raw(std::string(LOWLUX_TESTDATA "/raws/") + name);
    ASSERT_TRUE(frame) << frame.error().message;
    ASSERT_TRUE(frame->raw.black_tag);
    const double black = frame->raw.black_tag->at(0, 0);
    const auto found = fit_picture_noise(frame->raw, {black, black, black, black}, {}, executor);
    if (!found) {
      EXPECT_EQ(found.error().code, ErrorCode::insufficient) << name;
      EXPECT_EQ(found.error().message.find('\n'), std::string::npos);
      std::printf("%s: refused: %s\n", name, found.error().message.c_str());
      continue;
    }
    EXPECT_GT(found->gain_dn_per_e.value, 0) << name;
    EXPECT_TRUE(std::isfinite(found->offset_dn2.value)) << name;
    std::printf("%s: gain %.4f +- %.4f offset %.3f +- %.3f chi2 %.2f flat %.2f\n", name, found->gain_dn_per_e.value,
                found->gain_dn_per_e.standard_error, found->offset_dn2.value, found->offset_dn2.standard_error,
                found->reduced_chi_square, found->flat_fraction);
    for (const std::string& reason : found->reasons) std::printf("  %s\n", reason.c_str());
  }
}

}  // namespace
}  // namespace lowlux::calib
