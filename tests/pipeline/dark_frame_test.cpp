#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "tests/support/frames.h"
#include "tests/support/raw_frames.h"

namespace lowlux::isp::dark_frame_test {
namespace {

constexpr int width = 62, height = 46;

const DevelopOptions camera_float{
    .exposure_ev = 0, .tone = ToneCurve::none, .space = OutputSpace::camera, .samples = SampleType::f32};

// A smooth scene on black 256.
RawFrame scene(SensorLayout layout) {
  RawFrame frame = test::plain_frame(width, height, layout, BayerPhase::gbrg);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(300 + 20 * x + 15 * y);
  }
  return frame;
}

// Columns, a glow and a hot pixel.
int pattern_dn(int x, int y) { return 3 * (x % 4) + y / 4 + (x == 20 && y == 21 ? 4000 : 0); }

std::shared_ptr<DarkFrame> dark_of(int pedestal_dn, bool with_pattern) {
  auto dark = std::make_shared<DarkFrame>();
  dark->dn = Plane<float>(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      dark->dn.at(x, y) = static_cast<float>(pedestal_dn + (with_pattern ? pattern_dn(x, y) : 0));
    }
  }
  dark->mean_dn.fill(pedestal_dn);
  dark->noise_std_dn.fill(2);
  return dark;
}

double largest_difference(const Picture& a, const Picture& b) {
  double worst = 0;
  const auto& p = std::get<SceneLinear>(a);
  const auto& q = std::get<SceneLinear>(b);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < p.plane[c].size(); ++i) {
      worst = std::max<double>(worst, std::fabs(p.plane[c].data()[i] - q.plane[c].data()[i]));
    }
  }
  return worst;
}

TEST(DevelopWithDarkFrame, AnEvenDarkIsAGivenBlackPoint) {
  InlineExecutor executor;
  for (const SensorLayout layout : {SensorLayout::bayer, SensorLayout::monochrome}) {
    DevelopOptions given = camera_float, dark = camera_float;
    given.black = {BlackChoice::given, {256, 256, 256, 256}};
    dark.dark_frame = dark_of(256, false);
    const auto a = develop(scene(layout), given, executor), b = develop(scene(layout), dark, executor);
    ASSERT_TRUE(a && b);
    EXPECT_LT(largest_difference(a->picture, b->picture), 2e-6);  // float rounding near 1
    EXPECT_EQ(a->plan.from_codes, layout == SensorLayout::bayer);
    EXPECT_FALSE(b->plan.from_codes);
  }
}

TEST(DevelopWithDarkFrame, ThePatternGoesAndThePictureStays) {
  InlineExecutor executor;
  for (const bool electrons : {false, true}) {
    RawFrame clean = scene(SensorLayout::bayer), patterned = scene(SensorLayout::bayer);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        patterned.raw.dn.at(x, y) = static_cast<std::uint16_t>(patterned.raw.dn.at(x, y) + pattern_dn(x, y));
      }
    }
    DevelopOptions without = camera_float, with = camera_float;
    without.dark_frame = dark_of(256, false);
    with.dark_frame = dark_of(256, true);
    if (electrons) {
      clean.noise = patterned.noise = NoiseProfile{.scale = {1e-4, 2e-4, 3e-4}, .offset = {1e-9, 1e-9, 1e-9}};
    }
    const auto a = develop(clean, without, executor), b = develop(patterned, with, executor);
    ASSERT_TRUE(a && b);
    EXPECT_LT(largest_difference(a->picture, b->picture), 2e-6);
    // The hot pixel is no defect once its dark is off; without a dark frame it is.
    EXPECT_TRUE(b->plan.levels.defects.empty());
    EXPECT_EQ(plan_develop(patterned, camera_float, executor)->levels.defects, (std::vector<Pixel>{{20, 21}}));
  }
}

TEST(DevelopWithDarkFrame, PixelsWhoseDarkIsUnknownAreRepairedAndWarningsPassedOn) {
  InlineExecutor executor;
  RawFrame broken = scene(SensorLayout::bayer);
  broken.raw.dn.at(20, 21) = 65535;
  DevelopOptions options = camera_float;
  options.find_defects = false;
  auto dark = dark_of(256, false);
  dark->unknown = {{20, 21, 1, 1}};
  dark->warnings = {"so it is"};
  options.dark_frame = dark;
  const auto repaired = develop(broken, options, executor);
  ASSERT_TRUE(repaired);
  EXPECT_EQ(repaired->plan.levels.defects, (std::vector<Pixel>{{20, 21}}));
  EXPECT_EQ(repaired->plan.warnings.back(), "so it is");
  EXPECT_EQ(repaired->plan.levels.black.source, BlackPoint::Source::dark_frame);
  const auto sound = develop(scene(SensorLayout::bayer), options, executor);
  ASSERT_TRUE(sound);
  EXPECT_LT(largest_difference(repaired->picture, sound->picture), 2e-6);
}

