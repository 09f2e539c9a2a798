// Frames of floating-point samples: developed and denoised like codes of the same values, and over a range that codes
// do not have.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>

#include "isp/pipeline/develop.h"
#include "isp/pipeline/finished/clean_raw.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pipeline.h"
#include "isp/pipeline/render/pipeline_memory.h"
#include "tests/pipeline/night_frames.h"
#include "tests/support/as_floats.h"
#include "tests/support/executors.h"
#include "tests/support/raw_frames.h"

namespace lowlux::isp::float_frame_test {
namespace {

using denoise::Level;
using denoise_testing::Camera;
using denoise_testing::flat;
using test::one_thread;
using Mode = DenoiseChoice::Mode;

DevelopOptions linear(const DenoiseChoice& choice = {.mode = Mode::off}) {
  return {.exposure_ev = 0,
          .tone = ToneCurve::none,
          .space = OutputSpace::camera,
          .samples = SampleType::f32,
          .denoise = choice};
}

Picture developed(const RawFrame& frame, const DevelopOptions& options, Executor& with = one_thread) {
  Result<Developed> out = develop(frame, options, with);
  EXPECT_TRUE(out) << out.error().message;
  return std::move(out->picture);
}

template <class Code>
double largest_difference(const Encoded<Code>& a, const Encoded<Code>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.codes.size(); ++i) {
    worst =
        std::max<double>(worst, std::abs(static_cast<int>(a.codes.data()[i]) - static_cast<int>(b.codes.data()[i])));
  }
  return worst;
}

double largest_difference(const SceneLinear& a, const SceneLinear& b) {
  double worst = 0;
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < a.plane[c].size(); ++i) {
      worst = std::max<double>(worst, std::fabs(a.plane[c].data()[i] - b.plane[c].data()[i]));
    }
  }
  return worst;
}

double difference(const Picture& a, const Picture& b) {
  return std::visit(
      [&](const auto& p) {
        const auto& q = std::get<std::remove_cvref_t<decltype(p)>>(b);
        EXPECT_TRUE(p.width() == q.width() && p.height() == q.height());
        return largest_difference(p, q);
      },
      a);
}

