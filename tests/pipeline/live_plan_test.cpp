#include "isp/pipeline/live/live_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "tests/pipeline/live_frames.h"

namespace lowlux::isp {
namespace {

using namespace live_testing;
using denoise_testing::flat;
using denoise_testing::Scene;
using denoise_testing::waves;

TEST(LivePlanner, ExposureFollowsAStepInLightAndSettlesWithinATenth) {
  InlineExecutor one;
  const RawFrame dark = night(waves(40)), bright = night(waves(400));
  DevelopOptions options;
  options.find_defects = false;
  const double from = plan_develop(dark, options, one)->rendering.exposure_ev;
  const double to = plan_develop(bright, options, one)->rendering.exposure_ev;
  ASSERT_GT(from, to + 1);
  const auto live = live_of(setup_of(dark), one);
  read(*live, dark);
  ASSERT_TRUE(live->plan(known()));
  EXPECT_EQ(live->decided().rendering.exposure_ev, from);
  read(*live, bright);
  double expected = from;
  const int frames = static_cast<int>(std::ceil(std::log(0.1 / (from - to)) / std::log(0.85)));
  for (int i = 1; i <= frames + 5; ++i) {
    ASSERT_TRUE(live->plan(known()));
    // A share of 0.15 of the way with each frame, until a tenth is left.
    expected = to + (from - to) * std::pow(0.85, std::min(i, frames));
    EXPECT_NEAR(live->decided().rendering.exposure_ev, expected, 1e-9) << "frame " << i;
  }
  EXPECT_LE(live->decided().rendering.exposure_ev - to, 0.1);
  live->reset();
  ASSERT_TRUE(live->plan(known()));
  EXPECT_EQ(live->decided().rendering.exposure_ev, to);
}

/// Facts with so many times the gain: fewer electrons of the same codes.
LiveFacts with_gain(double times) {
  LiveFacts facts = known();
  facts.noise = LiveNoise{times * test::night_gain_dn_per_e, {0.1, 0.1, 0.1, 0.1}};
  facts.denoise.mode = LiveDenoise::Mode::automatic;
  return facts;
}

TEST(LivePlanner, LevelsDoNotFlickerAtTheirEdges) {
  InlineExecutor one;
  const RawFrame frame = night(flat(50, 50, 50));
  for (const double edge : {3.0, 20.0, 60.0}) {
    LiveSetup setup = setup_of(frame);
    setup.most = denoise::Level::high;
    const auto live = live_of(setup, one);
    read(*live, frame);
    // By shot noise alone the ratio goes by the root of the gain.
    ASSERT_TRUE(live->plan(with_gain(1)));
    const double at_edge = std::pow(*live->decided().noise_reduction.snr / edge, 2);
    live->reset();
    ASSERT_TRUE(live->plan(with_gain(at_edge)));
    ASSERT_NEAR(*live->decided().noise_reduction.snr, edge, 0.02 * edge);
    const auto level = live->decided().noise_reduction.level;
    for (int i = 0; i < 20; ++i) {
      ASSERT_TRUE(live->plan(with_gain(at_edge * std::pow(1 + 0.05 * std::sin(2.4 * i), 2))));
      EXPECT_EQ(live->decided().noise_reduction.level, level) << "frame " << i;
    }
    // Far from the edge on either side there is no doubt.
    ASSERT_TRUE(live->plan(with_gain(at_edge * 2)));
    EXPECT_EQ(live->decided().noise_reduction.level, level_for(edge / std::sqrt(2)));
    ASSERT_TRUE(live->plan(with_gain(at_edge / 2)));
    EXPECT_EQ(live->decided().noise_reduction.level, level_for(edge * std::sqrt(2)));
  }
}

TEST(LivePlanner, LevelsGoNoHigherThanTheSetupHasMemoryFor) {
  InlineExecutor one;
  const RawFrame frame = night(flat(1, 1, 1));
  const auto live = live_of(setup_of(frame), one);
  read(*live, frame);
  LiveFacts facts = known();
  facts.denoise = {.mode = LiveDenoise::Mode::level, .level = denoise::Level::high};
  ASSERT_TRUE(live->plan(facts));
  EXPECT_EQ(live->decided().noise_reduction.level, denoise::Level::standard);
}

TEST(LivePlanner, LevelsGoNoHigherThanAFrameMayHaveAndTellWhatTheyWouldHaveBeen) {
  InlineExecutor one;
  const RawFrame frame = night(flat(50, 50, 50));
  const auto live = live_of(setup_of(frame), one), free = live_of(setup_of(frame), one);
  read(*live, frame);
  read(*free, frame);
  for (const auto mode : {LiveDenoise::Mode::level, LiveDenoise::Mode::automatic}) {
    LiveFacts facts = with_gain(4);
    facts.denoise = {.mode = mode, .level = denoise::Level::high};
    ASSERT_TRUE(free->plan(facts));
    ASSERT_EQ(free->decided().noise_reduction.level, denoise::Level::standard);
    for (const std::optional<denoise::Level> most :
         {std::optional(denoise::Level::standard), std::optional(denoise::Level::draft),
          std::optional<denoise::Level>{}, std::optional(denoise::Level::best)}) {
      facts.denoise.most = most;
      ASSERT_TRUE(live->plan(facts));
      EXPECT_EQ(live->decided().noise_reduction.level, std::min(most, free->decided().noise_reduction.level));
      EXPECT_EQ(live->decision().level, free->decided().noise_reduction.level) << "as if there were no bound";
      EXPECT_TRUE(live->decision().reducible);
      EXPECT_EQ(live->decided().rendering.exposure_ev, free->decided().rendering.exposure_ev);
    }
  }
}

TEST(LivePlanner, NoiseComesFromTheFramesWhereNothingIsGiven) {
  InlineExecutor one;
  const Scene slope = [](int x, int) { return std::array{1 + 0.4 * x, 1 + 0.6 * x, 1 + 0.5 * x}; };
  const auto live = live_of(setup_of(night(slope, 1, 320, 256)), one);
  LiveFacts facts = known();
  facts.noise.reset();
  facts.denoise.mode = LiveDenoise::Mode::automatic;
  std::optional<NoiseLine> last;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const RawFrame frame = night(slope, seed, 320, 256);
    read(*live, frame);
    ASSERT_TRUE(live->plan(facts));
    EXPECT_EQ(live->decision().noise, LiveSource::frame);
    ASSERT_TRUE(live->decision().measured);
    last = live->decision().measured;
  }
  // The recursion's error is below that of one frame.
  const double gain_dn = live->frame().noise->scale[1] * (test::night_white_dn - test::night_black_dn);
  EXPECT_NEAR(gain_dn, test::night_gain_dn_per_e, 5 * last->gain_error_dn);
  EXPECT_LT(last->gain_error_dn, 0.05 * test::night_gain_dn_per_e);
  EXPECT_EQ(live->decided().noise_reduction.source, NoiseProfile::Source::profile);
  // A frame that tells nothing leaves what is known; without any nothing is reduced.
  read(*live, night(flat(50, 50, 50), 1, 320, 256));
  ASSERT_TRUE(live->plan(facts));
  EXPECT_EQ(live->decision().noise, LiveSource::frame);
  live->reset();
  ASSERT_TRUE(live->plan(facts));
  EXPECT_EQ(live->decision().noise, LiveSource::none);
  EXPECT_FALSE(live->decided().noise_reduction.reduces());
  EXPECT_FALSE(live->decision().reducible || live->decision().level);
}

TEST(LivePlanner, BlackIsGivenElseMaskedElseTheDarkestPlace) {
  InlineExecutor one;
  const Scene hole = [](int x, int y) {
    return x < 64 && y < 64 ? std::array{0.0, 0.0, 0.0} : std::array{60.0, 60.0, 60.0};
  };
  RawFrame frame = night(hole, 1, 256, 200);
  LiveFacts facts = known();
  facts.black_dn.reset();
  const auto whole = live_of(setup_of(frame), one);
  read(*whole, frame);
  ASSERT_TRUE(whole->plan(facts));
  EXPECT_EQ(whole->decision().black, LiveSource::frame);
  for (const double dn : whole->decided().levels.black.pedestal_dn)
    EXPECT_NEAR(dn, test::night_black_dn, 3.1);  // 3 of a tile
  LiveSetup setup = setup_of(frame);
  setup.active = {0, 4, 256, 196};
  setup.masked = {{0, 0, 256, 4}};
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 256; ++x) frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(500 + site_of(x, y));
  }
  const auto bordered = live_of(setup, one);
  read(*bordered, frame);
  ASSERT_TRUE(bordered->plan(facts));
  EXPECT_EQ(bordered->decision().black, LiveSource::masked_pixels);
  EXPECT_EQ(bordered->decided().levels.black.pedestal_dn, (PerSite<double>{500, 501, 502, 503}));
  ASSERT_TRUE(bordered->plan(known()));
  EXPECT_EQ(bordered->decision().black, LiveSource::given);
  EXPECT_EQ(bordered->decided().levels.black.pedestal_dn, *known().black_dn);
}

