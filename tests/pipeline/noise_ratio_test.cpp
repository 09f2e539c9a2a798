// Frames whose noise differs from place to place, from the plan to the image.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "isp/pipeline/budget/chroma_work.h"
#include "isp/pipeline/budget/frame_sample.h"
#include "isp/pipeline/budget/visible_noise.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/finished/clean_raw.h"
#include "isp/pipeline/plan/local_noise.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/look_noise.h"
#include "isp/pipeline/render/pipeline.h"
#include "isp/raw/measure/thumbnail.h"
#include "tests/denoise/draws.h"
#include "tests/pipeline/mixed_night.h"
#include "tests/support/executors.h"

namespace lowlux::isp::noise_ratio_test {
namespace {

using denoise::Level;
using denoise_testing::Camera;
using denoise_testing::checked;
using denoise_testing::flat;
using test::one_thread;
using Mode = DenoiseChoice::Mode;

constexpr TileLimits small_tiles{.max_whole_px = 0, .side_px = 256};
constexpr TileLimits never{.max_whole_px = std::int64_t{1} << 40};

DevelopOptions options_for(const DenoiseChoice& choice) {
  return {.exposure_ev = 0,
          .tone = ToneCurve::none,
          .space = OutputSpace::camera,
          .samples = SampleType::f32,
          .denoise = choice};
}

DevelopPlan planned(const RawFrame& frame, const DevelopOptions& options) {
  Result<DevelopPlan> plan = plan_develop(frame, options, one_thread);
  EXPECT_TRUE(plan) << plan.error().message;
  return *std::move(plan);
}

/// A frame of two halves: the left one a mean of 8 frames, the right one a single frame.
RawFrame halves(const Camera& camera, const denoise_testing::Scene& scene, int width, int height) {
  return test::mixed_night(camera, scene, width, height, [width](int column, int) { return 16 * column >= width; });
}

/// Mean square of the error of a mosaic [e-^2] in columns left .. right - 1.
double error_e2(PlaneView<const float> got, double truth_e, int left, int right) {
  test::MeanOf squares;
  for (int y = 0; y < got.height; ++y) {
    for (int x = left; x < right; ++x) squares.add(std::pow(static_cast<double>(got.at(x, y)) - truth_e, 2));
  }
  return squares.mean();
}

// The same frame with the noise of one for all keeps much of the noise of its single half, or blurs the other.
TEST(NoiseRatioPlan, ReducesTheNoiseOfEachHalf) {
  const RawFrame frame = halves({}, flat(20, 20, 20), 512, 384);
  const DevelopPlan plan = planned(frame, options_for({Mode::level, Level::standard}));
  EXPECT_EQ(plan.noise_reduction.noise_ratio, frame.noise_ratio);
  EXPECT_TRUE(plan.warnings.empty()) << plan.warnings.front();
  for (const double scale : plan.noise_reduction.options.variance_scale) EXPECT_EQ(scale, 1);
  Pipeline pipeline(one_thread);
  const auto signal = pipeline.signal(frame, plan);
  // 40 cells are averaged at least, as on flats of one noise.
  EXPECT_LT(error_e2(signal, 20, 0, 256), 22.25 / 8 / 40);
  EXPECT_LT(error_e2(signal, 20, 256, 512), 22.25 / 40);
}

// The median block is of the kind that 44 of 64 columns of blocks are.
TEST(NoiseRatioPlan, ChoosesTheLevelByTheNoiseOfThePlace) {
  const auto snr = [](const denoise_testing::Blocks& blocks) {
    const RawFrame frame = test::mixed_night({}, flat(20, 20, 20), 512, 384, blocks);
    return *planned(frame, options_for({.mode = Mode::automatic})).noise_reduction.snr;
  };
  const double single = snr([](int column, int) { return column >= 20; });
  const double mean = snr([](int column, int) { return column < 20; });
  EXPECT_NEAR(mean / single, std::sqrt(8), 0.1);  // by the noise of the blocks' means, 64 pixels each
}

TEST(NoiseRatioPlan, ChecksTheNoiseOfLargeFramesOnASampleWithItsRatio) {
  const RawFrame frame = test::mixed_night({}, flat(20, 30, 15), 2304, 1536, checked(4));
  ASSERT_FALSE(sample_squares(frame, {.black = {}, .electrons_at_white = PerSite<double>{}}).empty());
  DevelopOptions options = options_for({Mode::level, Level::draft});
  for (const bool lines : {false, true}) {
    options.denoise.line_noise = lines;
    const DevelopPlan plan = planned(frame, options);
    EXPECT_TRUE(plan.warnings.empty()) << plan.warnings.front();
    for (const double scale : plan.noise_reduction.options.variance_scale) EXPECT_EQ(scale, 1) << lines;
  }
}

TEST(NoiseRatioPlan, SamplesHaveTheRatiosOfTheirSquares) {
  const RawFrame frame = test::mixed_night({}, flat(1, 1, 1), 1600, 1100, checked(3));
  const NoiseRatioView whole = view_of(frame.noise_ratio.get());
  const std::vector<Rect> squares{{10, 22, sample_side_px, sample_side_px},
                                  {1002, 500, sample_side_px, sample_side_px}};
  const NoiseRatio sample = sample_ratio(whole, squares);
  for (int i = 0; i < 2; ++i) {
    for (const auto [x, y] : {std::array{0, 0}, {16, 320}, {496, 496}}) {
      const auto expected = whole.mean(squares[i].x + x, squares[i].y + y, 16, 16);
      EXPECT_NEAR(view_of(&sample).mean(x, i * sample_side_px + y, 16, 16), expected, 1e-6);  // float
    }
  }
}

// Tiles see the ratios of their place. The bound is that of Tiles without a ratio, 3 % of a raw value's noise.
TEST(NoiseRatioPlan, TilesAreAsTheWholeFrame) {
  const RawFrame frame = test::mixed_night({}, denoise_testing::waves(60), 901, 701, checked(5));
  for (const Level level : {Level::draft, Level::standard, Level::high}) {
    const DevelopPlan plan = planned(frame, options_for({Mode::level, level}));
    std::array<Picture, 2> out{make_picture(plan), make_picture(plan)};
    Pipeline(one_thread, never).render(frame, plan, out[0]);
    Pipeline(one_thread, small_tiles).render(frame, plan, out[1]);
    const auto& whole = std::get<SceneLinear>(out[0]).plane[1];
    const auto& tiled = std::get<SceneLinear>(out[1]).plane[1];
    double squares = 0;
    for (std::size_t i = 0; i < whole.size(); ++i) {
      squares += std::pow(static_cast<double>(whole.data()[i]) - static_cast<double>(tiled.data()[i]), 2);
    }
    const double rms_e = std::sqrt(squares / static_cast<double>(whole.size())) * test::night_full_e();
    EXPECT_LT(rms_e, 0.03 * std::sqrt(60 / 8.0)) << name_of(level);
  }
}

// Regions that keep their noise state the noise of the place, too.
TEST(NoiseRatioPlan, MapsHoldTheNoiseOfEachHalf) {
  const RawFrame frame = halves({}, flat(30, 30, 30), 1024, 512);
  DevelopPlan plan = planned(frame, options_for({.mode = Mode::level, .level = Level::standard, .maps = true}));
  NoiseReduction& how = plan.noise_reduction;
  how.regions = NoiseRegions{.size = 256, .columns = 4, .rows = 2, .level = {{}, {}, {}, {}, Level::draft, {}, {}, {}}};
  Picture out = make_picture(plan);
  Pipeline pipeline(one_thread);
  pipeline.render(frame, plan, out);
  const NoiseMaps maps = pipeline.take_noise_maps();
  const double variance_e2 = 30 + how.noise.variance_e2[1];
  for (const int x : {200, 300}) {
    test::MeanOf mean;
    for (int y = 0; y < 128; ++y) mean.add(static_cast<double>(maps.site_variance_e2[1].at(x, y)) / variance_e2);
    // Of 16 blocks of 128 sites of green: 5 standard errors of the light's part.
    EXPECT_NEAR(mean.mean(), x < 256 ? 0.125 : 1, 5 * std::sqrt(32.0 / (16 * 128)) / 32 + 0.001);
  }
}

TEST(NoiseRatioPlan, FindsDefectsByTheNoiseOfThePlace) {
  RawFrame frame = halves({}, flat(40, 40, 40), 512, 384);
  const DevelopOptions options = options_for({});
  EXPECT_LE(planned(frame, options).levels.defects.size(), 1u);  // about 4e-6 of the pixels would be
  const double sigma_e = std::sqrt(40 / 8.0 + 2.25 / 8);
  for (const int x : {60, 120, 180}) {
    frame.raw.dn.at(x, 100) += static_cast<std::uint16_t>(16 * sigma_e * test::night_gain_dn_per_e);
  }
  const std::size_t found = planned(frame, options).levels.defects.size();
  EXPECT_GE(found, 3u);  // for the noise of a single frame, these are 5.7 standard deviations
  frame.noise_ratio = nullptr;
  EXPECT_LT(planned(frame, options).levels.defects.size(), found);
}

TEST(NoiseRatioPlan, PredictsVisibleNoiseOfEachHalf) {
  const RawFrame frame = halves({}, flat(10, 20, 12.5), 512, 384);
  DevelopOptions options = options_for({Mode::level, Level::standard});
  options.space = OutputSpace::linear_srgb;
  const DevelopPlan plan = planned(frame, options);
  const Thumbnail thumbnail = make_thumbnail(frame, plan.levels.black, one_thread);
  const auto blocks =
      visibility_blocks(frame, options, plan.levels, plan.rendering, plan.noise_reduction.noise, thumbnail, one_thread);
  std::array<test::MeanOf, 2> delta_e, snr;
  for (const VisibilityBlock& block : blocks) {
    delta_e[block.x < 0.5f ? 0 : 1].add(static_cast<double>(block.noise_delta_e));
    snr[block.x < 0.5f ? 0 : 1].add(static_cast<double>(block.snr));
  }
  EXPECT_NEAR(snr[0].mean() / snr[1].mean(), std::sqrt(8), 0.1);
  EXPECT_GT(delta_e[1].mean() / delta_e[0].mean(), 2);  // sqrt(8), and not linear
  // A signal to noise ratio of 2.6 starts on level 1, one of 7.3 on level 0.
  const RawFrame dark = halves({}, flat(8, 8, 8), 1024, 512);
  const DevelopPlan of_dark = planned(dark, options);
  const ChromaWork work = chroma_work(dark, of_dark.levels, of_dark.noise_reduction.noise,
                                      make_thumbnail(dark, of_dark.levels.black, one_thread));
  EXPECT_NEAR(work.start[0], 0.5, 1e-9);
  EXPECT_NEAR(work.start[1], 0.5, 1e-9);
}

// Where a look needs the noise of a frame that keeps it.
TEST(NoiseRatioPlan, MultipliesTheModelsNoiseOfLuminance) {
  const auto owner = std::make_unique<DevelopPlan>();
  DevelopPlan& plan = *owner;
  plan.rendering.white_gain = {1, 1, 1};
  plan.rendering.transform.luminance = {0.25f, 0.5f, 0.25f};
  for (const std::size_t diagonal : {0, 4, 8}) plan.rendering.transform.matrix[diagonal] = 1;
  RawFrame model;
  model.noise = NoiseProfile{.scale = {1, 1, 1}, .offset = {0.1, 0.1, 0.1}};
  model.raw.default_crop = {8, 4, 64, 48};
  Plane<float> quarter(16, 12), without(16, 12), with(16, 12);
  std::fill_n(quarter.data(), quarter.size(), 0.5f);
  const RgbView<const float> rgb{std::as_const(quarter).view(), std::as_const(quarter).view(),
                                 std::as_const(quarter).view()};
  noise_of_luminance(plan, model, {}, rgb, without.view(), one_thread);
  const RawFrame frame = test::mixed_night({}, flat(1, 1, 1), 80, 60, checked(1));
  plan.noise_reduction.noise_ratio = frame.noise_ratio;
  noise_of_luminance(plan, model, {}, rgb, with.view(), one_thread);
  for (int y = 0; y < 12; ++y) {
    for (int x = 0; x < 16; ++x) {
      const bool single = ((8 + 4 * x) / 8 + (4 + 4 * y) / 8) % 2 == 0;
      ASSERT_GT(without.at(x, y), 0);
      ASSERT_EQ(with.at(x, y), (single ? 1.0f : 0.125f) * without.at(x, y)) << x << ", " << y;
    }
  }
}

// What noise reduction leaves is stated by the NoiseProfile alone.
TEST(NoiseRatioPlan, CleanRawsHaveNone) {
  const RawFrame frame = halves({}, flat(20, 20, 20), 512, 384);
  DevelopOptions options = options_for({.mode = Mode::level, .level = Level::standard, .maps = true});
  const Result<CleanRaw> clean = clean_raw(frame, options, one_thread);
  ASSERT_TRUE(clean) << clean.error().message;
  EXPECT_EQ(clean->frame.noise_ratio, nullptr);
  const auto& residual = clean->maps.residual_variance_e2;
  EXPECT_NEAR(static_cast<double>(residual.at(200, 96) / residual.at(60, 96)), 8, 4);
}

}  // namespace
}  // namespace lowlux::isp::noise_ratio_test