bool same_bits(const Plane<float>& a, const Plane<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

/// A night scene with a saturated lamp.
RawFrame night(int width, int height, BayerPhase phase = BayerPhase::grbg) {
  const auto scene = [](int x, int y) {
    auto light = denoise_testing::waves(60)(x, y);
    if (std::hypot(x - 50, y - 40) < 6) light.fill(1e4);
    return light;
  };
  return test::night_frame({.phase = phase}, scene, width, height);
}

RawFrame floats_of(RawFrame frame, double scale = 1) {
  test::make_floats(frame.raw, scale);
  return frame;
}

TEST(FloatFrames, AreDevelopedLikeCodesOfTheSameValues) {
  for (const SampleType samples : {SampleType::u8, SampleType::u16, SampleType::f32}) {
    for (const bool half : {false, true}) {
      for (const double scale : {1.0, 1.0 / 65536}) {
        DevelopOptions options = linear();
        options.half = half;
        options.samples = samples;
        if (samples == SampleType::f32) options.demosaic = DemosaicMethod::malvar;  // residuals amplify rounding: below
        if (samples != SampleType::f32) {
          options.space = OutputSpace::srgb;
          options.tone = ToneCurve::standard;
        }
        const auto plan = plan_develop(floats_of(night(155, 131)), options, one_thread);
        ASSERT_TRUE(plan);
        EXPECT_FALSE(plan->from_codes);
        EXPECT_TRUE(plan_develop(night(155, 131), options, one_thread)->from_codes);
        const Picture codes = developed(night(155, 131), options);
        const double tolerance = samples == SampleType::f32 ? 2e-6 : 1;  // float rounding near 1; one code
        EXPECT_LE(difference(developed(floats_of(night(155, 131), scale), options), codes), tolerance);
      }
    }
  }
}

TEST(FloatFrames, OfAnyLayoutAndSizeAreDevelopedLikeCodes) {
  for (const SensorLayout layout : {SensorLayout::bayer, SensorLayout::monochrome, SensorLayout::linear_rgb}) {
    for (const auto& [width, height] : {std::array{1, 1}, {1, 9}, {9, 1}, {2, 2}, {3, 5}, {61, 43}, {160, 97}}) {
      for (const DemosaicMethod method : {DemosaicMethod::malvar, DemosaicMethod::residual}) {
        RawFrame frame = test::plain_frame(width, height, layout);
        DevelopOptions options = linear();
        options.space = OutputSpace::linear_srgb;
        options.demosaic = method;
        const Picture codes = developed(frame, options);
        const Picture floats = developed(floats_of(std::move(frame), 1.0 / 65536), options);
        // Float rounding of values to 2. With `residual` it also moves the weights and, over the ridge of 0.0006, the
        // slopes: 1.8e-5 was measured, a third of it with a ridge of 0.002.
        const double tolerance = method == DemosaicMethod::malvar ? 4e-6 : 2e-5;
        EXPECT_LE(difference(floats, codes), tolerance) << width << " x " << height << ", " << name_of(method);
      }
    }
  }
}

TEST(FloatFrames, AreDenoisedLikeCodesOfTheSameValuesForAnyNumberOfThreads) {
  for (const Level level : denoise::all_levels) {
    const DevelopOptions options = linear({Mode::level, level});
    const Picture codes = developed(night(155, 131), options);
    for (const int threads : {1, 2, 3, 7}) {
      PoolExecutor pool(threads);
      EXPECT_EQ(difference(developed(floats_of(night(155, 131)), options, pool), codes), 0) << name_of(level);
    }
  }
}

TEST(FloatFrames, ByTilesHaveTheBitsOfTheWholeFrame) {
  RawFrame frame = floats_of(night(701, 523));
  frame.corrections.defects = {{255, 255, 1, 1}, {256, 257, 1, 1}, {511, 300, 1, 1}};
  for (const Mode mode : {Mode::off, Mode::level}) {
    const auto plan = plan_develop(frame, linear({mode, Level::standard}), one_thread);
    ASSERT_TRUE(plan);
    Picture tiled = make_picture(*plan), whole = make_picture(*plan);
    Pipeline(one_thread, {.max_whole_px = 0, .side_px = 256}).render(frame, *plan, tiled);
    Pipeline(one_thread, {.max_whole_px = std::int64_t{1} << 40}).render(frame, *plan, whole);
    if (mode == Mode::off) {
      EXPECT_EQ(difference(tiled, whole), 0);
    } else {
      const RawFrame codes = night(701, 523);
      auto coded_plan = plan_develop(codes, linear({mode, Level::standard}), one_thread);
      coded_plan->levels.defects = plan->levels.defects;
      Picture expected = make_picture(*coded_plan);
      Pipeline(one_thread, {.max_whole_px = 0, .side_px = 256}).render(codes, *coded_plan, expected);
      EXPECT_EQ(difference(tiled, expected), 0);
    }
  }
}

TEST(FloatFrames, StepsAreChosenAsForCodes) {
  const DevelopOptions options{.effects = ProcessingGoal{}};
  const auto codes = plan_develop(night(320, 240), options, one_thread);
  const auto floats = plan_develop(floats_of(night(320, 240)), options, one_thread);
  ASSERT_TRUE(codes && floats);
  EXPECT_EQ(floats->noise_reduction.level, codes->noise_reduction.level);
  EXPECT_EQ(floats->levels.defects, codes->levels.defects);
  EXPECT_LE(difference(developed(floats_of(night(320, 240)), options), developed(night(320, 240), options)), 1);
}

TEST(FloatFrames, HaveNoNoiseOfRounding) {
  RawFrame codes = night(64, 64), floats = floats_of(night(64, 64));
  for (RawFrame* frame : {&codes, &floats}) frame->noise->offset = {};
  const DevelopOptions options = linear({Mode::level, Level::draft});
  const double step_e = 1 / test::night_gain_dn_per_e;
  EXPECT_NEAR(plan_develop(codes, options, one_thread)->noise_reduction.noise.variance_e2[1], step_e * step_e / 12,
              1e-9);
  EXPECT_EQ(plan_develop(floats, options, one_thread)->noise_reduction.noise.variance_e2[1], 0);
  const Picture picture = developed(floats, options);
  for (const auto& plane : std::get<SceneLinear>(picture).plane) {
    EXPECT_TRUE(std::all_of(plane.data(), plane.data() + plane.size(), [](float v) { return std::isfinite(v); }));
  }
}

TEST(FloatFrames, TakeFourBytesForASample) {
  for (const SensorLayout layout : {SensorLayout::bayer, SensorLayout::linear_rgb}) {
    RawFrame frame = test::plain_frame(300, 200, layout);
    const std::size_t samples = frame.raw.samples(), codes = expected_bytes(frame.raw, {}, 2);
    EXPECT_EQ(expected_bytes(floats_of(std::move(frame)).raw, {}, 2) - codes, 2 * samples);
  }
}

TEST(FloatFrames, DarkFramesAreRefused) {
  DevelopOptions options;
  auto dark = std::make_shared<DarkFrame>();
  dark->dn = Plane<float>(64, 64);
  options.dark_frame = dark;
  const auto plan = plan_develop(floats_of(night(64, 64)), options, one_thread);
  ASSERT_FALSE(plan);
  EXPECT_NE(plan.error().message.find("floating-point"), std::string::npos);
}

CleanRaw cleaned(const RawFrame& frame, Level level = Level::standard, Executor& with = one_thread) {
  DevelopOptions options = linear({Mode::level, level});
  options.find_defects = false;
  Result<CleanRaw> out = clean_raw(frame, options, with);
  EXPECT_TRUE(out) << out.error().message;
  return *std::move(out);
}

TEST(CleanFloatFrames, HoldWhatCodesHoldWithoutTheirRounding) {
  const RawFrame floats = floats_of(night(155, 131));
  const CleanRaw codes = cleaned(night(155, 131)), clean = cleaned(floats);
  const RawDn& raw = clean.frame.raw;
  ASSERT_TRUE(raw.is_float());
  EXPECT_TRUE(raw.dn.empty());
  EXPECT_EQ(raw.white_dn, (std::array<double, 3>{1, 1, 1}));
  EXPECT_EQ(raw.black_tag->pattern_dn, std::vector<double>{0});
  const double black = codes.frame.raw.black_tag->pattern_dn[0], range = 65535 - black;
  for (int y = 0; y < raw.rows(); ++y) {
    for (int x = 0; x < raw.row_samples(); ++x) {
      const double code = black + range * static_cast<double>(raw.dn_float.at(x, y));
      ASSERT_NEAR(code, codes.frame.raw.dn.at(x, y), 1.01);  // rounded up or down, by chance
    }
  }
  EXPECT_LT(clean.frame.noise->offset[1], codes.frame.noise->offset[1]);
  EXPECT_TRUE(clean.frame.noise->reduced);
  for (const int threads : {2, 3, 7}) {
    PoolExecutor pool(threads);
    EXPECT_TRUE(same_bits(cleaned(floats, Level::standard, pool).frame.raw.dn_float, raw.dn_float));
  }
}

TEST(CleanFloatFrames, KeepTheMeanOfDarknessAndItsNegativeValues) {
  const Camera camera{.read_noise_e = 8};
  const CleanRaw clean = cleaned(floats_of(test::night_frame(camera, flat(0, 0, 0), 256, 256)));
  const Plane<float>& values = clean.frame.raw.dn_float;
  double sum = 0, negative = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    sum += static_cast<double>(values.data()[i]);
    negative += values.data()[i] < 0 ? 1 : 0;
  }
  const auto n = static_cast<double>(values.size());
  EXPECT_NEAR(sum / n * test::night_full_e(), 0, 5 * std::sqrt(64.01 / n));
  EXPECT_NEAR(negative / n, 0.5, 0.1);
}

