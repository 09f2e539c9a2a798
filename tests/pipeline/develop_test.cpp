#include "isp/pipeline/develop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pipeline.h"
#include "isp/render/output_space.h"
#include "tests/support/executors.h"
#include "tests/support/frames.h"

namespace lowlux::isp {
namespace {

using test::one_thread;

// A smooth scene with a camera whose RGB is linear sRGB, seen through a neutral of (0.5, 1, 0.625).
RawFrame sample_frame(int width = 62, int height = 46) {
  RawFrame frame;
  frame.raw = test::bayer_frame(width, height, BayerPhase::gbrg,
                                [](int x, int y) { return 300 + 20 * x + 15 * y + (x * y) % 11; });
  frame.raw.black_tag->pattern_dn = {256};
  const Matrix3 xyz_to_srgb{{{3.2406, -1.5372, -0.4986}, {-0.9689, 1.8758, 0.0415}, {0.0557, -0.2040, 1.0570}}};
  frame.colour.calibrations = {{.cct_k = 6504, .xyz_to_camera = diagonal3({0.5, 1, 0.625}) * xyz_to_srgb}};
  frame.colour.as_shot_neutral = Vector3{0.5, 1, 0.625};
  frame.colour.source = CameraColour::Source::file_tags;
  return frame;
}

const DevelopOptions linear_float{.exposure_ev = 0,
                                  .tone = ToneCurve::none,
                                  .space = OutputSpace::linear_srgb,
                                  .samples = SampleType::f32,
                                  .demosaic = DemosaicMethod::malvar};
const DevelopOptions camera_float{.exposure_ev = 0,
                                  .tone = ToneCurve::none,
                                  .space = OutputSpace::camera,
                                  .samples = SampleType::f32,
                                  .demosaic = DemosaicMethod::malvar};

SceneLinear float_picture(const RawFrame& frame, const DevelopOptions& options) {
  Result<Developed> developed = develop(frame, options, one_thread);
  EXPECT_TRUE(developed) << developed.error().message;
  return std::get<SceneLinear>(std::move(developed->picture));
}

double largest_difference(const SceneLinear& a, const SceneLinear& b) {
  double worst = 0;
  EXPECT_EQ(a.width(), b.width());
  EXPECT_EQ(a.height(), b.height());
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < a.plane[c].size(); ++i) {
      worst = std::max<double>(worst, std::fabs(a.plane[c].data()[i] - b.plane[c].data()[i]));
    }
  }
  return worst;
}

TEST(Develop, ClippedHighlightsAreNeutralWhite) {
  RawFrame frame = sample_frame();
  std::fill_n(frame.raw.dn.data(), frame.raw.dn.size(), std::uint16_t{4095});
  const SceneLinear out = float_picture(frame, linear_float);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(out.plane[c].at(30, 20), 1.0, 2e-4);  // rounded sRGB matrix of the sample camera
  const auto coded = develop(frame, {}, one_thread);
  ASSERT_TRUE(coded);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(std::get<Encoded8>(coded->picture).codes.at(3 * 30 + c, 20), 255);
}

TEST(Develop, CodesAndFloatMosaicsGiveTheSamePicture) {
  const RawFrame from_codes = sample_frame();
  RawFrame from_floats = sample_frame();
  from_floats.corrections.gain_maps = {{.bottom = 46, .right = 62, .gain = {1.0f + 1e-7f}}};  // forces the float mosaic
  RawFrame from_electrons = sample_frame();
  from_electrons.corrections = from_floats.corrections;
  from_electrons.noise = NoiseProfile{.scale = {1e-4, 2e-4, 3e-4}, .offset = {1e-6, 1e-6, 1e-6}};
  const auto plan = plan_develop(from_codes, linear_float, one_thread);
  const auto float_plan = plan_develop(from_floats, linear_float, one_thread);
  ASSERT_TRUE(plan && float_plan);
  EXPECT_TRUE(plan->from_codes);
  EXPECT_FALSE(float_plan->from_codes);
  const SceneLinear reference = float_picture(from_codes, linear_float);
  EXPECT_LT(largest_difference(reference, float_picture(from_floats, linear_float)), 2e-6);  // float rounding near 1
  EXPECT_LT(largest_difference(reference, float_picture(from_electrons, linear_float)), 2e-6);
}

