#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>

#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/frame_tiles.h"
#include "isp/pipeline/render/pipeline.h"
#include "isp/pipeline/render/pipeline_memory.h"
#include "tests/pipeline/night_frames.h"
#include "tests/support/count_allocations.h"
#include "tests/support/executors.h"

namespace lowlux::isp::tiles_test {
namespace {

using denoise::Level;
using denoise_testing::Camera;
using test::one_thread;
using Mode = DenoiseChoice::Mode;

constexpr TileLimits small_tiles{.max_whole_px = 0, .side_px = 256};
constexpr TileLimits never{.max_whole_px = std::int64_t{1} << 40};

/// Waves, a bright edge, stars beside the seams, a saturated lamp across one.
denoise_testing::Scene night_scene(double mean_e) {
  return [mean_e](int x, int y) {
    auto light = denoise_testing::waves(mean_e)(x, y);
    const bool star = (x + 3) % 256 < 2 && y % 128 == 67;
    const bool lamp = std::hypot(x - 512, y - 300) < 9;
    for (double& e : light) e = lamp ? 5000 : e + (star ? 30 * std::sqrt(mean_e + 3) : 0);
    return light;
  };
}

DevelopOptions options_for(const DenoiseChoice& choice, SampleType samples = SampleType::f32) {
  DevelopOptions options{.exposure_ev = 0, .samples = samples, .denoise = choice};
  if (samples == SampleType::f32) {
    options.tone = ToneCurve::none;
    options.space = OutputSpace::camera;
  }
  return options;
}

DevelopPlan planned(const RawFrame& frame, const DevelopOptions& options) {
  Result<DevelopPlan> plan = plan_develop(frame, options, one_thread);
  EXPECT_TRUE(plan) << plan.error().message;
  return *std::move(plan);
}

Picture rendered(const RawFrame& frame, const DevelopPlan& plan, const TileLimits& limits,
                 Executor& with = one_thread) {
  EXPECT_EQ(is_tiled(frame.raw, plan, limits), limits.max_whole_px == 0);
  Picture out = make_picture(plan);
  Pipeline(with, limits).render(frame, plan, out);
  return out;
}

bool same_bits(const Picture& a, const Picture& b) {
  const auto same = [](const auto& p, const auto& q) {
    return p.width() == q.width() && p.height() == q.height() &&
           std::memcmp(p.data(), q.data(), p.size() * sizeof *p.data()) == 0;
  };
  return std::visit(
      [&](const auto& p) {
        const auto& q = std::get<std::remove_cvref_t<decltype(p)>>(b);
        if constexpr (std::is_same_v<std::remove_cvref_t<decltype(p)>, SceneLinear>) {
          return same(p.plane[0], q.plane[0]) && same(p.plane[1], q.plane[1]) && same(p.plane[2], q.plane[2]);
        } else {
          return same(p.codes, q.codes);
        }
      },
      a);
}

/// Everything that a piece has to know its place for: maps of gains, a pattern of black, defects beside the seams.
RawFrame demanding_frame(BayerPhase phase, int width, int height) {
  RawFrame frame = test::night_frame({.phase = phase}, night_scene(60), width, height);
  frame.raw.default_crop = {3, 1, width - 8, height - 4};
  GainMap map{.top = 1, .left = 5, .bottom = height - 3, .right = width, .row_pitch = 2, .column_pitch = 3};
  map.points_v = map.points_h = 2;
  map.gain = {1, 1.5f, 0.7f, 1.2f};
  frame.corrections.gain_maps = {map};
  frame.corrections.radial_gains = {{.k = {0.3, -0.1, 0, 0, 0.02}, .centre_x = 0.4, .centre_y = 0.55}};
  for (const int x : {255, 256, 257, 258, 511, 513}) frame.corrections.defects.push_back({x, x % 7 + 254, 1, 1});
  frame.raw.black_tag->row_dn.resize(static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) frame.raw.black_tag->row_dn[static_cast<std::size_t>(y)] = 0.25 * (y % 9);
  return frame;
}

TEST(Tiles, CoresCoverEachPixelOnceAndKeepTheCellsOfThePicture) {
  for (const Rect crop : {Rect{0, 0, 700, 513}, {3, 1, 1021, 255}, {255, 257, 257, 1}, {256, 511, 4000, 2049}}) {
    const TileGrid grid(crop, 512);
    std::int64_t area = 0;
    for (int i = 0; i < grid.count(); ++i) {
      const Rect core = grid.core(i);
      area += std::int64_t{core.width} * core.height;
      EXPECT_EQ(overlap(core, crop), core);
      EXPECT_EQ((core.x - crop.x) % 2 + (core.y - crop.y) % 2, 0);
      EXPECT_TRUE(core.width <= 513 && core.height <= 513);
      const Rect whole = with_margin(core, {}, 5000, 3000);
      EXPECT_EQ(whole.x % tile_lattice_px + whole.y % tile_lattice_px, 0);
      EXPECT_TRUE(whole.x == 0 || core.x - whole.x >= tile_margin_px);
      EXPECT_TRUE(whole.x + whole.width == 5000 || whole.x + whole.width - core.x - core.width >= tile_margin_px);
      for (int j = 0; j < i; ++j)
        EXPECT_EQ(std::min(overlap(core, grid.core(j)).width, overlap(core, grid.core(j)).height), 0);
    }
    EXPECT_EQ(area, std::int64_t{crop.width} * crop.height);
  }
}

TEST(Tiles, WithoutNoiseReductionTheBitsAreThoseOfTheWholeFrame) {
  for (const BayerPhase phase : {BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr}) {
    for (const bool electrons : {true, false}) {
      RawFrame frame = demanding_frame(phase, 701, 523);
      if (!electrons) frame.noise.reset();
      for (const SampleType samples : {SampleType::u8, SampleType::u16, SampleType::f32}) {
        for (const bool half : {false, true}) {
          DevelopOptions options = options_for({}, samples);
          options.half = half;
          const DevelopPlan plan = planned(frame, options);
          EXPECT_GE(plan.levels.defects.size(), 6U);
          EXPECT_TRUE(same_bits(rendered(frame, plan, small_tiles), rendered(frame, plan, never)))
              << static_cast<int>(phase) << electrons << static_cast<int>(samples) << half;
        }
      }
    }
  }
}

TEST(Tiles, AProfileIsAppliedAsToTheWholeFrameAndTakesTheMemoryStated) {
  const RawFrame frame = demanding_frame(BayerPhase::grbg, 701, 523);
  auto tables = std::make_shared<ProfileTables>();
  tables->low = HueSatMap{3, 2, 2, true, {}};
  for (int i = 0; i < 12; ++i) {
    tables->low->node.insert(tables->low->node.end(), {7.0f * static_cast<float>(i), 1.2f, i % 2 == 0 ? 1 : 0.8f});
  }
  tables->look = HueSatMap{1, 2, 1, false, {0, 1, 1, -20, 0.5f, 1.3f}};
  for (const SampleType samples : {SampleType::u8, SampleType::u16}) {
    for (const bool half : {false, true}) {
      DevelopOptions options = options_for({}, samples);
      options.half = half;
      const DevelopPlan plain = planned(frame, options);
      options.profile_tables = tables;
      const DevelopPlan plan = planned(frame, options);
      ASSERT_TRUE(plan.rendering.profile && plan.rendering.profile->map && plan.rendering.profile->look);
      const Picture whole = rendered(frame, plan, never);
      EXPECT_TRUE(same_bits(rendered(frame, plan, small_tiles), whole)) << static_cast<int>(samples) << half;
      EXPECT_FALSE(same_bits(rendered(frame, plain, never), whole));
      const std::size_t planes = 3 * sizeof(float) * static_cast<std::size_t>(plan.width * plan.height);
      EXPECT_EQ(pipeline_bytes(frame.raw, plan, 1, never), pipeline_bytes(frame.raw, plain, 1, never) + planes);
    }
  }
  DevelopOptions linear = options_for({}, SampleType::f32);
  linear.space = OutputSpace::linear_srgb;
  linear.profile_tables = tables;
  EXPECT_FALSE(planned(frame, linear).rendering.profile) << "linear spaces are for measurement";
}

TEST(Tiles, ADarkFrameIsTakenOffInItsPlace) {
  const RawFrame frame = demanding_frame(BayerPhase::gbrg, 523, 391);
  auto dark = std::make_shared<DarkFrame>();
  dark->dn = Plane<float>(523, 391);
  for (int y = 0; y < 391; ++y) {
    for (int x = 0; x < 523; ++x) dark->dn.at(x, y) = static_cast<float>(512 + (7 * x + 11 * y) % 29);
  }
  dark->mean_dn = {526, 526, 526, 526};
  DevelopOptions options = options_for({}, SampleType::u16);
  options.dark_frame = dark;
  const DevelopPlan plan = planned(frame, options);
  EXPECT_TRUE(same_bits(rendered(frame, plan, small_tiles), rendered(frame, plan, never)));
}

/// Of tiled less whole, over the noise of a raw pixel of the same light.
struct Difference {
  double rms = 0;
  double most = 0;
};

Difference difference(const Picture& tiled, const Picture& whole, const DevelopPlan& plan) {
  const auto &a = std::get<SceneLinear>(tiled), &b = std::get<SceneLinear>(whole);
  Difference out;
  double sum = 0;
  for (int c = 0; c < 3; ++c) {
    const double electrons =
        (*plan.levels.electrons_at_white)[0] / (plan.rendering.white_gain[c] * plan.rendering.transform.matrix[4 * c]);
    for (std::size_t i = 0; i < a.plane[c].size(); ++i) {
      const double light_e = electrons * static_cast<double>(b.plane[c].data()[i]);
      const double noise_e = std::sqrt(std::max(light_e, 0.0) + 1.5 * 1.5);
      const double d = electrons * (a.plane[c].data()[i] - b.plane[c].data()[i]) / noise_e;
      sum += d * d;
      out.most = std::max(out.most, std::fabs(d));
    }
  }
  out.rms = std::sqrt(sum / (3.0 * static_cast<double>(a.plane[0].size())));
  return out;
}

// With 256 px of margin this scene has 0.0003 and 0.0114 at most. What a level leaves of the noise of a pixel is 0.05
// and more.
constexpr double max_rms = 0.0008, max_anywhere = 0.012;

/// A piece that took the lines of another place for its own would be seen.
denoise::LineOffsets uneven_lines(denoise::Lines lines, int count) {
  denoise::LineOffsets out{.lines = lines};
  out.offset_e.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) out.offset_e.push_back(0.3 * std::sin(0.01 * i * i));
  return out;
}

TEST(Tiles, WithNoiseReductionTheDifferenceIsFarBelowTheNoise) {
  constexpr std::pair<double, Level> cases[] = {
      {1, Level::standard}, {20, Level::standard}, {200, Level::standard}, {20, Level::draft}, {1, Level::high}};
  for (const auto& [mean_e, level] : cases) {
    RawFrame frame = test::night_frame({.phase = BayerPhase::grbg}, night_scene(mean_e), 1003, 741);
    frame.raw.default_crop = {5, 3, 990, 730};
    DevelopPlan plan = planned(frame, options_for({.mode = Mode::level, .level = level}));
    plan.noise_reduction.lines = {uneven_lines(denoise::Lines::rows, 741), uneven_lines(denoise::Lines::columns, 1003)};
    for (const DemosaicMethod method : all_demosaic_methods) {
      plan.demosaic.demosaic.method = method;
      const Picture whole = rendered(frame, plan, never);
      const Difference found = difference(rendered(frame, plan, small_tiles), whole, plan);
      EXPECT_LT(found.rms, max_rms) << mean_e << " e-, " << name_of(level) << ", " << name_of(method);
      EXPECT_LT(found.most, max_anywhere) << mean_e << " e-, " << name_of(level) << ", " << name_of(method);
      EXPECT_GT(found.most, 0);
    }
  }
}

// What is added to keep means depends on squares of 32 px all around, 0.17 times as much for each one farther away.
TEST(Tiles, MeansOfAreasAreKeptAsInTheWholeFrame) {
  RawFrame frame = test::night_frame({.phase = BayerPhase::grbg}, night_scene(20), 1003, 741);
  frame.raw.default_crop = {5, 3, 990, 730};
  const DevelopPlan plan =
      planned(frame, options_for({.mode = Mode::level, .level = Level::standard, .unbiased_chroma = true}));
  ASSERT_TRUE(plan.noise_reduction.options.keep_means);
  const Difference found = difference(rendered(frame, plan, small_tiles), rendered(frame, plan, never), plan);
  EXPECT_LT(found.rms, max_rms);
  EXPECT_LT(found.most, max_anywhere);
}

TEST(Tiles, StarsAtASeamAreFoundAsInTheWholeFrame) {
  constexpr int star_x = 254, star_y = 255;  // a green site; the seams are at 256
  const auto scene = [](int x, int y) {
    const double e = x / 2 == star_x / 2 && y / 2 == star_y / 2 ? 90 : 5;
    return std::array{e, e, e};
  };
  RawFrame frame = test::night_frame({}, scene, 612, 600);
  // Without noise around the star its value is known exactly.
  constexpr double around_dn = test::night_black_dn + 5 * test::night_gain_dn_per_e;
  for (int y = 0; y < 600; ++y) {
    for (int x = 0; x < 612; ++x) {
      if (x / 2 != star_x / 2 || y / 2 != star_y / 2) frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(around_dn);
    }
  }
  DevelopOptions options = options_for({.mode = Mode::level, .level = Level::standard, .line_noise = false});
  options.find_defects = false;
  DevelopPlan plan = planned(frame, options);
  plan.noise_reduction.options.variance_scale.fill(1);  // not that of the noise that was removed here
  const auto star_e = [&](const TileLimits& limits) {
    const Picture out = rendered(frame, plan, limits);
    return std::get<SceneLinear>(out).plane[1].at(star_x, star_y) * (*plan.levels.electrons_at_white)[1] /
           plan.rendering.white_gain[1];
  };
  const double measured_e = (frame.raw.dn.at(star_x, star_y) - test::night_black_dn) / test::night_gain_dn_per_e;
  EXPECT_NEAR(star_e(small_tiles), measured_e, 0.01);  // as measured, but for what is behind it
  EXPECT_NEAR(star_e(small_tiles), star_e(never), 1e-3);
  plan.noise_reduction.options.keep_point_sources = false;
  EXPECT_GT(std::fabs(star_e(small_tiles) - measured_e), 5);
}

TEST(Tiles, TheNumberOfThreadsDoesNotChangeTheBits) {
  const RawFrame frame = test::night_frame({}, night_scene(20), 777, 533);
  const DevelopPlan plan =
      planned(frame, options_for({.mode = Mode::level, .level = Level::standard}, SampleType::u16));
  PoolExecutor three(3);
  EXPECT_TRUE(same_bits(rendered(frame, plan, small_tiles), rendered(frame, plan, small_tiles, three)));
}

TEST(Tiles, OnlyLargeFramesWithAMosaicOfTheirOwnAreCutUp) {
  const RawFrame frame = demanding_frame(BayerPhase::rggb, 300, 200);
  DevelopPlan plan = planned(frame, options_for({.mode = Mode::level}));
  const auto cut_up = [&](std::int64_t max_px) { return is_tiled(frame.raw, plan, {.max_whole_px = max_px}); };
  EXPECT_TRUE(cut_up(300 * 200 - 1));
  EXPECT_FALSE(cut_up(300 * 200));
  plan.options.denoise.maps = true;
  EXPECT_FALSE(cut_up(0));
  plan.options.denoise.maps = false;
  plan.noise_reduction.temporal = TemporalReduction{};
  EXPECT_FALSE(cut_up(0));
  plan.noise_reduction.temporal.reset();
  plan.rendering.look = LookPlan{.noise_limit = 2};
  EXPECT_FALSE(cut_up(0));
  plan.rendering.look.reset();
  plan.from_codes = true;
  EXPECT_FALSE(cut_up(0));
  plan.from_codes = false;
  RawDn monochrome;
  monochrome.layout = SensorLayout::monochrome;
  monochrome.active = monochrome.default_crop = frame.raw.active;
  EXPECT_FALSE(is_tiled(monochrome, plan, small_tiles));
}

/// 256 px a region; the first column has a level, the second keeps its noise, the third has another.
NoiseRegions three_columns(int rows) {
  NoiseRegions out{.size = 256, .columns = 3, .rows = rows, .level = {}};
  for (int row = 0; row < rows; ++row) {
    out.level.insert(out.level.end(), {Level::standard, std::nullopt, Level::draft});
  }
  return out;
}

TEST(Regions, EqualOnesAreTheWholeFrame) {
  const RawFrame frame = test::night_frame({}, night_scene(20), 700, 500);
  DevelopPlan plan = planned(frame, options_for({.mode = Mode::level, .level = Level::standard}));
  const Picture whole = rendered(frame, plan, never);
  plan.noise_reduction.regions = {.size = 256, .columns = 3, .rows = 2, .level = {6, Level::standard}};
  EXPECT_TRUE(same_bits(rendered(frame, plan, never), whole));
  plan.noise_reduction.level.reset();  // regions say it all
  EXPECT_TRUE(same_bits(rendered(frame, plan, never), whole));
  plan.noise_reduction.regions->level.assign(6, std::nullopt);
  EXPECT_FALSE(plan.noise_reduction.reduces());
  plan.noise_reduction.regions->level.back() = Level::draft;
  EXPECT_TRUE(plan.noise_reduction.reduces());
}

TEST(Regions, EachHasItsOwnLevelInWholeFramesAndInTiles) {
  RawFrame frame = test::night_frame({.dark_e = {3, 4, 5, 6}}, night_scene(20), 700, 500);
  frame.raw.default_crop = {1, 1, 697, 497};
  DevelopOptions options = options_for({.mode = Mode::level, .level = Level::standard});
  options.find_defects = false;
  options.demosaic = DemosaicMethod::malvar;
  DevelopPlan plan = planned(frame, options);
  const Picture standard = rendered(frame, plan, never);
  plan.noise_reduction.level = Level::draft;
  const Picture draft = rendered(frame, plan, never);
  plan.noise_reduction.level.reset();
  const Picture noisy = rendered(frame, plan, never);
  plan.noise_reduction.regions = three_columns(2);
  for (const TileLimits& limits : {never, small_tiles, TileLimits{.max_whole_px = 0, .side_px = 512}}) {
    Picture mixed = rendered(frame, plan, limits);
    const auto part_of = [](const Picture& picture, int first, int last) {
      SceneLinear out(last - first, 497);
      for (int c = 0; c < 3; ++c) {
        for (int y = 0; y < 497; ++y) {
          std::memcpy(out.plane[c].row(y), std::get<SceneLinear>(picture).plane[c].row(y) + first,
                      static_cast<std::size_t>(last - first) * sizeof(float));
        }
      }
      return Picture(std::move(out));
    };
    // Demosaicing reaches 2 px across the seams, which are at 255 and 511 of the picture.
    EXPECT_TRUE(same_bits(part_of(mixed, 258, 508), part_of(noisy, 258, 508)));
    EXPECT_LT(difference(part_of(mixed, 0, 253), part_of(standard, 0, 253), plan).most, max_anywhere);
    EXPECT_LT(difference(part_of(mixed, 514, 697), part_of(draft, 514, 697), plan).most, max_anywhere);
    EXPECT_GT(difference(part_of(mixed, 258, 508), part_of(standard, 258, 508), plan).rms, 0.5);
  }
}

TEST(Regions, WhereNoiseStaysItsVarianceIsThatOfTheModel) {
  const Camera camera{.read_noise_e = 2};
  const RawFrame frame = test::night_frame(camera, denoise_testing::flat(30, 50, 20), 700, 500);
  DevelopPlan plan = planned(frame, options_for({.mode = Mode::level, .level = Level::standard, .maps = true}));
  Pipeline pipeline(one_thread);
  Picture picture = make_picture(plan);
  pipeline.render(frame, plan, picture);
  const NoiseMaps whole = pipeline.take_noise_maps();
  plan.noise_reduction.regions = three_columns(2);
  pipeline.render(frame, plan, picture);
  const NoiseMaps maps = pipeline.take_noise_maps();
  // Means of 256 red, 512 green and 256 blue sites, and of their rounded codes.
  const double model_e2[3] = {34, 54, 24};
  for (int c = 0; c < 3; ++c) {
    const double error_e2 = std::sqrt(model_e2[c] / (c == 1 ? 128 : 64));
    EXPECT_NEAR(maps.site_variance_e2[c].at(150, 100), model_e2[c], 5 * error_e2 + 0.01);
    EXPECT_NEAR(maps.site_variance_e2[c].at(60, 100), whole.site_variance_e2[c].at(60, 100), 0.01 * model_e2[c]);
  }
  const auto& gain = plan.noise_reduction.options.white_gain;
  const double luma_e2 = 0.04 * gain[0] * gain[0] * maps.site_variance_e2[0].at(150, 100) +
                         0.18 * gain[1] * gain[1] * maps.site_variance_e2[1].at(150, 100) +
                         0.04 * gain[2] * gain[2] * maps.site_variance_e2[2].at(150, 100);
  EXPECT_NEAR(maps.residual_variance_e2.at(150, 100), luma_e2, 1e-5 * luma_e2);  // floats
  EXPECT_EQ(maps.chroma_confidence.at(150, 100), 1);
  EXPECT_NEAR(maps.chroma_confidence.at(60, 100), whole.chroma_confidence.at(60, 100), 0.01);
}

/// Of a pipeline that renders a frame once, picture and frame left out.
long held_while_rendering(const RawFrame& frame, const DevelopPlan& plan, const TileLimits& limits) {
  Picture out = make_picture(plan);
  const long before = test::held_bytes;
  test::max_held_bytes = before;
  Pipeline(one_thread, limits).render(frame, plan, out);
  return test::max_held_bytes - before;
}

TEST(PipelineMemory, IsWhatItIsSaidToBe) {
#ifndef LOWLUX_COUNTS_MALLOC
  GTEST_SKIP() << "the denoiser's memory is not counted here";
#endif
  const RawFrame frame = demanding_frame(BayerPhase::rggb, 801, 603);
  constexpr TileLimits larger{.max_whole_px = 0, .side_px = 512};
  for (const TileLimits& limits : {never, small_tiles, larger}) {
    for (const bool half : {false, true}) {
      for (const Mode mode : {Mode::off, Mode::level}) {
        DevelopOptions options = options_for({.mode = mode}, SampleType::u16);
        options.half = half;
        const DevelopPlan plan = planned(frame, options);
        const auto said = static_cast<double>(pipeline_bytes(frame.raw, plan, 1, limits));
        const auto held = static_cast<double>(held_while_rendering(frame, plan, limits));
        EXPECT_LT(held, said + 16384);  // pages, lists of parts, the objects themselves
        EXPECT_GT(held, 0.98 * said);
      }
    }
  }
  DevelopPlan plan = planned(frame, options_for({.mode = Mode::level, .maps = true}));
  plan.noise_reduction.regions = {.size = 512, .columns = 2, .rows = 2, .level = {4, Level::high}};
  plan.noise_reduction.regions->level[1].reset();
  const auto said = static_cast<double>(pipeline_bytes(frame.raw, plan, 1, never));
  EXPECT_NEAR(static_cast<double>(held_while_rendering(frame, plan, never)), said, 0.02 * said);
}

/// Codes, picture and pipeline, per pixel, of a frame to be developed with noise reduction, by eight threads.
double bytes_per_pixel(int width, int height, SampleType samples) {
  RawDn raw;
  raw.active = raw.default_crop = {0, 0, width, height};
  DevelopPlan plan;
  plan.options.samples = samples;
  plan.width = width;
  plan.height = height;
  plan.levels.electrons_at_white = PerSite<double>{1000, 1000, 1000, 1000};
  plan.noise_reduction.level = Level::standard;
  const double pixels = static_cast<double>(width) * height;
  return 2 + (samples == SampleType::u8 ? 3 : 6) + static_cast<double>(pipeline_bytes(raw, plan, 8)) / pixels;
}

TEST(PipelineMemory, IsAtMostFortyBytesPerPixelAndOneGibibyteAtAHundredMegapixels) {
  EXPECT_LT(bytes_per_pixel(4000, 3000, SampleType::u8), 40);
  EXPECT_GT(bytes_per_pixel(5000, 5000, SampleType::u8), 30);  // whole up to 25 MP
  EXPECT_LT(bytes_per_pixel(5002, 5000, SampleType::u8), 20);  // and cut up above
  const double pixels = 12000.0 * 8334, gibibyte = 1073741824;
  EXPECT_LT(pixels * bytes_per_pixel(12000, 8334, SampleType::u8), 0.8 * gibibyte);
  EXPECT_LT(pixels * bytes_per_pixel(12000, 8334, SampleType::u16), gibibyte);
}

}  // namespace
}  // namespace lowlux::isp::tiles_test
