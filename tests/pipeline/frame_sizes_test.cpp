#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <span>
#include <string>
#include <variant>

#include "isp/pipeline/finished/clean_raw.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/frame_tiles.h"
#include "isp/pipeline/render/pipeline.h"
#include "tests/pipeline/live_frames.h"
#include "tests/support/executors.h"
#include "tests/support/frame_sizes.h"
#include "tests/support/ramp_frame.h"

/// Every way through the pipeline at any frame size, against the truth.
namespace lowlux::isp {
namespace {

using denoise::Level;
using test::FrameSize;
using test::Ramp;
using test::two_threads;
using Mode = DenoiseChoice::Mode;

constexpr std::uint64_t seed = 20261123;
constexpr TileLimits never{.max_whole_px = std::int64_t{1} << 40};
constexpr TileLimits small_tiles{.max_whole_px = 0, .side_px = 256};

/// One frame of a sequence, and what is known of it.
struct Case {
  std::uint32_t index = 0;
  Ramp ramp;
  Level level = Level::standard;
  RawFrame frame;

  Case(std::uint32_t i, FrameSize size)
      : index(i), ramp{size, static_cast<BayerPhase>(i % 4)}, level(denoise::all_levels[i / 2 % 3]) {
    frame = test::night_frame({.phase = ramp.phase, .read_noise_e = ramp.read_noise_e}, denoise_testing::flat(0, 0, 0),
                              2, 2);
    expose(seed + i);
  }
  void expose(std::uint64_t with_seed) {
    frame.raw.dn = ramp.codes(test::night_gain_dn_per_e, test::night_black_dn, with_seed);
    frame.raw.active = frame.raw.default_crop = {0, 0, ramp.size.width, ramp.size.height};
  }
  std::string text() const {
    return "seed " + std::to_string(seed) + ", size " + std::to_string(index) + ": " + ramp.size.text() + ", " +
           std::string(name_of(level));
  }
};

Case drawn_case(std::uint32_t index) { return {index, test::drawn_size(seed, index, 2, 150'000)}; }

DevelopOptions linear(const DenoiseChoice& choice) {
  return {.exposure_ev = 0,
          .tone = ToneCurve::none,
          .space = OutputSpace::camera,
          .samples = SampleType::f32,
          .denoise = choice};
}

DevelopPlan planned(const Case& of, const DevelopOptions& options) {
  Result<DevelopPlan> plan = plan_develop(of.frame, options, two_threads);
  EXPECT_TRUE(plan) << plan.error().message;
  return *std::move(plan);
}

DevelopPlan planned(const Case& of) { return planned(of, linear({.mode = Mode::level, .level = of.level})); }

SceneLinear rendered(Pipeline& pipeline, const Case& of, const DevelopPlan& plan) {
  Picture out = make_picture(plan);
  pipeline.render(of.frame, plan, out);
  return std::get<SceneLinear>(std::move(out));
}

SceneLinear rendered(const Case& of, const DevelopPlan& plan, const TileLimits& limits) {
  Pipeline pipeline(two_threads, limits);
  return rendered(pipeline, of, plan);
}

/// Electrons for a sample of 1 of each colour. At a site of its own colour, demosaicing changes nothing.
std::array<double, 3> unit_e(const DevelopPlan& plan) {
  std::array<double, 3> out{};
  for (std::size_t c = 0; c < 3; ++c) {
    out[c] = test::night_full_e() / (plan.rendering.white_gain[c] * plan.rendering.transform.matrix[4 * c]);
  }
  return out;
}

void expect_truth(const Case& of, const DevelopPlan& plan, const SceneLinear& picture) {
  const auto unit = unit_e(plan);
  expect_means_of(of.ramp, [&](int x, int y) {
    const auto c = static_cast<std::size_t>(colour_at(of.ramp.phase, x, y));
    return unit[c] * static_cast<double>(picture.plane[c].at(x, y));
  });
}

/// Greatest difference, over the noise of a raw value.
double difference(const Case& of, const DevelopPlan& plan, const SceneLinear& a, const SceneLinear& b) {
  const auto unit = unit_e(plan);
  double most = 0;
  for (int y = 0; y < of.ramp.size.height; ++y) {
    for (int x = 0; x < of.ramp.size.width; ++x) {
      const auto c = static_cast<std::size_t>(colour_at(of.ramp.phase, x, y));
      const double d = unit[c] * static_cast<double>(a.plane[c].at(x, y) - b.plane[c].at(x, y));
      most = std::max(most, std::abs(d) / std::sqrt(of.ramp.variance_e2(of.ramp.mean_e(x, y))));
    }
  }
  return most;
}

void expect_half(const Case& of) {
  DevelopOptions options = linear({.mode = Mode::level, .level = of.level});
  options.half = true;
  const DevelopPlan plan = planned(of, options);
  const SceneLinear half = rendered(of, plan, {});
  const auto unit = unit_e(plan);
  // Sites of the last odd column or row are in no cell: the ramp's own value stands in for them.
  expect_means_of(of.ramp, [&](int x, int y) {
    const auto c = static_cast<std::size_t>(colour_at(of.ramp.phase, x, y));
    if (x / 2 >= half.plane[c].width() || y / 2 >= half.plane[c].height()) return of.ramp.mean_e(x, y);
    return unit[c] * static_cast<double>(half.plane[c].at(x / 2, y / 2));
  });
}

void expect_clean_raw(const Case& of) {
  const Result<CleanRaw> clean = clean_raw(of.frame, linear({.mode = Mode::level, .level = of.level}), two_threads);
  ASSERT_TRUE(clean) << clean.error().message;
  const RawDn& raw = clean->frame.raw;
  const double black = raw.black_tag->pattern_dn[0], unit = test::night_full_e() / (raw.white_dn[0] - black);
  expect_means_of(of.ramp, [&](int x, int y) { return unit * (raw.dn.at(x, y) - black); });
}

void expect_live(const Case& of, bool temporal) {
  LiveSetup setup = live_testing::setup_of(of.frame);
  setup.format.phase = of.ramp.phase;
  setup.temporal = temporal;
  setup.most = Level::high;
  const auto live = live_testing::live_of(setup, two_threads);
  LiveFacts facts = live_testing::known();
  facts.denoise = {.mode = LiveDenoise::Mode::level, .level = of.level};
  Case frames = {of.index, of.ramp.size};
  for (int i = 0; i < (temporal ? 3 : 1); ++i) {
    frames.expose(seed + 1000 * i);
    live_testing::read(*live, frames.frame);
    ASSERT_TRUE(live->plan(facts));
    Plane<std::uint16_t> codes(of.ramp.size.width, of.ramp.size.height);
    live->render_mosaic(codes.view());
    expect_means_of(of.ramp, [&](int x, int y) {
      return (codes.at(x, y) / 4.0 - test::night_black_dn) / test::night_gain_dn_per_e;
    });
  }
}

/// Levels drawn for each square of 256 pixels, none among them.
NoiseRegions drawn_regions(const Case& of) {
  NoiseRegions out{.size = tile_lattice_px};
  out.columns = (of.ramp.size.width + out.size - 1) / out.size;
  out.rows = (of.ramp.size.height + out.size - 1) / out.size;
  for (int i = 0; i < out.columns * out.rows; ++i) {
    const auto word = words_at({.seed = seed + of.index}, static_cast<std::uint32_t>(i), 2)[0] % 4;
    out.level.push_back(word == 3 ? std::nullopt : std::optional(denoise::all_levels[word]));
  }
  return out;
}

template <class Work>
void for_drawn_cases(std::uint32_t count, const Work& work) {
  for (std::uint32_t i = 0; i < test::drawn_sizes(count); ++i) {
    const Case of = drawn_case(i);
    SCOPED_TRACE(of.text());
    work(of);
  }
}

TEST(FrameSizes, WholeFramesAreTheTruthInTheMean) {
  for_drawn_cases(40, [](const Case& of) {
    const DevelopPlan plan = planned(of);
    expect_truth(of, plan, rendered(of, plan, never));
    const DevelopPlan noisy = planned(of, linear({}));
    expect_truth(of, noisy, rendered(of, noisy, never));
  });
}

TEST(FrameSizes, TilesAreTheTruthInTheMeanAndNearTheWholeFrame) {
  for_drawn_cases(40, [](const Case& of) {
    const DevelopPlan plan = planned(of);
    const SceneLinear tiled = rendered(of, plan, small_tiles);
    expect_truth(of, plan, tiled);
    // As in tiles_test; this scene is smoother.
    EXPECT_LT(difference(of, plan, tiled, rendered(of, plan, never)), 0.012);
  });
}

TEST(FrameSizes, RegionsOfDifferentLevelsAreTheTruthInTheMean) {
  for_drawn_cases(40, [](const Case& of) {
    DevelopPlan plan = planned(of);
    plan.noise_reduction.regions = drawn_regions(of);
    expect_truth(of, plan, rendered(of, plan, never));
    expect_truth(of, plan, rendered(of, plan, small_tiles));
  });
}

TEST(FrameSizes, HalfSizeFramesAreTheTruthInTheMean) { for_drawn_cases(40, expect_half); }

TEST(FrameSizes, CleanRawsAreTheTruthInTheMean) { for_drawn_cases(40, expect_clean_raw); }

TEST(FrameSizes, LiveFramesAreTheTruthInTheMean) {
  for_drawn_cases(40, [](const Case& of) { expect_live(of, false); });
}

TEST(FrameSizes, LiveFramesWithTheirHistoryAreTheTruthInTheMean) {
  for_drawn_cases(40, [](const Case& of) { expect_live(of, true); });
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(NDEBUG)
constexpr std::int64_t max_pixels = 6'000'000;  // what is larger takes minutes
#else
constexpr std::int64_t max_pixels = 200'000'000;
#endif

// Frames of cameras as a whole, of up to 30 megapixels in another way too, in turn; scripts/nightly takes every way
// with every camera. The denoiser and the stage go through the width of each.
TEST(FrameSizes, CamerasFramesAreTheTruthInTheMean) {
  const bool nightly = std::getenv("LOWLUX_NIGHTLY") != nullptr;
  std::uint32_t ways = 0;
  for (const std::uint32_t i : test::drawn_cameras(seed, max_pixels)) {
    const auto& [name, size] = test::camera_sizes[i];
    const Case of(i + 1, size);
    SCOPED_TRACE(std::string(name) + ", " + of.text());
    const DevelopPlan plan = planned(of);
    expect_truth(of, plan, rendered(of, plan, {}));
    const std::uint32_t other = size.pixels() < 30'000'000 ? ways++ % 3 : 3;
    if (nightly || other == 0) expect_half(of);
    if (nightly || other == 1) expect_clean_raw(of);
    if (nightly || other == 2) expect_live(of, false);
  }
}

}  // namespace
}  // namespace lowlux::isp