TEST(CleanFloatFrames, SaturatedPixelsKeepTheirValueAboveWhite) {
  RawFrame frame = floats_of(test::night_frame({}, flat(10, 20, 15), 96, 96));
  const auto white = static_cast<float>(test::night_white_dn);
  for (int y = 40; y < 48; ++y) {
    for (int x = 40; x < 48; ++x) frame.raw.dn_float.at(x, y) = x < 44 ? white : 3 * white;
  }
  const CleanRaw clean = cleaned(frame);
  const double thrice =
      (3 * test::night_white_dn - test::night_black_dn) / (test::night_white_dn - test::night_black_dn);
  for (int y = 40; y < 48; ++y) {
    EXPECT_EQ(clean.frame.raw.dn_float.at(41, y), 1.0F);
    EXPECT_NEAR(clean.frame.raw.dn_float.at(46, y), thrice, 1e-6 * thrice);
  }
}

constexpr int side = 1024, lamp_x = 700, lamp_y = 300, lamp_px = 12;
constexpr double full_e = 9e8;  // at white
constexpr std::array<double, 3> shadow_e{20, 40, 25}, lamp_e{0.8 * full_e, 0.5 * full_e, 0.1 * full_e};

/// A shadow 24.4 EV below white with its noise, and a lamp just below white.
RawFrame wide_frame(double read_noise_e) {
  RawFrame frame = test::night_frame({}, flat(0, 0, 0), 2, 2);
  frame.raw.dn_float = denoise_testing::exposed({.read_noise_e = read_noise_e},
                                                flat(shadow_e[0], shadow_e[1], shadow_e[2]), side, side, 3);
  frame.raw.dn = {};
  std::mt19937 draw(4);
  std::normal_distribution<double> normal;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      float& value = frame.raw.dn_float.at(x, y);
      const double light = lamp_e[static_cast<std::size_t>(colour_at(frame.raw.phase, x, y))];
      const bool is_lamp = std::hypot(x - lamp_x, y - lamp_y) < lamp_px;
      value =
          static_cast<float>((is_lamp ? light + std::sqrt(light) * normal(draw) : static_cast<double>(value)) / full_e);
    }
  }
  frame.raw.active = frame.raw.default_crop = {0, 0, side, side};
  frame.raw.black_tag->pattern_dn = {0};
  frame.raw.white_dn.fill(1);
  const double offset = read_noise_e * read_noise_e / (full_e * full_e);
  frame.noise = NoiseProfile{.scale = {1 / full_e, 1 / full_e, 1 / full_e}, .offset = {offset, offset, offset}};
  return frame;
}

