#include "capture/synthetic/synthetic_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/sensor_frames.h"
#include "tests/support/synthetic_camera.h"

namespace lowlux::capture::synthetic_source_test {
namespace {

using isp::Effect;
using isp::NoiseSourceSet;

/// With every effect there is.
isp::NamedSensor rich_sensor() {
  isp::NamedSensor out = test::plain_sensor();
  SensorModel& m = out.model;
  m.read_noise_e = 2.5;
  m.dark_current_e_per_s = {5, 8, 6};
  m.prnu = 0.01;
  m.dsnu = 0.3;
  m.hot_pixel_fraction = 1e-3;
  m.hot_pixel_current_e_per_s = 500;
  m.row_noise_e = 0.8;
  m.column_noise_e = 0.6;
  return out;
}

SyntheticSource made(Scene scene, const isp::NamedSensor& sensor, const SyntheticOptions& options = {}) {
  auto source = test::source_of(std::move(scene), sensor, options);
  EXPECT_TRUE(source) << (source ? "" : source.error().message);
  return *std::move(source);
}

Scene picture(int width, int height) {
  SceneLinear xyz(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float level = 0.002f + 0.9f * static_cast<float>(x + 1) / static_cast<float>(width);
      xyz.plane[0].at(x, y) = 0.95f * level;
      xyz.plane[1].at(x, y) = level;
      xyz.plane[2].at(x, y) = level * static_cast<float>(y + 1) / static_cast<float>(height);
    }
  }
  return *picture_scene(std::move(xyz), 20);
}

template <class T>
bool same(const Plane<T>& a, const Plane<T>& b) {
  return a.width() == b.width() && a.height() == b.height() && std::equal(a.data(), a.data() + a.size(), b.data());
}

TEST(SyntheticSource, GivesTheSameCodesForEveryNumberOfThreads) {
  for (const PhotonSampling sampling : {PhotonSampling::physical, PhotonSampling::published}) {
    for (const bool planned : {false, true}) {
      if (planned && sampling == PhotonSampling::published) continue;  // refused
      SyntheticOptions options;
      options.sampling = sampling;
      options.masked_columns = 6;
      if (planned) options.effects.tolerance = isp::Tolerance{};
      if (sampling == PhotonSampling::physical) options.lens_blur_px = 1.5;
      InlineExecutor one;
      const SyntheticSource source = made(picture(71, 67), rich_sensor(), options);
      const RawFrame expected = source.frame(3, one);
      const Plane<float> expected_dn = source.frame_dn(3, one);
      const CameraRgb truth = source.signal_e(one);
      for (const int threads : {2, 3, 7}) {
        PoolExecutor pool(threads);
        // Made by several threads too: the exposure and the plan.
        const auto again =
            SyntheticSource::of(picture(71, 67), rich_sensor(), test::response_of(rich_sensor()), options, pool);
        ASSERT_TRUE(again);
        EXPECT_TRUE(same(again->frame(3, pool).raw.dn, expected.raw.dn)) << threads;
        EXPECT_TRUE(same(again->frame_dn(3, pool), expected_dn)) << threads;
        EXPECT_TRUE(same(again->signal_e(pool).plane[1], truth.plane[1])) << threads;
      }
    }
  }
}

TEST(SyntheticSource, FramesDependOnSeedAndIndexAndOnNothingElse) {
  InlineExecutor executor;
  SyntheticOptions options;
  const SyntheticSource source = made(picture(40, 30), rich_sensor(), options);
  const Plane<std::uint16_t> fifth = source.frame(5, executor).raw.dn.clone();
  EXPECT_FALSE(same(source.frame(0, executor).raw.dn, fifth));
  EXPECT_TRUE(same(source.frame(5, executor).raw.dn, fifth)) << "in any order";
  EXPECT_TRUE(same(made(picture(40, 30), rich_sensor(), options).frame(5, executor).raw.dn, fifth));
  options.seed = 2;
  EXPECT_FALSE(same(made(picture(40, 30), rich_sensor(), options).frame(5, executor).raw.dn, fifth));
  options.seed = 1;
  options.sensor_seed = 2;
  EXPECT_FALSE(same(made(picture(40, 30), rich_sensor(), options).frame(5, executor).raw.dn, fifth));
  EXPECT_FALSE(same(source.frame(0xffffffff, executor).raw.dn, fifth)) << "the last index there is";
}

/// Covariance of two frames over their pixels [DN^2].
double covariance(const Plane<float>& a, const Plane<float>& b) {
  double mean_a = 0, mean_b = 0, sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    mean_a += a.data()[i] / static_cast<double>(a.size());
    mean_b += b.data()[i] / static_cast<double>(b.size());
  }
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a.data()[i] - mean_a) * (b.data()[i] - mean_b);
  return sum / static_cast<double>(a.size());
}

