#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>

#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pipeline.h"
#include "isp/render/local_tone.h"
#include "isp/render/output_space.h"
#include "tests/pipeline/night_frames.h"
#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

using denoise::Level;
using test::one_thread;

DevelopOptions floats(const DenoiseChoice& denoise = {}) {
  return {.exposure_ev = 0,
          .tone = ToneCurve::none,
          .space = OutputSpace::linear_srgb,
          .samples = SampleType::f32,
          .denoise = denoise};
}

/// An orange lamp whose channels saturate one after the other, and an unsaturated grey.
RawFrame lamp_frame() {
  return test::night_frame(
      {},
      [](int x, int y) {
        const double light = 9000 * std::exp(-0.5 * std::pow(std::hypot(x - 100, y - 80) / 12, 2)) + 20;
        return std::array{light, light, 0.15 * light};
      },
      200, 160);
}

SceneLinear image_of(const RawFrame& frame, const DevelopOptions& options, Executor& executor = one_thread) {
  Result<Developed> developed = develop(frame, options, executor);
  EXPECT_TRUE(developed) << developed.error().message;
  return std::get<SceneLinear>(std::move(developed->picture));
}

bool same_bits(const SceneLinear& a, const SceneLinear& b) {
  bool same = a.width() == b.width() && a.height() == b.height();
  for (int c = 0; c < 3 && same; ++c) {
    same = std::memcmp(a.plane[c].data(), b.plane[c].data(), sizeof(float) * a.plane[c].size()) == 0;
  }
  return same;
}

TEST(Highlights, ALampKeepsItsColourAndGainsLight) {
  const RawFrame frame = lamp_frame();
  DevelopOptions options = floats();
  const SceneLinear clipped = image_of(frame, options);
  options.highlights = Highlights::reconstruct;
  const SceneLinear rebuilt = image_of(frame, options);
  const auto at = [](const SceneLinear& image, int x) {
    return Vector3{image.plane[0].at(x, 80), image.plane[1].at(x, 80), image.plane[2].at(x, 80)};
  };
  // The neutral of the frame is (0.5, 1, 0.625): the lamp is (2, 1, 0.24) in linear sRGB. Red and green are cut at 1.
  EXPECT_NEAR(at(clipped, 112)[0], 1, 1e-3);
  EXPECT_NEAR(at(clipped, 112)[1], 1, 1e-3);
  const Vector3 lamp = at(rebuilt, 104);
  EXPECT_NEAR(lamp[0] / lamp[1], 2, 0.2);
  EXPECT_NEAR(lamp[2] / lamp[1], 0.24, 0.06);
  EXPECT_GT(lamp[1], 1.2);
  const Vector3 dim_before = at(clipped, 160), dim_after = at(rebuilt, 160);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(dim_before[c], dim_after[c]) << "nothing but highlights changes";
}

TEST(Highlights, TheToneCurveMakesRoomForWhatIsRebuilt) {
  const RawFrame frame = lamp_frame();
  DevelopOptions options{.exposure_ev = 1};
  const auto clip = plan_develop(frame, options, one_thread);
  options.highlights = Highlights::reconstruct;
  const auto rebuilt = plan_develop(frame, options, one_thread);
  ASSERT_TRUE(clip && rebuilt);
  EXPECT_EQ(clip->rendering.limit, 2);
  EXPECT_NEAR(rebuilt->rendering.limit, 4, 1e-6);  // red saturates at twice the level of green
}

/// Returns the variance of the luminance of linear sRGB.
double variance_of(const SceneLinear& image) {
  double sum = 0, squares = 0;
  const int border = 16;
  for (int y = border; y < image.height() - border; ++y) {
    for (int x = border; x < image.width() - border; ++x) {
      const double v =
          0.2126 * image.plane[0].at(x, y) + 0.7152 * image.plane[1].at(x, y) + 0.0722 * image.plane[2].at(x, y);
      sum += v, squares += v * v;
    }
  }
  const double n = (image.width() - 2.0 * border) * (image.height() - 2.0 * border);
  return squares / n - (sum / n) * (sum / n);
}