TEST(Develop, GainMapsMultiplyAfterBlackIsOff) {
  RawFrame frame = sample_frame();
  frame.corrections.gain_maps = {{.bottom = 46, .right = 62, .gain = {1.5f}}};
  const SceneLinear plain = float_picture(sample_frame(), camera_float);
  SceneLinear scaled = float_picture(frame, camera_float);
  for (auto& plane : scaled.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] /= 1.5f;
  }
  EXPECT_LT(largest_difference(plain, scaled), 2e-6);
}

TEST(Develop, NamedDefectsAreRepaired) {
  RawFrame sound = sample_frame();
  for (std::size_t i = 0; i < sound.raw.dn.size(); ++i) sound.raw.dn.data()[i] = 1000;
  RawFrame broken = sample_frame();
  for (std::size_t i = 0; i < broken.raw.dn.size(); ++i) broken.raw.dn.data()[i] = 1000;
  broken.raw.dn.at(20, 20) = 0;
  broken.raw.dn.at(31, 17) = 4095;
  broken.corrections.defects = {{20, 20, 1, 1}, {31, 17, 1, 1}};
  DevelopOptions options = linear_float;
  options.find_defects = false;
  EXPECT_LT(largest_difference(float_picture(sound, options), float_picture(broken, options)), 1e-6);
  EXPECT_EQ(plan_develop(broken, options, one_thread)->levels.defects.size(), 2u);
}

TEST(Develop, DefaultCropIsAWindowOfTheActiveArea) {
  RawFrame whole = sample_frame();
  RawFrame cropped = sample_frame();
  cropped.raw.default_crop = {9, 7, 40, 30};
  const SceneLinear a = float_picture(whole, linear_float);
  const SceneLinear b = float_picture(cropped, linear_float);
  ASSERT_EQ(b.width(), 40);
  ASSERT_EQ(b.height(), 30);
  for (int y = 2; y < 28; ++y) {  // the demosaicing filters reach two pixels beyond the crop
    for (int x = 2; x < 38; ++x) {
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(b.plane[c].at(x, y), a.plane[c].at(x + 9, y + 7), 1e-6);
    }
  }
}

TEST(Develop, OddActiveOriginsKeepTheColours) {
  // The same scene read out with a border of 3 columns and 5 rows.
  const RawFrame plain = sample_frame();
  RawFrame bordered = sample_frame();
  Plane<std::uint16_t> readout(62 + 3, 46 + 5);
  std::fill_n(readout.data(), readout.size(), std::uint16_t{9});
  for (int y = 0; y < 46; ++y) {
    for (int x = 0; x < 62; ++x) readout.at(x + 3, y + 5) = plain.raw.dn.at(x, y);
  }
  bordered.raw.dn = std::move(readout);
  bordered.raw.active = {3, 5, 62, 46};
  EXPECT_EQ(largest_difference(float_picture(plain, linear_float), float_picture(bordered, linear_float)), 0);
}

TEST(Develop, PerSiteBlackReachesEverySite) {
  RawFrame frame = sample_frame();
  for (int y = 0; y < 46; ++y) {
    for (int x = 0; x < 62; ++x) frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(200 + 10 * site_of(x, y));
  }
  frame.raw.black_tag = BlackLevel{.rows = 2, .columns = 2, .pattern_dn = {200, 210, 220, 230}};
  const SceneLinear out = float_picture(frame, camera_float);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(out.plane[c].at(31, 20), 0);
}

TEST(Develop, CameraRgbKeepsWhatLiesBelowBlackAndAboveWhite) {
  RawFrame frame = sample_frame();
  for (std::size_t i = 0; i < frame.raw.dn.size(); ++i) frame.raw.dn.data()[i] = i < 31 * 46 ? 100 : 4095;
  frame.raw.white_dn = {4000, 4000, 4000};
  const SceneLinear out = float_picture(frame, camera_float);
  EXPECT_NEAR(out.plane[1].at(5, 5), (100 - 256) / 3744.0, 1e-6);
  EXPECT_NEAR(out.plane[1].at(50, 40), (4095 - 256) / 3744.0, 1e-6);
}