// A dark and a light of one specimen share its pattern, and nothing else if their seeds differ.
TEST(SyntheticSource, DarksAndLightsOfOneSensorShareItsPatternAndNotTheirNoise) {
  InlineExecutor executor;
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.read_noise_e = 6;
  const auto frame = [&](const Scene& like, std::uint64_t seed) {
    SyntheticOptions options;
    options.seed = seed;
    options.effects.effects = {isp::Effect::read_noise, isp::Effect::column_noise};
    SceneLinear xyz;
    for (int c = 0; c < 3; ++c) xyz.plane[c] = like.xyz_cd_m2.plane[c].clone();
    return made({std::move(xyz), like.patch.clone(), like.radiances, {}, {}, like.white, ""}, sensor, options)
        .frame_dn(0, executor);
  };
  const Scene dark = *dark_scene(test::setup_of(128, 128, 1)), light = *flat_scene(test::setup_of(128, 128, 1e-9));
  const double variance = 9, standard_error = variance / 128;  // 0.5 DN/e- times 6 e-, squared; 128^2 pixels
  EXPECT_NEAR(covariance(frame(dark, 1), frame(light, 1)), variance, 0.5) << "the same seed is the same noise";
  EXPECT_NEAR(covariance(frame(dark, 1), frame(light, 2)), 0, 5 * standard_error);
  sensor.model.read_noise_e = 0;
  sensor.model.column_noise_e = 6;
  EXPECT_NEAR(covariance(frame(dark, 1), frame(light, 2)), variance, 5 * variance * std::sqrt(2.0 / 128));
}

void expect_frame(Scene scene, const SyntheticOptions& options) {
  InlineExecutor executor;
  const int width = scene.xyz_cd_m2.width(), height = scene.xyz_cd_m2.height();
  const RawFrame frame = made(std::move(scene), rich_sensor(), options).frame(0, executor);
  EXPECT_EQ(frame.raw.dn.width(), width);
  EXPECT_EQ(frame.raw.dn.height(), height);
  EXPECT_EQ(frame.raw.active, (Rect{0, 0, width, height}));
  for (std::size_t i = 0; i < frame.raw.dn.size(); ++i) EXPECT_LE(frame.raw.dn.data()[i], 16383);
}

TEST(SyntheticSource, MosaicsOfOneOrOddPixelsAreMade) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 77}, {77, 1}, {33, 31}}) {
    SyntheticOptions options;
    expect_frame(*flat_scene(test::setup_of(width, height, 20)), options);
    expect_frame(picture(width, height), options);
    options.effects.tolerance = isp::Tolerance{};
    expect_frame(*flat_scene(test::setup_of(width, height, 20)), options);
    options.effects.tolerance.reset();
    options.sampling = PhotonSampling::published;
    expect_frame(*flat_scene(test::setup_of(width, height, 20)), options);
    expect_frame(picture(width, height), options);
  }
  expect_frame(*dark_scene(test::setup_of(1, 1, 20)), {});
  expect_frame(*dark_scene(test::setup_of(3, 5, 20)), {});
}