TEST(Sharpening, PureNoiseIsNotRaisedBeforeOrAfterNoiseReduction) {
  for (const double light_e : {0.0, 20.0, 1000.0}) {
    const RawFrame frame =
        test::night_frame({.read_noise_e = 3}, denoise_testing::flat(light_e / 2, light_e, light_e * 0.625), 256, 256);
    for (const DenoiseChoice& choice :
         {DenoiseChoice{.mode = DenoiseChoice::Mode::off}, DenoiseChoice{DenoiseChoice::Mode::level, Level::draft},
          DenoiseChoice{DenoiseChoice::Mode::level, Level::standard}}) {
      for (const DemosaicMethod method : all_demosaic_methods) {
        DevelopOptions options = floats(choice);
        options.demosaic = method;
        const double before = variance_of(image_of(frame, options));
        options.sharpen_px = 0.7;
        const double after = variance_of(image_of(frame, options));
        EXPECT_LE(after, 1.05 * before) << light_e << " e-, demosaic " << name_of(method);
      }
    }
  }
}

TEST(Sharpening, DetailAboveTheNoiseIsSharpened) {
  const auto edges = [](int x, int y) {
    const double light = (x / 12 + y / 12) % 2 == 0 ? 2600.0 : 500.0;
    return std::array{light / 2, light, light * 0.625};
  };
  const RawFrame frame = test::night_frame({}, edges, 200, 160);
  for (const DenoiseChoice& choice : {DenoiseChoice{}, DenoiseChoice{DenoiseChoice::Mode::level, Level::draft}}) {
    DevelopOptions options = floats(choice);
    const double before = variance_of(image_of(frame, options));
    options.sharpen_px = 0.7;
    EXPECT_GT(variance_of(image_of(frame, options)), 1.02 * before);
  }
}

TEST(Sharpening, WithoutKnownNoiseIsLeftOutWithAWarning) {
  RawFrame frame = lamp_frame();
  frame.noise.reset();
  DevelopOptions options = floats();
  const SceneLinear plain = image_of(frame, options);
  options.sharpen_px = 0.7;
  const auto plan = plan_develop(frame, options, one_thread);
  ASSERT_TRUE(plan);
  EXPECT_FALSE(plan->sharpen_px);
  ASSERT_FALSE(plan->warnings.empty());
  EXPECT_NE(plan->warnings.back().find("not sharpened"), std::string::npos);
  EXPECT_TRUE(same_bits(plain, image_of(frame, options)));
}

TEST(Finishing, HasTheSameBitsForAnyThreadsAndWhereTilesAreAskedFor) {
  const RawFrame frame = lamp_frame();
  DevelopOptions options = floats({DenoiseChoice::Mode::level, Level::draft});
  options.highlights = Highlights::reconstruct;
  options.sharpen_px = 0.6;
  const SceneLinear one = image_of(frame, options);
  EXPECT_TRUE(same_bits(one, image_of(frame, options, test::two_threads)));
  const auto plan = plan_develop(frame, options, one_thread);
  Picture tiled = make_picture(*plan);
  Pipeline(one_thread, {.max_whole_px = 0, .side_px = 64}).render(frame, *plan, tiled);
  EXPECT_TRUE(same_bits(one, std::get<SceneLinear>(tiled)));
}

Encoded16 codes_of(const RawFrame& frame, const DevelopOptions& options, Executor& executor = one_thread) {
  Result<Developed> developed = develop(frame, options, executor);
  EXPECT_TRUE(developed) << developed.error().message;
  return std::get<Encoded16>(std::move(developed->picture));
}

struct Lightness {
  double mean = 0, std = 0;
};

/// Returns mean and standard deviation of CIE L* of grey sRGB codes, 16 px from the border.
Lightness lightness_of(const Encoded16& picture) {
  double sum = 0, squares = 0, n = 0;
  for (int y = 16; y < picture.height() - 16; ++y) {
    for (int x = 16; x < picture.width() - 16; ++x, ++n) {
      double light = 0;
      for (int c = 0; c < 3; ++c) {
        const double weight[]{0.2126, 0.7152, 0.0722};
        light += weight[c] * decode_transfer(OutputSpace::srgb, picture.codes.at(3 * x + c, y) / 65535.0);
      }
      const double l = light > 216.0 / 24389 ? 116 * std::cbrt(light) - 16 : 24389.0 / 27 * light;
      sum += l, squares += l * l;
    }
  }
  return {sum / n, std::sqrt(squares / n - (sum / n) * (sum / n))};
}