TEST(Develop, MonochromeFramesAreGreyInEverySpace) {
  RawFrame frame = sample_frame();
  frame.raw.layout = SensorLayout::monochrome;
  frame.colour = {};
  const auto coded = develop(frame, {}, one_thread);
  ASSERT_TRUE(coded) << coded.error().message;
  const auto& codes = std::get<Encoded8>(coded->picture).codes;
  for (int y = 0; y < codes.height(); ++y) {
    for (int x = 0; x < 62; ++x) {
      ASSERT_EQ(codes.at(3 * x, y), codes.at(3 * x + 1, y));
      ASSERT_EQ(codes.at(3 * x, y), codes.at(3 * x + 2, y));
    }
  }
  DevelopOptions half = camera_float;
  half.half = true;
  const SceneLinear out = float_picture(frame, half);
  EXPECT_EQ(out.width(), 31);
  const auto dn = [&](int x, int y) { return frame.raw.dn.at(x, y); };
  EXPECT_NEAR(out.plane[2].at(3, 4), ((dn(6, 8) + dn(7, 8) + dn(6, 9) + dn(7, 9)) / 4.0 - 256) / 3839, 1e-6);
}

TEST(Develop, DemosaicedFramesAreNotDemosaicedAgain) {
  RawFrame frame = sample_frame();
  frame.raw.layout = SensorLayout::linear_rgb;
  frame.raw.dn = Plane<std::uint16_t>(3 * 10, 8);
  for (std::size_t i = 0; i < frame.raw.dn.size(); ++i)
    frame.raw.dn.data()[i] = static_cast<std::uint16_t>(256 + 7 * i);
  frame.raw.active = frame.raw.default_crop = {0, 0, 10, 8};
  frame.raw.black_tag = BlackLevel{.samples = 3, .pattern_dn = {256, 256, 256}};
  const SceneLinear out = float_picture(frame, camera_float);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(out.plane[c].at(4, 5), 7 * (30 * 5 + 12 + c) / 3839.0, 1e-6);
}

TEST(Develop, ExposureIsAGainInEv) {
  DevelopOptions brighter = linear_float;
  brighter.exposure_ev = 1.5;
  const SceneLinear plain = float_picture(sample_frame(), linear_float);
  SceneLinear lifted = float_picture(sample_frame(), brighter);
  for (auto& plane : lifted.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] /= static_cast<float>(std::exp2(1.5));
  }
  EXPECT_LT(largest_difference(plain, lifted), 1e-6);
}

TEST(Develop, AFrameOfBlackNoiseStaysBlack) {
  test::NormalDn normal(1);
  RawFrame frame = sample_frame();
  frame.raw = test::bayer_frame(256, 256, BayerPhase::rggb, [&](int, int) { return normal(256, 8); });
  frame.raw.black_tag->pattern_dn = {256};
  const auto developed = develop(frame, {}, one_thread);
  ASSERT_TRUE(developed);
  double mean = 0;
  const auto& codes = std::get<Encoded8>(developed->picture).codes;
  for (std::size_t i = 0; i < codes.size(); ++i) mean += codes.data()[i];
  EXPECT_LT(mean / static_cast<double>(codes.size()), 16);
}

TEST(Develop, MissingColourIsAnErrorOfMeasurementsThatNamesTheWayOut) {
  RawFrame frame = sample_frame();
  frame.colour = {};
  for (const OutputSpace space : {OutputSpace::linear_srgb, OutputSpace::xyz}) {
    const auto developed =
        develop(frame, {.tone = ToneCurve::none, .space = space, .samples = SampleType::f32}, one_thread);
    ASSERT_FALSE(developed);
    EXPECT_NE(developed.error().message.find("--space camera"), std::string::npos);
  }
  DevelopOptions night;
  night.look.look = Look::eye;
  EXPECT_FALSE(develop(frame, night, one_thread));
  EXPECT_TRUE(develop(frame, camera_float, one_thread));
}

