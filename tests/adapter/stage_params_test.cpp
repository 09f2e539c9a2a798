#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "isp/adapter/stage_params.h"
#include "tests/adapter/stage_frames.h"

namespace lowlux::stage_params_test {
namespace {

using namespace stage_testing;

constexpr int width = 64, height = 48;
constexpr float nan_f = std::numeric_limits<float>::quiet_NaN();

struct Parameter {
  std::uint32_t bit;
  std::function<void(lowlux_stage_params&, float)> set;
  float low, high;
};

/// Every parameter that has a range; those of several figures once for each figure.
std::vector<Parameter> parameters() {
  using P = lowlux_stage_params;
  std::vector<Parameter> out{
      {LOWLUX_STAGE_HAS_EXPOSURE, [](P& p, float v) { p.exposure_s = v; }, 1.001e-7F, 1e5F},
      {LOWLUX_STAGE_HAS_ANALOGUE_GAIN, [](P& p, float v) { p.analogue_gain = v; }, 0.1F, 1e4F},
      {LOWLUX_STAGE_HAS_DIGITAL_GAIN, [](P& p, float v) { p.digital_gain = v; }, 0.1F, 1e3F},
      {LOWLUX_STAGE_HAS_LUX, [](P& p, float v) { p.lux = v; }, 0, 1e9F},
      {LOWLUX_STAGE_HAS_TEMPERATURE, [](P& p, float v) { p.temperature_c = v; }, -100, 200},
      {LOWLUX_STAGE_HAS_GAMMA, [](P& p, float v) { p.gamma = v; }, 0, 100},
      {LOWLUX_STAGE_HAS_CONTRAST, [](P& p, float v) { p.contrast = v; }, 0, 100},
      {LOWLUX_STAGE_HAS_SATURATION, [](P& p, float v) { p.saturation = v; }, 0, 4},
      {LOWLUX_STAGE_HAS_SHARPNESS, [](P& p, float v) { p.sharpness = v; }, 0, 100},
      {LOWLUX_STAGE_HAS_EXPOSURE_VALUE, [](P& p, float v) { p.exposure_ev = v; }, -10, 20},
      {LOWLUX_STAGE_HAS_NOISE, [](P& p, float v) { p.noise_gain = v; }, 1e-6F, 65535},
      {LOWLUX_STAGE_HAS_NOISE, [](P& p, float v) { p.noise_read = v; }, 0, 65535},
      {LOWLUX_STAGE_HAS_F_NUMBER, [](P& p, float v) { p.f_number = v; }, 0.1F, 1e3F},
      {LOWLUX_STAGE_HAS_SCENE_LUMINANCE, [](P& p, float v) { p.scene_luminance_cd_m2 = v; }, 1.001e-7F, 1e9F},
      {LOWLUX_STAGE_HAS_BUDGET, [](P& p, float v) { p.budget_ms = v; }, 0.01F, 1e6F},
      {LOWLUX_STAGE_HAS_EXPOSURE_LIMITS, [](P& p, float v) { p.max_exposure_s = v; }, 1.001e-7F, 1e5F}};
  for (int i = 0; i < 4; ++i) {
    out.push_back({LOWLUX_STAGE_HAS_BLACK, [i](P& p, float v) { p.black_level[i] = v; }, 0, 65535});
  }
  for (int i = 0; i < 2; ++i) {
    out.push_back({LOWLUX_STAGE_HAS_COLOUR_GAINS, [i](P& p, float v) { p.colour_gains[i] = v; }, 1e-3F, 1e3F});
  }
  for (int i = 0; i < 9; ++i) {
    out.push_back({LOWLUX_STAGE_HAS_COLOUR_MATRIX, [i](P& p, float v) { p.colour_matrix[i] = v; }, -1e3F, 1e3F});
  }
  return out;
}

/// All figures in the middle of what they may be.
lowlux_stage_params usual() {
  auto out = fixed_params({10});
  out.exposure_s = 0.02;
  out.analogue_gain = out.digital_gain = out.saturation = out.f_number = 1;
  out.scene_luminance_cd_m2 = 1;
  out.budget_ms = 1000;
  out.max_exposure_s = 1;
  for (int i = 0; i < 9; i += 4) out.colour_matrix[i] = 1;
  return out;
}

TEST(StageParams, HaveRangesWhoseEndsAreIn) {
  for (const Parameter& parameter : parameters()) {
    auto params = usual();
    params.valid = parameter.bit;
    ASSERT_EQ(isp::fault_of(params), nullptr) << parameter.bit;
    for (const float good : {parameter.low, parameter.high}) {
      parameter.set(params, good);
      EXPECT_EQ(isp::fault_of(params), nullptr) << parameter.bit << ' ' << good;
    }
    const float span = std::max(1e-6F, parameter.high - parameter.low);
    const float below = parameter.low == 1.001e-7F ? 0.99e-7F : std::nextafter(parameter.low, -span);
    for (const float bad : {below, std::nextafter(parameter.high, INFINITY), nan_f, INFINITY, -INFINITY}) {
      parameter.set(params, bad);
      params.valid = parameter.bit;
      EXPECT_NE(isp::fault_of(params), nullptr) << parameter.bit << ' ' << bad;
      params.valid = LOWLUX_STAGE_HAS_ALL & ~parameter.bit;
      EXPECT_EQ(isp::fault_of(params), nullptr) << "not looked at: " << parameter.bit;
    }
  }
}

TEST(StageParams, OfDenoisingAreThoseOfLibcameraAndAutomatic) {
  auto params = usual();
  params.valid = LOWLUX_STAGE_HAS_DENOISE;
  for (params.denoise = -2; params.denoise < 9; ++params.denoise) {
    EXPECT_EQ(isp::fault_of(params) == nullptr, params.denoise >= 0 && params.denoise <= 5) << params.denoise;
  }
}

TEST(StageParams, MayNotHaveBitsOfALaterVersion) {
  auto params = usual();
  for (int bit = 0; bit < 32; ++bit) {
    params.valid = 1U << bit;
    EXPECT_EQ(isp::fault_of(params) != nullptr, bit > 20) << bit;
  }
}

// Whatever is within the ranges leads to a picture or to a named error, and the stage goes on after both.
TEST(StageParams, OfEachExtremeLeaveTheStageAtWork) {
  const RawFormatNames& names = names_of_bayer(10);
  auto settings = plain_settings(2);
  settings.temporal = 1;
  Rig rig(settings, names, width, height, LOWLUX_STAGE_BGR888),
      fresh(settings, names, width, height, LOWLUX_STAGE_BGR888);
  const Codes codes = scene(names.format, width, height);
  auto steady = fixed_params(names.format);
  ASSERT_EQ(fresh.process(codes, steady), LOWLUX_STAGE_OK);
  for (const Parameter& parameter : parameters()) {
    for (const float value : {parameter.low, parameter.high, nan_f}) {
      auto params = usual();
      params.denoise = LOWLUX_STAGE_DENOISE_AUTO;
      params.valid |= parameter.bit;
      parameter.set(params, value);
      const int code = rig.process(codes, params);
      const bool black_is_white = parameter.bit == LOWLUX_STAGE_HAS_BLACK && value == 65535;
      EXPECT_EQ(code, std::isnan(value) || black_is_white ? LOWLUX_STAGE_BAD_PARAMETER : LOWLUX_STAGE_OK)
          << parameter.bit << ' ' << value << ' ' << rig.error();
    }
    ASSERT_EQ(lowlux_stage_reset(rig.stage.get()), LOWLUX_STAGE_OK);
    ASSERT_EQ(rig.process(codes, steady), LOWLUX_STAGE_OK);
    ASSERT_EQ(rig.planes, fresh.planes) << parameter.bit;
  }
}

TEST(StageParams, BlackMustLieBelowWhite) {
  const RawFormatNames& names = names_of_bayer(10);
  auto in = input_of(names, width, height);
  in.white_level = 900;
  Rig rig(plain_settings(), names, in, LOWLUX_STAGE_BGR888);
  const Codes codes = scene(names.format, width, height);
  auto params = fixed_params(names.format);
  params.black_level[2] = 899.9F;
  EXPECT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK) << rig.error();
  params.black_level[2] = 900;
  EXPECT_EQ(rig.process(codes, params), LOWLUX_STAGE_BAD_PARAMETER);
  EXPECT_STREQ(rig.error(), "the white level 900 DN is not above the black level 900 DN, dark charge included");
}

TEST(StageParams, BlackIsInTheOrderRGrGbBWhateverTheMosaicBeginsWith) {
  const float level[] = {40, 50, 60, 70};  // of R, Gr, Gb, B
  for (const auto phase : {BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr}) {
    const RawFormatNames& names = names_of_bayer(10, phase);
    Codes codes(std::size_t{width} * height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const CfaColour colour = colour_at(phase, x & 1, y & 1);
        // A green is Gr beside a red of its row.
        const bool red_beside = colour_at(phase, (x + 1) & 1, y & 1) == CfaColour::red;
        const int i = colour == CfaColour::red ? 0 : colour == CfaColour::blue ? 3 : red_beside ? 1 : 2;
        codes[y * width + x] = static_cast<std::uint16_t>(level[i]);
      }
    }
    Rig rig(plain_settings(), names, width, height, LOWLUX_STAGE_BGR888);
    auto params = fixed_params(names.format);
    std::copy(std::begin(level), std::end(level), params.black_level);
    ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK);
    for (const std::uint8_t code : rig.planes[0]) ASSERT_EQ(code, 0) << static_cast<int>(phase);
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(rig.result.black_level[i], level[i]);
      EXPECT_EQ(rig.statistics.measured_black[i], level[i]) << "of the darkest tiles";
    }
    EXPECT_EQ(rig.result.black_from, LOWLUX_STAGE_FROM_PARAMS);
  }
}