// The dark charge of masked pixels fills part of the range: what is left for light saturates at less luminance.
TEST(LivePlanner, TheLuminanceOfTheSceneDoesNotDependOnTheDarkCharge) {
  InlineExecutor one;
  const auto mean_cd_m2 = [&](int dark_dn) {
    RawFrame frame = night(waves(60), 1, 256, 200);
    for (int y = 0; y < 200; ++y) {
      for (int x = 0; x < 256; ++x) {
        const double dn = y < 4 ? test::night_black_dn : frame.raw.dn.at(x, y);
        frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(dn + dark_dn);
      }
    }
    LiveSetup setup = setup_of(frame);
    setup.active = {0, 4, 256, 196};
    setup.masked = {{0, 0, 256, 4}};
    setup.look.look = Look::eye;
    LiveFacts facts = known();
    facts.black_dn.reset();
    facts.exposure_s = 2;
    facts.iso = 1600;
    facts.f_number = 2;
    facts.noise->pedestal_dn.emplace();
    facts.noise->pedestal_dn->fill(test::night_black_dn);
    facts.noise->read_variance_dn2 = 10;
    const auto live = live_of(setup, one);
    read(*live, frame);
    const auto planned = live->plan(facts);
    EXPECT_TRUE(planned) << planned.error().message;
    return live->decided().rendering.look->mean_cd_m2;
  };
  const double expected = mean_cd_m2(0);
  EXPECT_GT(expected, 0);
  for (const int dark_dn : {100, 3000}) EXPECT_NEAR(mean_cd_m2(dark_dn), expected, 1e-5 * expected) << dark_dn << " DN";
}