TEST(LocalTone, FlatFramesAreLiftedByTheFormula) {
  for (const double light_e : {30.0, 300.0, 3000.0}) {
    const RawFrame frame =
        test::night_frame({.read_noise_e = 1}, denoise_testing::flat(light_e / 2, light_e, light_e * 0.625), 256, 256);
    for (const double limit_ev : {0.0, 2.0}) {
      DevelopOptions options{.exposure_ev = limit_ev,
                             .samples = SampleType::u16,
                             .denoise = {DenoiseChoice::Mode::level, Level::standard}};
      options.local_tone = 0.5;
      const double level = light_e / test::night_full_e() * std::exp2(limit_ev), limit = std::exp2(limit_ev);
      const double base = std::log2(level / 0.18), white = std::log2(limit / 0.18);
      const double ev = base < 0 ? -0.5 * base / (1 - base / 6) : -0.5 * base * (1 - base / white);
      const double shown = apply_tone(ToneCurve::standard, level * std::exp2(ev), limit);
      const double expected = shown > 216.0 / 24389 ? 116 * std::cbrt(shown) - 16 : 24389.0 / 27 * shown;
      EXPECT_NEAR(lightness_of(codes_of(frame, options)).mean, expected, 0.5)
          << light_e << " e-, " << limit_ev << " EV";
    }
  }
}

// The limit is for the steepest toe that the tone curve may have.
TEST(LocalTone, DarkFramesAreNotLiftedBeyondWhatTheirNoiseAllows) {
  int lifted = 0;
  for (const double light_e : {0.5, 1.0, 2.0, 5.0, 10.0, 20.0}) {
    const RawFrame frame =
        test::night_frame({.read_noise_e = 3}, denoise_testing::flat(light_e / 2, light_e, light_e * 0.625), 256, 256);
    for (const DenoiseChoice& choice :
         {DenoiseChoice{.mode = DenoiseChoice::Mode::off}, DenoiseChoice{DenoiseChoice::Mode::level, Level::draft}}) {
      DevelopOptions options{.exposure_ev = 3, .samples = SampleType::u16, .denoise = choice};
      const Lightness before = lightness_of(codes_of(frame, options));
      options.local_tone = 1;
      const Lightness after = lightness_of(codes_of(frame, options));
      EXPECT_LE(after.std, std::max(local_tone_noise, 1.02 * before.std)) << light_e << " e-";
      EXPECT_GE(after.mean, 0.99 * before.mean) << light_e << " e-";
      lifted += after.mean > before.mean + 2;
    }
  }
  EXPECT_GE(lifted, 3);
}

TEST(LocalTone, WithoutKnownNoiseIsNotLimitedAndSaysSo) {
  RawFrame frame = lamp_frame();
  DevelopOptions options{.exposure_ev = 0};
  options.local_tone = 0.5;
  const auto known = plan_develop(frame, options, one_thread);
  frame.noise.reset();
  const auto unknown = plan_develop(frame, options, one_thread);
  ASSERT_TRUE(known && unknown);
  EXPECT_TRUE(known->local_tone_by_noise);
  EXPECT_FALSE(unknown->local_tone_by_noise);
  ASSERT_FALSE(unknown->warnings.empty());
  EXPECT_NE(unknown->warnings.back().find("--local-tone"), std::string::npos);
}

TEST(LocalTone, HasTheSameCodesForAnyThreadsAndWhereTilesAreAskedFor) {
  const RawFrame frame = lamp_frame();
  DevelopOptions options{.exposure_ev = 1,
                         .highlights = Highlights::reconstruct,
                         .samples = SampleType::u16,
                         .denoise = {DenoiseChoice::Mode::level, Level::draft}};
  options.local_tone = 0.6;
  for (const std::optional<double>& sharpen_px : {std::optional<double>(), std::optional(0.6)}) {
    options.sharpen_px = sharpen_px;
    const Encoded16 one = codes_of(frame, options), two = codes_of(frame, options, test::two_threads);
    const auto same = [&](const Encoded16& other) {
      return std::equal(one.codes.data(), one.codes.data() + one.codes.size(), other.codes.data());
    };
    EXPECT_TRUE(same(two));
    const auto plan = plan_develop(frame, options, one_thread);
    Picture tiled = make_picture(*plan);
    Pipeline(one_thread, {.max_whole_px = 0, .side_px = 64}).render(frame, *plan, tiled);
    EXPECT_TRUE(same(std::get<Encoded16>(tiled)));
    options.local_tone = 0;
    EXPECT_FALSE(same(codes_of(frame, options)));
    options.local_tone = 0.6;
  }
}