TEST(SyntheticSource, MaskedColumnsAreDarkAndStated) {
  InlineExecutor executor;
  SyntheticOptions options;
  options.masked_columns = 8;
  options.exposure.time_s = 0.5;
  options.phase = BayerPhase::gbrg;
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.read_noise_e = 4;
  sensor.model.dark_current_e_per_s = {40, 60, 80};
  const SyntheticSource source = made(*flat_scene(test::setup_of(64, 512, 50)), sensor, options);
  const RawFrame frame = source.frame(0, executor);
  ASSERT_EQ(frame.raw.dn.width(), 72);
  EXPECT_EQ(frame.raw.active, (Rect{8, 0, 64, 512}));
  ASSERT_EQ(frame.raw.masked.size(), 1u);
  EXPECT_EQ(frame.raw.masked[0], (Rect{0, 0, 8, 512}));
  EXPECT_TRUE(frame.raw.masked_is_stated);
  std::array<std::vector<double>, 3> masked;
  for (int y = 0; y < 512; ++y) {
    for (int x = 0; x < 8; ++x) {
      masked[static_cast<int>(colour_at(options.phase, x, y))].push_back(frame.raw.dn.at(x, y));
    }
  }
  for (int k = 0; k < 3; ++k) {
    const double dark_e = sensor.model.dark_current_e_per_s[k] * 0.5, variance = 0.25 * (dark_e + 16) + 1.0 / 12;
    const test::SampleMoments m = test::moments_of(masked[k]);
    EXPECT_NEAR(m.mean, 512 + 0.5 * dark_e, 5 * std::sqrt(variance / static_cast<double>(masked[k].size())));
    EXPECT_NEAR(m.variance, variance, 5 * m.variance_error);
  }
  for (int y = 0; y < 512; ++y) {
    for (int x = 8; x < 72; ++x) EXPECT_GT(frame.raw.dn.at(x, y), 700) << "light beside the mask";
  }
}

TEST(SyntheticSource, TheMosaicIsTheTruthTimesTheExposurePlusNothingWhereAllIsLeftOut) {
  InlineExecutor executor;
  SyntheticOptions options;
  options.exposure.time_s = 0.25;
  options.effects.effects = {};
  options.phase = BayerPhase::bggr;
  const SyntheticSource source = made(picture(31, 17), rich_sensor(), options);
  const CameraRgb truth = source.signal_e(executor);
  const Plane<float> dn = source.frame_dn(0, executor);
  for (int y = 0; y < 17; ++y) {
    for (int x = 0; x < 31; ++x) {
      const double expected = 512 + 0.5 * truth.plane[static_cast<int>(colour_at(options.phase, x, y))].at(x, y);
      EXPECT_NEAR(dn.at(x, y), expected, 1e-6 * expected) << "float";
    }
  }
}

TEST(SyntheticSource, TheTruthInXyzIsTheSceneWithItsStars) {
  Scene scene = *picture_scene(test::even_picture(21, 21, {0.3, 0.25, 0.4}), 2);
  ASSERT_TRUE(add_lamp(scene, 10, 10, *isp::light_named("A"), 7));
  const SyntheticSource source = made(std::move(scene), test::plain_sensor());
  InlineExecutor executor;
  const SceneLinear truth = source.xyz_cd_m2(executor);
  EXPECT_FLOAT_EQ(truth.plane[1].at(0, 0), 0.5f);
  double added = 0;
  for (std::size_t i = 0; i < truth.plane[1].size(); ++i) added += truth.plane[1].data()[i] - 0.5;
  EXPECT_NEAR(added, 7, 1e-4);
}

void expect_refused(const isp::NamedSensor& sensor, const SyntheticOptions& options, const std::string& part,
                    double luminance_cd_m2 = 10) {
  const auto source = test::source_of(*flat_scene(test::setup_of(4, 4, luminance_cd_m2)), sensor, options);
  ASSERT_FALSE(source) << part;
  EXPECT_EQ(source.error().code, ErrorCode::invalid_argument);
  EXPECT_NE(source.error().message.find(part), std::string::npos) << source.error().message;
}