TEST(LivePlanner, SaturationKeepsLuminanceAndTheGivenMatrixIsTaken) {
  InlineExecutor one;
  const RawFrame frame = night(waves(150));
  const auto live = live_of(setup_of(frame), one);
  read(*live, frame);
  LiveFacts facts = known();
  facts.exposure_ev = 0;
  facts.colour_matrix = Matrix3{{{1.6, -0.5, -0.1}, {-0.2, 1.5, -0.3}, {0.1, -0.6, 1.5}}};
  const auto weights_of_luminance = [&] {
    const RgbTransform& t = live->decided().rendering.transform;
    std::array<double, 3> out{};
    for (std::size_t i = 0; i < 9; ++i) out[i % 3] += static_cast<double>(t.luminance[i / 3] * t.matrix[i]);
    return out;
  };
  ASSERT_TRUE(live->plan(facts));
  EXPECT_EQ(live->decided().rendering.exposure_rule, "given");
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_NEAR(live->decided().rendering.transform.matrix[i], (*facts.colour_matrix)[i / 3][i % 3],
                1e-6);  // 0 EV: limit 1
  }
  const std::array<double, 3> expected = weights_of_luminance();
  for (const double saturation : {0.0, 0.5, 1.3, 4.0}) {
    facts.saturation = saturation;
    ASSERT_TRUE(live->plan(facts));
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(weights_of_luminance()[c], expected[c], 2e-6);  // floats
  }
  facts.saturation = 0;
  ASSERT_TRUE(live->plan(facts));
  const auto& grey = live->decided().rendering.transform.matrix;
  for (std::size_t i = 3; i < 9; ++i) EXPECT_NEAR(grey[i], grey[i - 3], 1e-6);
}