TEST(DevelopWithDarkFrame, TheNoiseOfAFileIsThatAboveItsTaggedBlack) {
  InlineExecutor executor;
  for (const double dark_dn : {256.0, 1000.0, 30000.0}) {
    RawFrame frame = scene(SensorLayout::bayer);
    frame.raw.black_tag = BlackLevel{.pattern_dn = {256}};
    const double white_dn = frame.raw.white_dn[1], gain_dn_per_e = 2, read_dn = 5;
    const double range_dn = white_dn - 256;
    for (std::size_t c = 0; c < 3; ++c) frame.raw.white_dn[c] = white_dn;
    const double offset = read_dn * read_dn / (range_dn * range_dn), scale = gain_dn_per_e / range_dn;
    frame.noise = NoiseProfile{.scale = {scale, scale, scale}, .offset = {offset, offset, offset}};
    DevelopOptions options = camera_float;
    options.dark_frame = dark_of(dark_dn, false);
    refer_noise_to_black(frame, options);
    const auto plan = plan_develop(frame, options, executor);
    ASSERT_TRUE(plan) << plan.error().message;
    const NoiseProfile& noise = *frame.noise;
    for (int site = 0; site < 4; ++site) {
      const auto colour = static_cast<std::size_t>(colour_at(frame.raw.phase, site & 1, site >> 1));
      const double electrons = (white_dn - plan->levels.black.pedestal_dn[site]) / gain_dn_per_e;
      EXPECT_NEAR(1 / noise.scale[colour], electrons, 1e-9 * electrons) << dark_dn;
      EXPECT_NEAR(noise.offset[colour] * electrons * electrons, std::pow(read_dn / gain_dn_per_e, 2), 1e-9) << dark_dn;
    }
    frame.noise->source = NoiseProfile::Source::profile;  // that of a profile is left as it is
    const NoiseProfile before = *frame.noise;
    refer_noise_to_black(frame, options);
    EXPECT_EQ(frame.noise->scale, before.scale);
  }
}

// Light and dark charge saturate a pixel together: the same light over more dark charge is the same luminance, although
// it is a larger fraction of what is left below white.
TEST(DevelopWithDarkFrame, TheLuminanceOfTheSceneDoesNotDependOnTheDarkCharge) {
  InlineExecutor executor;
  const auto mean_cd_m2 = [&](int dark_dn, bool knows_noise) {
    RawFrame frame = scene(SensorLayout::bayer);
    for (std::size_t i = 0; i < frame.raw.dn.size(); ++i) {
      frame.raw.dn.data()[i] = static_cast<std::uint16_t>(frame.raw.dn.data()[i] + dark_dn);
    }
    frame.raw.black_tag = BlackLevel{.pattern_dn = {256}};
    frame.raw.info.f_number = 2;
    frame.raw.info.iso = 1600;
    frame.raw.info.exposure_s = 0.5;
    if (knows_noise) frame.noise = NoiseProfile{.scale = {1e-3, 1e-3, 1e-3}, .offset = {1e-7, 1e-7, 1e-7}};
    DevelopOptions options;
    options.look.look = Look::eye;
    options.dark_frame = dark_of(256 + dark_dn, false);
    const auto plan = plan_develop(frame, options, executor);
    EXPECT_TRUE(plan) << plan.error().message;
    return plan->rendering.look->mean_cd_m2;
  };
  for (const bool knows_noise : {false, true}) {
    const double expected = mean_cd_m2(0, knows_noise);
    EXPECT_GT(expected, 0.001);
    for (const int dark_dn : {10, 1000, 9000}) {
      EXPECT_NEAR(mean_cd_m2(dark_dn, knows_noise), expected, 1e-5 * expected) << dark_dn << " DN, " << knows_noise;
    }
  }
}

TEST(DevelopWithDarkFrame, ADarkOfAnotherSizeIsAnError) {
  InlineExecutor executor;
  DevelopOptions options = camera_float;
  auto dark = dark_of(256, false);
  dark->dn = Plane<float>(width, height - 1);
  options.dark_frame = dark;
  EXPECT_EQ(plan_develop(scene(SensorLayout::bayer), options, executor).error().code, ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lowlux::isp::dark_frame_test