TEST(SyntheticSource, OptionsThatCannotBeAreRefused) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const isp::NamedSensor sensor = test::plain_sensor();
  for (const int columns : {-2, 3, 4098}) {
    SyntheticOptions options;
    options.masked_columns = columns;
    expect_refused(sensor, options, "masked columns");
  }
  for (const double time_s : {-1.0, nan, double{INFINITY}}) expect_refused(sensor, {.exposure = {time_s, 20}}, "time");
  for (const double f_number : {0.0, -2.0, 0.49, 1001.0, nan}) {
    SyntheticOptions options;
    options.f_number = f_number;
    expect_refused(sensor, options, "f-number");
  }
  for (const isp::Tolerance& tolerance : {isp::Tolerance{0, 0.05}, {0.5, 0}, {-1, 0.05}, {nan, 0.05}, {0.5, nan}}) {
    SyntheticOptions options;
    options.effects.tolerance = tolerance;
    expect_refused(sensor, options, "tolerance");
  }
  isp::NamedSensor broken = sensor;
  broken.model.read_noise_e = nan;
  InlineExecutor executor;
  EXPECT_FALSE(
      SyntheticSource::of(*flat_scene(test::setup_of(4, 4, 1)), broken, test::response_of(sensor), {}, executor));
}

TEST(SyntheticSource, PointsWithoutPlaceOrSpreadAreRefused) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const auto made_with = [&](double x_px, double y_px, double spread_px) {
    Scene scene = *flat_scene(test::setup_of(4, 4, 1));
    EXPECT_TRUE(add_lamp(scene, x_px, y_px, *isp::light_named("A"), 1));
    scene.points.back().spread_px = spread_px;
    return static_cast<bool>(test::source_of(std::move(scene), test::plain_sensor()));
  };
  EXPECT_TRUE(made_with(1, 1, 0.01));
  EXPECT_TRUE(made_with(-1e6, 1e6, 1000));
  EXPECT_FALSE(made_with(nan, 1, 1));
  EXPECT_FALSE(made_with(1, INFINITY, 1));
  EXPECT_FALSE(made_with(1.1e6, 1, 1));
  for (const double spread_px : {0.0, -1.0, 1001.0, nan, double{INFINITY}}) EXPECT_FALSE(made_with(1, 1, spread_px));
}

TEST(SyntheticSource, MeansBeyondTheSamplerAreRefusedWhereNothingHoldsThem) {
  SyntheticOptions options;
  options.effects.effects = NoiseSourceSet::all().without(Effect::clipping);
  const isp::NamedSensor sensor = test::plain_sensor();  // 100 cd/m2 give 30000 e- at most
  EXPECT_TRUE(test::source_of(*flat_scene(test::setup_of(4, 4, 3000)), sensor, options));
  expect_refused(sensor, options, "sampler's limit", 3400);
  isp::NamedSensor warm = sensor;
  warm.model.dark_current_e_per_s = {0, 0, 9.9e5};
  EXPECT_TRUE(test::source_of(*dark_scene(test::setup_of(4, 4, 1)), warm, options));
  warm.model.dark_current_e_per_s = {0, 0, 1.01e6};
  expect_refused(warm, options, "sampler's limit", 0);
  isp::NamedSensor uneven = sensor;
  uneven.model.prnu = 0.5;
  expect_refused(uneven, options, "sampler's limit", 1000);
  isp::NamedSensor hot = sensor;
  hot.model.hot_pixel_fraction = 0.1;
  hot.model.hot_pixel_current_e_per_s = 1e5;
  expect_refused(hot, options, "sampler's limit", 0);
  // The full well holds all of them.
  options.effects.effects = NoiseSourceSet::all();
  for (const isp::NamedSensor& any : {sensor, warm, uneven, hot}) {
    EXPECT_TRUE(test::source_of(*flat_scene(test::setup_of(4, 4, 1e9)), any, options));
  }
}

}  // namespace
}  // namespace lowlux::capture::synthetic_source_test