TEST(LivePlanner, FramesBeforeKeepTheirScaleWhereTheUnitOfElectronsMoves) {
  InlineExecutor one;
  const Scene slope = [](int x, int) { return std::array{1 + 0.4 * x, 1 + 0.6 * x, 1 + 0.5 * x}; };
  LiveSetup setup = setup_of(night(slope, 1, 320, 256));
  setup.temporal = true;
  const auto live = live_of(setup, one);
  LiveFacts facts = known();
  facts.noise.reset();  // measured on each frame, and followed slowly
  const auto e_per_dn = [&] {
    return (*live->decided().levels.electrons_at_white)[0] / (test::night_white_dn - test::night_black_dn);
  };
  double before = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    read(*live, night(slope, seed, 320, 256));
    ASSERT_TRUE(live->plan(facts));
    const double light = live->decided().noise_reduction.temporal.value().light;
    if (before > 0) {
      EXPECT_NE(e_per_dn(), before);
      EXPECT_NEAR(light, e_per_dn() / before, 1e-12);  // the scene and its codes are the same
    }
    before = e_per_dn();
  }
  // Four times the gain and a quarter of the exposure: the same codes, a quarter of the electrons.
  facts.iso = 100;
  facts.exposure_s = 0.04;
  ASSERT_TRUE(live->plan(facts));
  const double of_unit_gain = live->frame().noise->scale[1];
  facts.iso = 400;
  facts.exposure_s = 0.01;
  ASSERT_TRUE(live->plan(facts));
  EXPECT_NEAR(live->decided().noise_reduction.temporal->light, 0.25,
              0.25 * 0.2);  // 15 % of the way back to what is measured
  EXPECT_GT(live->frame().noise->scale[1], 3 * of_unit_gain);
}

TEST(LivePlanner, FramesBeforeAreForgottenWhereTheyTellNothing) {
  InlineExecutor one;
  const RawFrame frame = night(flat(20, 20, 20));
  LiveSetup setup = setup_of(frame);
  setup.temporal = true;
  const auto live = live_of(setup, one);
  read(*live, frame);
  LiveFacts facts = known();
  const auto restarts = [&] {
    EXPECT_TRUE(live->plan(facts));
    return live->decided().noise_reduction.temporal.value().restart;
  };
  EXPECT_TRUE(restarts());
  EXPECT_FALSE(restarts());
  facts.follows = false;
  EXPECT_TRUE(restarts());
  facts.follows = true;
  EXPECT_FALSE(restarts());
  facts.denoise.temporal = false;
  ASSERT_TRUE(live->plan(facts));
  EXPECT_FALSE(live->decided().noise_reduction.temporal);
  facts.denoise.temporal = true;
  EXPECT_TRUE(restarts());
  live->reset();
  EXPECT_TRUE(restarts());
  facts.exposure_s = 0.04;
  EXPECT_FALSE(restarts());
  EXPECT_EQ(live->decided().noise_reduction.temporal->light, 1);  // that of the frame before is not known
  facts.exposure_s = 0.01;
  EXPECT_FALSE(restarts());
  EXPECT_DOUBLE_EQ(live->decided().noise_reduction.temporal->light, 0.25);
}

TEST(LivePlanner, ExposuresThatCannotBeTellNothingOfTheLight) {
  InlineExecutor one;
  const RawFrame frame = night(flat(20, 20, 20));
  LiveSetup setup = setup_of(frame);
  setup.temporal = true;
  const auto live = live_of(setup, one);
  read(*live, frame);
  LiveFacts facts = known();
  constexpr double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  for (const double exposure_s : {0.0, -1.0, -2.0, inf, nan}) {
    for (const double median_s : {0.01, exposure_s}) {  // after and before one that can be, and twice
      facts.exposure_s = median_s;
      ASSERT_TRUE(live->plan(facts));
      facts.exposure_s = exposure_s;
      ASSERT_TRUE(live->plan(facts));
      EXPECT_EQ(live->decided().noise_reduction.temporal->light, 1) << exposure_s;
    }
  }
  facts.exposure_s = 1e-300;
  ASSERT_TRUE(live->plan(facts));
  facts.exposure_s = 1e300;
  ASSERT_TRUE(live->plan(facts));
  const double light = live->decided().noise_reduction.temporal->light;
  EXPECT_TRUE(std::isfinite(light) && light > 1e6) << light << ": what was before is worth nothing";
}

}  // namespace
}  // namespace lowlux::isp