TEST(StageParams, AppliedAreThoseThatTookEffect) {
  const RawFormatNames& names = names_of_bayer(10);
  const Codes codes = scene(names.format, width, height);
  const std::uint32_t plain = LOWLUX_STAGE_HAS_BLACK | LOWLUX_STAGE_HAS_COLOUR_GAINS | LOWLUX_STAGE_HAS_COLOUR_MATRIX |
                              LOWLUX_STAGE_HAS_DENOISE | LOWLUX_STAGE_HAS_SATURATION | LOWLUX_STAGE_HAS_EXPOSURE_VALUE |
                              LOWLUX_STAGE_HAS_NOISE | LOWLUX_STAGE_HAS_SCENE_LUMINANCE | LOWLUX_STAGE_HAS_BUDGET |
                              LOWLUX_STAGE_HAS_EXPOSURE_LIMITS;
  const std::uint32_t of_time = LOWLUX_STAGE_HAS_SEQUENCE | LOWLUX_STAGE_HAS_TIMESTAMP | LOWLUX_STAGE_HAS_EXPOSURE;
  for (const bool temporal : {false, true}) {
    auto settings = plain_settings();
    settings.temporal = temporal ? 1 : 0;
    Rig rig(settings, names, width, height, LOWLUX_STAGE_BGR888);
    auto params = usual();
    params.denoise = LOWLUX_STAGE_DENOISE_FAST;
    params.valid = LOWLUX_STAGE_HAS_ALL;
    ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK) << rig.error();
    EXPECT_EQ(rig.result.applied, plain) << "a first frame with a budget goes without noise reduction";
    ASSERT_EQ(lowlux_stage_reset(rig.stage.get()), LOWLUX_STAGE_OK);
    ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK) << rig.error();
    EXPECT_EQ(rig.result.applied, plain | (temporal ? of_time : 0)) << temporal;
    EXPECT_EQ(rig.result.temporal, 0) << "there are none before";
    EXPECT_EQ(rig.result.level, LOWLUX_STAGE_LEVEL_DRAFT);
    EXPECT_EQ(rig.result.white_from, LOWLUX_STAGE_FROM_PARAMS);
    EXPECT_EQ(rig.result.noise_from, LOWLUX_STAGE_FROM_PARAMS);
    EXPECT_NEAR(rig.result.noise_gain, params.noise_gain, 1e-6 * params.noise_gain);  // relative: floats
    params.valid = 0;
    ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK);
    EXPECT_EQ(rig.result.applied, 0U);
    EXPECT_EQ(rig.result.black_from, LOWLUX_STAGE_FROM_FRAME);
    EXPECT_EQ(rig.result.level == 0 && rig.result.temporal == 0, rig.result.noise_from == LOWLUX_STAGE_FROM_NOTHING);
  }
}