// Camera RGB shown as sRGB is what a camera with the colours of sRGB shows.
TEST(Develop, UnknownColoursAreShownAsThoseOfSrgbWithOneWarning) {
  RawFrame unknown = sample_frame(), srgb = sample_frame();
  unknown.colour = {.as_shot_neutral = Vector3{0.5, 1, 0.7}};
  srgb.colour = unknown.colour;
  srgb.colour.calibrations = {
      {.cct_k = 6504, .xyz_to_camera = diagonal3({0.5, 1, 0.7}) * *xyz_to_output(OutputSpace::linear_srgb)}};
  DevelopOptions options;
  options.exposure_ev = 0;
  const auto shown = develop(unknown, options, one_thread), expected = develop(srgb, options, one_thread);
  ASSERT_TRUE(shown && expected);
  const auto &a = std::get<Encoded8>(shown->picture).codes, &b = std::get<Encoded8>(expected->picture).codes;
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a.data()[i], b.data()[i], 1) << i;  // D65 is not the 6504 K
  EXPECT_EQ(shown->plan.warnings.size(), expected->plan.warnings.size() + 1);
  EXPECT_NE(shown->plan.warnings.front().find("as shot. --profile"), std::string::npos) << shown->plan.warnings.front();
  options.white_balance.mode = WhiteBalanceChoice::Mode::gains;
  options.white_balance.gains = {2, 1, 1.5};
  const auto given = develop(unknown, options, one_thread);
  ASSERT_TRUE(given);
  EXPECT_NE(given->plan.warnings.front().find("of the given gains. --profile"), std::string::npos)
      << given->plan.warnings.front();
  options.white_balance.mode = WhiteBalanceChoice::Mode::picked;
  options.white_balance.picked = {.x = 20, .y = 20};
  const auto picked = develop(unknown, options, one_thread);
  ASSERT_TRUE(picked) << picked.error().message;
  EXPECT_NE(picked->plan.warnings.front().find("of the picked pixel. --profile"), std::string::npos)
      << picked->plan.warnings.front();
}

TEST(Develop, MatricesThatMakeNoLightOfTheWhiteAreErrorsThatNameTheWayOut) {
  RawFrame frame = sample_frame();
  frame.colour.calibrations[0].xyz_to_camera = diagonal3({1, -1, 1});  // every camera RGB becomes a negative luminance
  for (const auto mode : {WhiteBalanceChoice::Mode::as_shot, WhiteBalanceChoice::Mode::automatic}) {
    const auto developed = develop(frame, {.white_balance = {mode}}, one_thread);
    ASSERT_FALSE(developed);
    EXPECT_NE(developed.error().message.find("--space camera"), std::string::npos) << developed.error().message;
  }
  EXPECT_TRUE(develop(frame, camera_float, one_thread));
}

TEST(Develop, OptionsThatContradictEachOtherAreErrors) {
  EXPECT_FALSE(develop(sample_frame(),
                       {.tone = ToneCurve::standard, .space = OutputSpace::linear_srgb, .samples = SampleType::f32},
                       one_thread));
  EXPECT_FALSE(develop(sample_frame(),
                       {.tone = ToneCurve::none, .space = OutputSpace::srgb, .samples = SampleType::f32}, one_thread));
  EXPECT_FALSE(develop(sample_frame(), {.space = OutputSpace::camera, .samples = SampleType::u16}, one_thread));
  DevelopOptions half{.half = true};
  EXPECT_FALSE(develop(sample_frame(1, 1), half, one_thread));
}

TEST(Develop, TheSmallestFramesDevelop) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {7, 1}, {2, 2}, {3, 3}, {5, 4}}) {
    EXPECT_TRUE(develop(sample_frame(width, height), {}, one_thread)) << width << "x" << height;
  }
}

TEST(Pipeline, ReusedForManyFramesGivesWhatASingleUseGives) {
  Pipeline pipeline(one_thread);
  for (const int width : {62, 30, 62, 90}) {
    const RawFrame frame = sample_frame(width, 46);
    for (const bool half : {false, true}) {
      DevelopOptions options = linear_float;
      options.half = half;
      const auto plan = plan_develop(frame, options, one_thread);
      ASSERT_TRUE(plan);
      Picture picture = make_picture(*plan);
      pipeline.render(frame, *plan, picture);
      EXPECT_EQ(largest_difference(std::get<SceneLinear>(picture), float_picture(frame, options)), 0);
    }
  }
}

TEST(Pipeline, AnyThreadCountGivesTheSameBytes) {
  RawFrame frame = sample_frame(301, 203);
  frame.corrections.gain_maps = {
      {.bottom = 203, .right = 301, .points_v = 2, .points_h = 2, .gain = {1, 1.1f, 1.2f, 1.4f}}};
  const auto one = develop(frame, {}, one_thread);
  ASSERT_TRUE(one);
  for (const int threads : {2, 3, 7}) {
    PoolExecutor pool(threads);
    const auto many = develop(frame, {}, pool);
    ASSERT_TRUE(many);
    const auto& a = std::get<Encoded8>(one->picture).codes;
    const auto& b = std::get<Encoded8>(many->picture).codes;
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size()), 0) << threads;
  }
}

}  // namespace
}  // namespace lowlux::isp