TEST(Adjustments, NeutralValuesChangeNoCodeAndOthersDo) {
  const RawFrame frame = lamp_frame();
  const auto codes = [&](const DevelopOptions& options) {
    Result<Developed> developed = develop(frame, options, one_thread);
    EXPECT_TRUE(developed) << developed.error().message;
    return std::get<Encoded8>(std::move(developed->picture)).codes;
  };
  const auto same = [](const Plane<std::uint8_t>& a, const Plane<std::uint8_t>& b) {
    return std::memcmp(a.data(), b.data(), a.size()) == 0;
  };
  const DevelopOptions plain{.exposure_ev = 1};
  const auto before = codes(plain);
  EXPECT_TRUE(same(before, codes({.exposure_ev = 1, .tone_shape = {0, 1}, .saturation = 1})));
  EXPECT_FALSE(same(before, codes({.exposure_ev = 1, .tone_shape = {0.5, 1}})));
  EXPECT_FALSE(same(before, codes({.exposure_ev = 1, .tone_shape = {0, 1.2}})));
  const auto grey = codes({.exposure_ev = 1, .saturation = 0});
  for (int x = 0; x < 200; ++x) {
    EXPECT_EQ(grey.at(3 * x, 80), grey.at(3 * x + 1, 80));
    EXPECT_EQ(grey.at(3 * x + 2, 80), grey.at(3 * x + 1, 80));
  }
}

TEST(Adjustments, AnOffsetIsAddedToTheAutomaticExposure) {
  const RawFrame frame = lamp_frame();
  const auto automatic = plan_develop(frame, {}, one_thread);
  const auto brighter = plan_develop(frame, {.exposure_offset_ev = 0.75}, one_thread);
  ASSERT_TRUE(automatic && brighter);
  EXPECT_NEAR(brighter->rendering.exposure_ev - automatic->rendering.exposure_ev, 0.75, 1e-12);
  EXPECT_EQ(brighter->rendering.exposure_rule, automatic->rendering.exposure_rule);
}

TEST(Adjustments, ANightWhoseLightIsKnownStaysDark) {
  RawFrame frame = test::night_frame({.read_noise_e = 0.5}, denoise_testing::flat(15, 30, 18.75), 256, 256);
  const auto unknown = plan_develop(frame, {}, one_thread);
  frame.raw.info.exposure_s = 8;  // saturates at 78 * 4 / (0.65 * 800 * 8) = 0.075 cd/m2
  frame.raw.info.f_number = 2;
  frame.raw.info.iso = 800;
  const auto night = plan_develop(frame, {}, one_thread);
  ASSERT_TRUE(unknown && night);
  EXPECT_EQ(unknown->rendering.exposure_rule, "mid-grey");
  EXPECT_EQ(night->rendering.exposure_rule, "night");
  const double median_cd_m2 = 0.075 * 30 / test::night_full_e();
  const double key = 1.03 - 2 / (2 + std::log10(median_cd_m2 + 1));
  EXPECT_NEAR(night->rendering.exposure_ev - unknown->rendering.exposure_ev, std::log2(key / 0.18),
              1e-3);  // the median holds noise
}

TEST(Adjustments, ThatDoNotFitAreRefused) {
  const RawFrame frame = lamp_frame();
  DevelopOptions contrast = floats(), saturation{.look = {.look = Look::eye}};
  contrast.tone_shape.contrast = 1.2;
  saturation.saturation = 1.5;
  DevelopOptions linear = floats(), eye{.look = {.look = Look::eye}};
  linear.local_tone = eye.local_tone = 0.5;
  for (const DevelopOptions& options : {contrast, saturation, linear, eye}) {
    const auto plan = plan_develop(frame, options, one_thread);
    ASSERT_FALSE(plan);
    EXPECT_EQ(plan.error().code, ErrorCode::invalid_argument);
  }
}

}  // namespace
}  // namespace lowlux::isp