TEST(StageParams, LuxCountOnlyWhereNothingTellsTheLightBetter) {
  const RawFormatNames& names = names_of_bayer(10);
  const Codes codes = scene(names.format, width, height);
  auto settings = plain_settings();
  settings.look = LOWLUX_STAGE_LOOK_EYE;
  Rig rig(settings, names, width, height, LOWLUX_STAGE_BGR888);
  auto params = usual();
  params.lux = 2;
  params.valid |= LOWLUX_STAGE_HAS_LUX;
  ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK) << rig.error();
  EXPECT_NEAR(rig.result.scene_luminance_cd_m2, 0.18 * 2 / M_PI, 1e-6);  // a grey of 18 % under 2 lx; floats
  EXPECT_EQ(rig.result.applied & LOWLUX_STAGE_HAS_LUX, LOWLUX_STAGE_HAS_LUX);
  EXPECT_LT(rig.result.adaptation, 1) << "0.11 cd/m2 are mesopic";
  params.lux = 1e-20F;
  ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK) << rig.error();
  EXPECT_FLOAT_EQ(rig.result.scene_luminance_cd_m2, 1e-7F) << "as dark as scenes can be";
  params.scene_luminance_cd_m2 = 0.5;
  params.valid |= LOWLUX_STAGE_HAS_SCENE_LUMINANCE;
  ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK);
  EXPECT_NEAR(rig.result.scene_luminance_cd_m2, 0.5, 1e-6);
  EXPECT_EQ(rig.result.applied & LOWLUX_STAGE_HAS_LUX, 0U);
  params.valid &= ~(LOWLUX_STAGE_HAS_SCENE_LUMINANCE | LOWLUX_STAGE_HAS_LUX);
  EXPECT_EQ(rig.process(codes, params), LOWLUX_STAGE_UNKNOWN_LIGHT);
  params.valid |= LOWLUX_STAGE_HAS_EXPOSURE | LOWLUX_STAGE_HAS_ANALOGUE_GAIN | LOWLUX_STAGE_HAS_F_NUMBER;
  ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK) << rig.error();
  EXPECT_GT(rig.result.scene_luminance_cd_m2, 0);
}