/// Means of the shadow away from the lamp, and of the lamp's inside [e-], of R, G and B.
struct WideMeans {
  std::array<double, 3> shadow{}, lamp{};
  double shadow_pixels = 0;
};

WideMeans means_of(const RawDn& raw) {
  WideMeans out;
  std::array<double, 3> n{}, lamp_n{};
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const auto c = static_cast<std::size_t>(colour_at(raw.phase, x, y));
      const double distance = std::hypot(x - lamp_x, y - lamp_y),
                   e = full_e * static_cast<double>(raw.dn_float.at(x, y));
      if (distance > lamp_px + 64) {
        out.shadow[c] += e;
        ++n[c];
      } else if (distance < lamp_px - 4) {
        out.lamp[c] += e;
        ++lamp_n[c];
      }
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    out.shadow[c] /= n[c];
    out.lamp[c] /= lamp_n[c];
    out.shadow_pixels += n[c];
  }
  return out;
}

/// Mean of the four sites of a cell.
double cell_mean(const std::array<double, 3>& colours) { return (colours[0] + 2 * colours[1] + colours[2]) / 4; }

TEST(WideRange, DevelopingKeepsEachValueOver24Ev) {
  const RawFrame frame = wide_frame(2);
  DevelopOptions options = linear();
  options.find_defects = false;
  options.half = true;  // means of 2 x 2 cells, which no interpolation touches
  const Picture picture = developed(frame, options);
  const auto plan = plan_develop(frame, options, one_thread);
  double worst = 0;
  for (int c = 0; c < 3; ++c) {
    const double gain =
        plan->rendering.white_gain[static_cast<std::size_t>(c)] * plan->rendering.transform.matrix[4 * c];
    const Plane<float>& plane = std::get<SceneLinear>(picture).plane[static_cast<std::size_t>(c)];
    for (int y = 0; y < side / 2; ++y) {
      for (int x = 0; x < side / 2; ++x) {
        double sum = 0, n = 0;
        for (int site = 0; site < 4; ++site) {
          const int column = 2 * x + (site & 1), row = 2 * y + (site >> 1);
          if (static_cast<int>(colour_at(frame.raw.phase, column, row)) != c) continue;
          sum += static_cast<double>(frame.raw.dn_float.at(column, row));
          ++n;
        }
        const double expected = gain * sum / n, unit = std::max(std::fabs(expected), 1 / full_e);  // or one electron
        worst = std::max(worst, std::fabs(static_cast<double>(plane.at(x, y)) - expected) / unit);
      }
    }
  }
  EXPECT_LT(worst, 1e-6);  // float rounding of four operations
}

TEST(WideRange, DenoisingKeepsTheMeanOfShadowsAndTheColourOfLampsOver24Ev) {
  const RawFrame frame = wide_frame(2);
  const WideMeans before = means_of(frame.raw);
  const double truth = cell_mean(shadow_e);
  const double error = 5 * std::sqrt((truth + 4) / before.shadow_pixels) / truth;  // five standard errors
  ASSERT_LT(error, 1e-3);
  for (const Level level : {Level::draft, Level::standard, Level::best}) {
    const WideMeans after = means_of(cleaned(frame, level).frame.raw);
    EXPECT_NEAR(cell_mean(after.shadow), truth, error * truth) << name_of(level);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(after.lamp[c], lamp_e[c], 1e-3 * lamp_e[c]) << name_of(level);
  }
}

}  // namespace
}  // namespace lowlux::isp::float_frame_test