TEST(StageParams, OfColourMatrixAndSaturationActOnBalancedColours) {
  const RawFormatNames& names = names_of_bayer(12);
  const Codes codes = scene(names.format, width, height);
  const auto picture = [&](const lowlux_stage_params& params) {
    Rig rig(plain_settings(), names, width, height, LOWLUX_STAGE_BGR888);
    EXPECT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK);
    return rig.planes[0];
  };
  auto params = fixed_params(names.format);
  const auto none = picture(params);
  params.valid |= LOWLUX_STAGE_HAS_COLOUR_MATRIX;
  for (int i = 0; i < 9; ++i) params.colour_matrix[i] = i % 4 == 0 ? 1.0F : 0.0F;
  EXPECT_EQ(picture(params), none) << "the identity changes nothing";
  const float swapped[] = {0, 0, 1, 0, 1, 0, 1, 0, 0};
  std::copy(std::begin(swapped), std::end(swapped), params.colour_matrix);
  EXPECT_NE(picture(params), none);
  params.valid |= LOWLUX_STAGE_HAS_SATURATION;
  params.saturation = 0;
  const auto grey = picture(params);
  for (std::size_t i = 0; i < grey.size(); i += 3) {
    ASSERT_NEAR(grey[i], grey[i + 1], 1);  // codes: floats round on either side of a bin's edge
    ASSERT_NEAR(grey[i], grey[i + 2], 1);
  }
}

TEST(StageParams, TheMatrixOfAFrameGivesTheLookOfTheEyeItsColours) {
  const RawFormatNames& names = names_of_bayer(12);
  const Codes codes = scene(names.format, width, height);
  // Returns the mean distance of red from green [codes]: without gains of white balance the scene is green.
  const auto distance = [&](std::int32_t look, bool matrix) {
    auto settings = plain_settings();
    settings.look = look;
    Rig rig(settings, names, width, height, LOWLUX_STAGE_BGR888);
    auto params = fixed_params(names.format);
    params.valid |= LOWLUX_STAGE_HAS_COLOUR_GAINS | LOWLUX_STAGE_HAS_SCENE_LUMINANCE;
    if (matrix) params.valid |= LOWLUX_STAGE_HAS_COLOUR_MATRIX;
    params.colour_gains[0] = params.colour_gains[1] = 1;
    for (int i = 0; i < 9; ++i) params.colour_matrix[i] = i % 4 == 0 ? 1.0F : 0.0F;
    params.scene_luminance_cd_m2 = 0.001F;
    EXPECT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK) << rig.error();
    EXPECT_EQ((rig.result.applied & LOWLUX_STAGE_HAS_COLOUR_MATRIX) != 0, matrix);
    double sum = 0;
    const auto& bgr = rig.planes[0];
    for (std::size_t i = 0; i < bgr.size(); i += 3) sum += static_cast<double>(bgr[i + 1]) - bgr[i + 2];
    return sum / (width * height);
  };
  const double camera = distance(LOWLUX_STAGE_LOOK_CAMERA, true);
  EXPECT_GT(camera, 10);
  EXPECT_NEAR(distance(LOWLUX_STAGE_LOOK_EYE, false), camera, 0.1 * camera);
  EXPECT_LT(std::abs(distance(LOWLUX_STAGE_LOOK_EYE, true)), 0.2 * camera) << "rods alone see no green";
}

TEST(StageParams, OfMonochromeFramesHaveNoColour) {
  for (const RawFormatNames& names : raw_formats()) {
    if (names.format.layout != SensorLayout::monochrome || names.format.bits != 10) continue;
    auto settings = plain_settings(2);
    settings.temporal = 1;
    Rig rig(settings, names, width, height, LOWLUX_STAGE_BGR888);
    auto params = usual();
    params.valid = LOWLUX_STAGE_HAS_ALL & ~LOWLUX_STAGE_HAS_SEQUENCE;
    ASSERT_EQ(rig.process(scene(names.format, width, height), params), LOWLUX_STAGE_OK) << rig.error();
    const auto& rgb = rig.planes[0];
    for (std::size_t i = 0; i < rgb.size(); i += 3) {
      ASSERT_EQ(rgb[i], rgb[i + 1]);
      ASSERT_EQ(rgb[i], rgb[i + 2]);
    }
    EXPECT_GT(rgb[3 * (width - 1)], rgb[0]) << "the bright side is bright";
    EXPECT_EQ(
        rig.result.applied & (LOWLUX_STAGE_HAS_COLOUR_GAINS | LOWLUX_STAGE_HAS_COLOUR_MATRIX |
                              LOWLUX_STAGE_HAS_SATURATION | LOWLUX_STAGE_HAS_DENOISE | LOWLUX_STAGE_HAS_TIMESTAMP),
        0U);
    EXPECT_EQ(rig.result.level, LOWLUX_STAGE_LEVEL_NONE);
    EXPECT_EQ(rig.statistics.sum[0], rig.statistics.sum[2]);
  }
}

TEST(StageParams, OfNoiseReductionTakeNoMemoryForMonochromeFrames) {
  const RawFormatNames& grey = *names_of({12, RawPacking::little16, SensorLayout::monochrome});
  auto settings = plain_settings(2);
  settings.most_denoise = LOWLUX_STAGE_LEVEL_HIGH;
  settings.temporal = 1;
  settings.memory_limit = std::uint64_t{40} << 20;
  const Rig grey_rig(settings, grey, 1600, 1200, LOWLUX_STAGE_BGR888);
  EXPECT_GE(grey_rig.configured, LOWLUX_STAGE_OK) << grey_rig.error();
  const Rig bayer_rig(settings, names_of_bayer(12), 1600, 1200, LOWLUX_STAGE_BGR888);
  EXPECT_EQ(bayer_rig.configured, LOWLUX_STAGE_TOO_LARGE);
}

TEST(StageParams, MaskedPixelsTellBlackUnlessItIsGiven) {
  const RawFormatNames& names = names_of_bayer(12);
  Codes codes = scene(names.format, width, height);
  PerSite<double> sum{};
  constexpr int masked = 8;  // rows
  for (int i = 0; i < width * masked; ++i) {
    codes[i] = static_cast<std::uint16_t>(260 + 10 * noise_at(static_cast<std::uint32_t>(i)));
    sum[site_of(i % width, i / width)] += codes[i];
  }
  auto in = input_of(names, width, height);
  in.masked = {0, 0, width, masked};
  in.crop = {0, masked, width, height - masked};
  Rig rig(plain_settings(), names, in, LOWLUX_STAGE_BGR888);
  ASSERT_EQ(rig.process(codes, no_params()), LOWLUX_STAGE_OK);
  EXPECT_EQ(rig.result.black_from, LOWLUX_STAGE_FROM_MASKED);
  EXPECT_EQ(rig.statistics.measured_black_masked, 1);
  for (int site = 0; site < 4; ++site) {  // of RGGB the sites are R, Gr, Gb, B
    const auto mean = static_cast<float>(sum[site] / (width * masked / 4));
    EXPECT_FLOAT_EQ(rig.result.black_level[site], mean);
    EXPECT_FLOAT_EQ(rig.statistics.measured_black[site], mean);
  }
  ASSERT_EQ(rig.process(codes, fixed_params(names.format)), LOWLUX_STAGE_OK);
  EXPECT_EQ(rig.result.black_from, LOWLUX_STAGE_FROM_PARAMS);
  EXPECT_EQ(rig.result.black_level[0], 256);
}

}  // namespace
}  // namespace lowlux::stage_params_test
