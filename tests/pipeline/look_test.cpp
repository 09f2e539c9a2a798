#include "isp/pipeline/plan/look.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/model/colour/colour_difference.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "isp/model/vision/night_eye.h"
#include "isp/model/vision/retina.h"
#include "isp/model/vision/scene_light.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/render/output_space.h"
#include "tests/pipeline/night_frames.h"

namespace lowlux::isp::look_test {
namespace {

constexpr int width = 192, height = 128;

// White, grey, red, green and blue fields, and a fine grating below.
RawFrame coloured_frame() {
  denoise_testing::Camera camera;
  const denoise_testing::Scene scene = [](double x, double y) -> std::array<double, 3> {
    if (y > 96)
      return {500 + 400 * std::cos(2 * M_PI * x / 6), 1000 + 800 * std::cos(2 * M_PI * x / 6),
              625 + 500 * std::cos(2 * M_PI * x / 6)};
    const int field = static_cast<int>(x * 4 / width);
    const std::array<std::array<double, 3>, 4> rgb{
        {{0.5, 0.5, 0.5}, {0.8, 0.1, 0.1}, {0.1, 0.8, 0.1}, {0.1, 0.1, 0.8}}};
    return {1000 * rgb[field][0], 2000 * rgb[field][1], 1250 * rgb[field][2]};
  };
  return test::night_frame(camera, scene, width, height);
}

DevelopOptions eye_at(double cd_m2) {
  DevelopOptions o{.tone = ToneCurve::none, .space = OutputSpace::linear_srgb, .samples = SampleType::f32};
  o.exposure_ev = 0;
  o.look.look = Look::eye;
  o.look.scene_luminance_cd_m2 = cd_m2;
  o.look.field_of_view_deg = 4;
  return o;
}

SceneLinear seen(const DevelopOptions& options) {
  InlineExecutor executor;
  Result<Developed> developed = develop(coloured_frame(), options, executor);
  EXPECT_TRUE(developed) << developed.error().message;
  return std::get<SceneLinear>(std::move(developed->picture));
}

// Mean RGB of the middle of one of the four fields.
std::array<double, 3> field_of(const SceneLinear& picture, int field) {
  std::array<double, 3> sum{};
  for (int y = 32; y < 64; ++y) {
    for (int x = 0; x < 16; ++x) {
      for (int c = 0; c < 3; ++c) sum[c] += picture.plane[c].at(field * width / 4 + 16 + x, y) / (32.0 * 16);
    }
  }
  return sum;
}

double luminance(const std::array<double, 3>& rgb) { return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]; }

double saturation(const std::array<double, 3>& rgb) {
  const double y = luminance(rgb);
  return std::hypot(std::hypot(rgb[0] - y, rgb[1] - y), rgb[2] - y) / y;
}

TEST(EyeLook, OfABrightSceneIsThatOfTheCamera) {
  DevelopOptions camera = eye_at(1000);
  camera.look = {};
  const SceneLinear bright = seen(eye_at(1000)), plain = seen(camera);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < plain.plane[c].size(); ++i) {
      ASSERT_NEAR(bright.plane[c].data()[i], plain.plane[c].data()[i], 1e-5);
    }
  }
}

TEST(EyeLook, WithoutEffectsChangesNoBit) {
  DevelopOptions none = eye_at(0.01), camera = eye_at(0.01);
  none.look.which = LookChoice::Which::listed;
  none.look.listed = {false, false, false, false, false, false};
  camera.look = {};
  const SceneLinear seen_so = seen(none), plain = seen(camera);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < plain.plane[c].size(); ++i) {
      ASSERT_EQ(seen_so.plane[c].data()[i], plain.plane[c].data()[i]);
    }
  }
}

TEST(EyeLook, MapsTheProbabilityOfSeeingAndLeavesThePictureAsItIs) {
  InlineExecutor executor;
  double last = 0;
  for (const double cd_m2 : {1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1.0, 1e4}) {
    DevelopOptions with = eye_at(cd_m2);
    with.look.seeing_map = true;
    const auto mapped = develop(coloured_frame(), with, executor),
               plain = develop(coloured_frame(), eye_at(cd_m2), executor);
    ASSERT_TRUE(mapped && plain);
    EXPECT_EQ(plain->seeing_map.size(), 0);
    EXPECT_FALSE(plain->plan.rendering.look->retina);
    ASSERT_EQ(mapped->seeing_map.width(), (mapped->plan.width + 3) / 4);
    ASSERT_EQ(mapped->seeing_map.height(), (mapped->plan.height + 3) / 4);
    const RetinaPlan& retina = *mapped->plan.rendering.look->retina;
    EXPECT_GE(*retina.seen_fraction, last) << cd_m2;
    last = *retina.seen_fraction;
    EXPECT_NEAR(retina.pupil_mm, adapted_pupil_mm(cd_m2), 1e-12);
    const auto& a = std::get<SceneLinear>(mapped->picture);
    const auto& b = std::get<SceneLinear>(plain->picture);
    for (int c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < a.plane[c].size(); ++i) ASSERT_EQ(a.plane[c].data()[i], b.plane[c].data()[i]);
    }
  }
  EXPECT_EQ(last, 1) << "all is seen by day";
}

// The mean of fields of 32 x 32 pixels stays within five standard errors, which visual noise itself predicts: the
// difference of two pictures is that noise.
TEST(EyeLook, ShowsVisualNoiseAroundTheSameMeanAndLessOfItByDay) {
  double last = 1;
  for (const double cd_m2 : {1e-3, 0.1, 100.0, 1e4}) {
    DevelopOptions noisy = eye_at(cd_m2), clean = eye_at(cd_m2);
    noisy.look.which = clean.look.which = LookChoice::Which::listed;
    clean.look.listed = noisy.look.listed = {false, false, false, false, false, false};
    noisy.look.listed.visual_noise = true;
    const SceneLinear a = seen(noisy), b = seen(clean);
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < a.plane[1].size(); ++i) {
      const double difference = a.plane[1].data()[i] - b.plane[1].data()[i];
      sum += difference, squares += difference * difference;
    }
    const double n = static_cast<double>(a.plane[1].size()), std_dev = std::sqrt(squares / n);
    // Pixels between the centres of cells of 16 share them: one draw counts for each cell.
    EXPECT_NEAR(sum / n, 0, 5 * std_dev / std::sqrt(n / 16)) << cd_m2;
    EXPECT_LT(std_dev, last) << cd_m2;
    last = std_dev;
  }
  EXPECT_LT(last, 1e-3) << "of white, by day";
}

TEST(EyeLook, DarkensRedsAndFadesColoursAsTheLightGoes) {
  double red_fraction = 10, red_saturation = 10, green_saturation = 10;
  for (const double cd_m2 : {100.0, 1.0, 0.1, 0.01, 0.001}) {
    const SceneLinear picture = seen(eye_at(cd_m2));
    const auto red = field_of(picture, 1), green = field_of(picture, 2), blue = field_of(picture, 3);
    EXPECT_LT(luminance(red) / luminance(blue), red_fraction) << cd_m2 << ": Purkinje";
    EXPECT_LT(saturation(red), red_saturation);
    EXPECT_LT(saturation(green), green_saturation);
    red_fraction = luminance(red) / luminance(blue);
    red_saturation = saturation(red);
    green_saturation = saturation(green);
  }
  EXPECT_LT(red_fraction, 1) << "by night the blue is brighter";
  EXPECT_LT(red_saturation, 0.05) << "and both are grey";
}

TEST(EyeLook, SoftensDetailOfADarkScene) {
  const auto contrast = [](const SceneLinear& picture) {
    float least = 1e9f, most = -1e9f;
    for (int x = 60; x < 130; ++x) {
      least = std::min(least, picture.plane[1].at(x, 115));
      most = std::max(most, picture.plane[1].at(x, 115));
    }
    return (most - least) / (most + least);
  };
  EXPECT_LT(contrast(seen(eye_at(0.001))), 0.3 * contrast(seen(eye_at(1000))));
}

// What --effects auto leaves out changes no pixel by more than the tolerance.
TEST(EyeLook, LeavesOutOnlyWhatCannotBeSeen) {
  const Xyz white = *xyz_of(white_d65);
  const Matrix3 to_xyz = *rgb_to_xyz(primaries_rec709);
  for (const double cd_m2 : {300.0, 30.0, 8.0, 2.0, 0.05}) {
    DevelopOptions all = eye_at(cd_m2), automatic = eye_at(cd_m2);
    all.look.which = LookChoice::Which::listed;
    all.look.listed = {};
    const SceneLinear with = seen(all), chosen = seen(automatic);
    double largest = 0;
    for (int y = 0; y < 92; y += 3) {
      for (int x = 0; x < width; x += 3) {
        const auto lab = [&](const SceneLinear& picture) {
          Vector3 rgb{};
          for (int c = 0; c < 3; ++c) rgb[c] = std::max(0.0f, picture.plane[c].at(x, y));
          return lab_of(xyz_of(to_xyz * rgb), white);
        };
        largest = std::max(largest, ciede2000(lab(with), lab(chosen)));
      }
    }
    EXPECT_LE(largest, 4 * automatic.look.tolerance) << cd_m2 << ": four effects, each below the tolerance";
  }
}

TEST(ModelLook, GivesFinitePicturesByEveryModelAndFadesByTheSpectralOne) {
  for (const AppearanceModel& model : appearance_models()) {
    DevelopOptions options = eye_at(0.05);
    options.look.look = Look::model;
    options.look.model = model.name;
    const SceneLinear picture = seen(options);
    for (const Plane<float>& plane : picture.plane) {
      for (std::size_t i = 0; i < plane.size(); ++i) ASSERT_TRUE(std::isfinite(plane.data()[i])) << model.name;
    }
  }
  DevelopOptions dark = eye_at(0.05), bright = eye_at(1000);
  dark.look.look = bright.look.look = Look::model;
  dark.look.model = bright.look.model = "entropy";
  const SceneLinear by_night = seen(dark), by_day = seen(bright);
  for (const int field : {1, 2, 3}) {
    EXPECT_LT(saturation(field_of(by_night, field)), 0.6 * saturation(field_of(by_day, field))) << field;
  }
}

// The scene is what it is, however the picture is exposed or dimmed.
TEST(ModelLook, DoesNotDependOnTheExposureOfThePicture) {
  const auto at_ev = [](double ev) {
    DevelopOptions options = eye_at(0.5);
    options.look.look = Look::model;
    options.look.model = "shin";
    options.exposure_ev = ev;
    return field_of(seen(options), 1);
  };
  const auto plain = at_ev(0), brighter = at_ev(2);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(brighter[c], 4 * plain[c], 0.02 * plain[0]) << "0.5 CIEDE2000 of tables";
}

TEST(ModelLook, RefusesAnUnknownName) {
  InlineExecutor executor;
  DevelopOptions options = eye_at(1);
  options.look.look = Look::model;
  options.look.model = "owl";
  const auto developed = develop(coloured_frame(), options, executor);
  ASSERT_FALSE(developed);
  EXPECT_EQ(developed.error().code, ErrorCode::invalid_argument);
  EXPECT_NE(developed.error().message.find("shin"), std::string::npos);
}

TEST(EyeLook, SaysWhatItIsMissing) {
  InlineExecutor executor;
  DevelopOptions options = eye_at(1);
  options.look.scene_luminance_cd_m2.reset();
  RawFrame frame = coloured_frame();
  const auto unknown = develop(frame, options, executor);
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::insufficient);
  EXPECT_NE(unknown.error().message.find("--scene-luminance"), std::string::npos);
  frame.raw.info.exposure_s = 0.1;
  frame.raw.info.iso = 1600;
  frame.raw.info.f_number = 2;
  const auto known = develop(frame, options, executor);
  ASSERT_TRUE(known) << known.error().message;
  EXPECT_EQ(known->plan.rendering.look->luminance_rule, "exposure");
  frame.raw.info.iso.reset();
  EXPECT_FALSE(develop(frame, options, executor));
  options.look.profile_iso = 1600;
  const auto profiled = develop(frame, options, executor);
  ASSERT_TRUE(profiled);
  EXPECT_EQ(profiled->plan.rendering.look->luminance_rule, "profile");
  EXPECT_EQ(profiled->plan.rendering.look->mean_cd_m2, known->plan.rendering.look->mean_cd_m2);
  // 78 N^2 / (0.65 S t) is 3 cd/m2 at saturation.
  EXPECT_LT(known->plan.rendering.look->mean_cd_m2, 3);
  EXPECT_GT(known->plan.rendering.look->mean_cd_m2, 0.1);
}

TEST(EyeLook, RefusesFiguresThatCannotBe) {
  InlineExecutor executor;
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const RawFrame frame = coloured_frame();
  const auto refused = [&](const auto& change) {
    DevelopOptions options = eye_at(1);
    change(options);
    const auto developed = develop(frame, options, executor);
    return !developed && developed.error().code == ErrorCode::invalid_argument;
  };
  for (const double bad : {0.0, -1.0, 1e10, nan}) {
    EXPECT_TRUE(refused([&](DevelopOptions& o) { o.look.scene_luminance_cd_m2 = bad; })) << bad;
  }
  EXPECT_TRUE(refused([&](DevelopOptions& o) { o.look.dimming = nan; }));
  EXPECT_TRUE(refused([&](DevelopOptions& o) { o.look.field_of_view_deg = 0; }));
  EXPECT_TRUE(refused([&](DevelopOptions& o) { o.look.tolerance = 0; }));
  EXPECT_TRUE(refused([&](DevelopOptions& o) { o.look.noise_limit = -1; }));
  EXPECT_TRUE(refused([&](DevelopOptions& o) { o.space = OutputSpace::xyz; }));
  EXPECT_TRUE(refused([&](DevelopOptions& o) { o.space = OutputSpace::camera; }));
}

TEST(EyeLook, DimsOnlyAnAutomaticExposure) {
  InlineExecutor executor;
  DevelopOptions options = eye_at(0.01);
  const auto given = develop(coloured_frame(), options, executor);
  EXPECT_EQ(given->plan.rendering.exposure_ev, 0);
  options.exposure_ev.reset();
  const auto dimmed = develop(coloured_frame(), options, executor);
  options.look.dimming = 0;
  const auto bright = develop(coloured_frame(), options, executor);
  EXPECT_LT(dimmed->plan.rendering.look->dimming_ev, -0.5);
  EXPECT_NEAR(dimmed->plan.rendering.exposure_ev,
              bright->plan.rendering.exposure_ev + dimmed->plan.rendering.look->dimming_ev, 1e-12);
}

/// The saturation of an orange field of this charge in green by day, as the spectral model shows it to an observer who
/// knows the noise, relative to that without noise.
double saturation_by_noise(double green_e, const DenoiseChoice& denoise) {
  denoise_testing::Camera camera;
  camera.read_noise_e = 2;
  RawFrame frame = test::night_frame(camera, denoise_testing::flat(0.5 * 1.8 * green_e, green_e, 0.625 * 0.5 * green_e),
                                     width, height);
  frame.raw.info.exposure_s = 0.01;
  DevelopOptions options = eye_at(200);
  options.look.look = Look::model;
  options.look.model = "entropy";
  options.exposure_ev = std::log2(0.18 * test::night_full_e() / green_e);
  options.denoise = denoise;
  options.denoise.unbiased_chroma = true;
  const auto mean = [&] {
    InlineExecutor executor;
    Result<Developed> developed = develop(frame, options, executor);
    EXPECT_TRUE(developed) << developed.error().message;
    EXPECT_EQ(developed->plan.rendering.look->table->by_noise, frame.noise.has_value());
    return field_of(std::get<SceneLinear>(developed->picture), 1);
  };
  const double weighed = saturation(mean());
  frame.noise.reset();
  options.denoise = {};
  return weighed / saturation(mean());
}

// The covariance enters with its size: a pixel of one electron keeps less of its colour than one of thousands, and what
// noise reduction leaves counts, not what came in.
TEST(ModelLook, TheSpectralModelWeighsTheNoiseThatIsLeft) {
  using Mode = DenoiseChoice::Mode;
  const double dark = saturation_by_noise(1, {.mode = Mode::off});
  const double bright = saturation_by_noise(2000, {.mode = Mode::off});
  const double reduced = saturation_by_noise(1, {.mode = Mode::level, .level = denoise::Level::high});
  RecordProperty("one_electron", std::to_string(dark));
  RecordProperty("one_electron_reduced", std::to_string(reduced));
  EXPECT_LT(dark, 0.7);
  EXPECT_GT(reduced, 1.2 * dark);
  EXPECT_NEAR(bright, 1, 0.02);
}

// A grey in the dark, by the noise model alone and after draft and standard, whose remaining noise is predicted with
// scatter: its noise as it comes out, in L*, is within the limit, and the limit adds none of its own.
TEST(NoiseLimit, HoldsInThePicture) {
  const auto seed = static_cast<std::uint32_t>(std::random_device{}());
  std::mt19937_64 engine(seed);
  const auto drawn = [&](double least, double most) {  // log-uniform
    return std::exp(std::uniform_real_distribution(std::log(least), std::log(most))(engine));
  };
  InlineExecutor executor;
  double nearest = 0;
  for (int i = 0; i < 12; ++i) {
    denoise_testing::Camera camera;
    camera.read_noise_e = drawn(1, 5);
    const double green_e = drawn(3, 60);
    const int width = static_cast<int>(drawn(500, 1000)), height = static_cast<int>(drawn(500, 1000));
    const RawFrame frame = test::night_frame(
        camera,
        [green_e](double, double) {
          return std::array<double, 3>{0.5 * green_e, green_e, 0.625 * green_e};
        },
        width, height);
    DevelopOptions options{.exposure_ev = 7 + std::log2(12 / green_e * drawn(0.3, 1)), .samples = SampleType::u16};
    options.denoise.mode = i % 3 == 0 ? DenoiseChoice::Mode::off : DenoiseChoice::Mode::level;
    options.denoise.level = i % 3 == 1 ? denoise::Level::draft : denoise::Level::standard;
    const auto noise_of = [&](const DevelopOptions& o) {
      const auto developed = develop(frame, o, executor);
      EXPECT_TRUE(developed);
      const Encoded16& picture = std::get<Encoded16>(developed->picture);
      double sum = 0, squares = 0;
      int n = 0;
      for (int y = 32; y < height - 32; ++y) {
        for (int x = 32; x < width - 32; ++x, ++n) {
          Vector3 rgb{};
          for (int c = 0; c < 3; ++c)
            rgb[c] = decode_transfer(OutputSpace::srgb, picture.codes.at(3 * x + c, y) / 65535.0);
          const double l = lab_of({0, luminance({rgb[0], rgb[1], rgb[2]}), 0}, {1, 1, 1}).l;
          sum += l;
          squares += l * l;
        }
      }
      return std::sqrt(squares / n - sum / n * (sum / n));
    };
    const double free_noise = noise_of(options);
    options.look.noise_limit = drawn(0.2, 0.8) * free_noise;
    const double noise = noise_of(options);
    nearest = std::max(nearest, noise / *options.look.noise_limit);
    EXPECT_LT(noise, 1.05 * *options.look.noise_limit)
        << "seed " << seed << ", draw " << i << ": " << green_e << " e-, read noise " << camera.read_noise_e << " e-, "
        << width << " x " << height << ", without a limit " << free_noise << " L*, limit " << *options.look.noise_limit
        << " L*; statistics of pixels that are not independent";
  }
  RecordProperty("nearest", std::to_string(nearest));
}

std::shared_ptr<const SceneLight> lamp(const char* name) {
  return std::make_shared<const SceneLight>(*light_of_lamp(name));
}

LookPlan planned(const RawFrame& frame, const DevelopOptions& options) {
  InlineExecutor executor;
  const auto plan = plan_develop(frame, options, executor);
  EXPECT_TRUE(plan) << plan.error().message;
  return *plan->rendering.look;
}

TEST(StatedLight, DecidesTheRatioOfTheWhite) {
  const RawFrame frame = coloured_frame();
  DevelopOptions options = eye_at(0.1);
  const LookPlan unknown = planned(frame, options);
  EXPECT_EQ(unknown.light_rule, "white");
  EXPECT_EQ(unknown.adaptation_degree, 1);
  options.look.light = lamp("HPS_generic");
  const LookPlan sodium = planned(frame, options);
  EXPECT_EQ(sodium.light_rule, "spectrum");
  EXPECT_EQ(sodium.look.scotopic_ratio_of_white, options.look.light->scotopic_ratio);
  EXPECT_EQ(sodium.adaptation_degree, degree_of_adaptation(0.1));
  EXPECT_LT(sodium.state.luminance_cd_m2, unknown.state.luminance_cd_m2) << "less light for the rods";
  options.look.light = std::make_shared<const SceneLight>(*light_of_ratio(0.6));
  const LookPlan given = planned(frame, options);
  EXPECT_EQ(given.light_rule, "given");
  EXPECT_EQ(given.look.scotopic_ratio_of_white, 0.6);
}

TEST(StatedLight, GivesRodsTheChannelsOfAKnownCamera) {
  RawFrame frame = coloured_frame();
  DevelopOptions options = eye_at(0.1);
  options.look.light = lamp("LED-B3");
  EXPECT_FALSE(planned(frame, options).rods) << "the camera is unknown";
  frame.raw.info.make = "NIKON CORPORATION";
  frame.raw.info.model = "NIKON D850";
  const LookPlan known = planned(frame, options);
  ASSERT_TRUE(known.rods);
  EXPECT_EQ(known.rods->source, "Nikon_D850");
  options.look.camera = "Canon EOS R6";
  EXPECT_EQ(planned(frame, options).rods->source, "Canon_EOS_R6") << "that of the profile";
  options.look.rod_weights = Vector3{0, 2, 1};
  EXPECT_EQ(planned(frame, options).rods->source, "profile");
  options.look.light = std::make_shared<const SceneLight>(*light_of_ratio(2));
  EXPECT_FALSE(planned(frame, options).rods) << "a ratio is not a spectrum";
  options.look.light.reset();
  EXPECT_FALSE(planned(frame, options).rods);
}

// White has the rods' luminance 1 whatever the weights and the degree of adaptation are.
TEST(StatedLight, KeepsTheWhite) {
  RawFrame frame = coloured_frame();
  DevelopOptions options = eye_at(0.1);
  options.look.light = lamp("HPS_generic");
  for (const char* model : {"", "Nikon D850"}) {
    frame.raw.info.model = model;
    for (const double degree : {0.0, 0.8, 1.0}) {
      options.look.adaptation_degree = degree;
      const LookPlan plan = planned(frame, options);
      const Vector3 white = plan.adaptation * Vector3{1, 1, 1};
      double rods = 0, luminance = 0;
      for (int c = 0; c < 3; ++c) {
        rods += static_cast<double>(plan.look.rods[c]) * white[c];
        luminance += static_cast<double>(plan.look.luminance[c]) * white[c];
      }
      EXPECT_NEAR(luminance, 1, 1e-5) << "weights of float; the matrices of sRGB have seven digits";
      EXPECT_NEAR(rods, 1, 1e-5) << degree << model;
    }
  }
}

// The picture is that of complete adaptation, multiplied by the matrix of CAT02.
TEST(StatedLight, LeavesAPartOfItsColour) {
  DevelopOptions whole = eye_at(1000);
  whole.look.which = LookChoice::Which::listed;
  whole.look.listed = {false, false, false, false, false, false};
  DevelopOptions part = whole;
  part.look.light = lamp("LPS");
  part.look.adaptation_degree = 0.7;
  const SceneLinear adapted = seen(whole), tinted = seen(part);
  const Matrix3 from_xyz = *xyz_to_output(OutputSpace::linear_srgb);
  const Matrix3 change =
      from_xyz * *incomplete_adaptation(*part.look.light->white, white_d65, 0.7) * *inverse(from_xyz);
  for (std::size_t i = 0; i < adapted.plane[0].size(); i += 7) {
    const Vector3 expected =
        change * Vector3{adapted.plane[0].data()[i], adapted.plane[1].data()[i], adapted.plane[2].data()[i]};
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(tinted.plane[c].data()[i], expected[c], 1e-5) << "float, values below 2";
  }
}

TEST(StatedLight, OfDaylightChangesNothingThatCanBeSeen) {
  DevelopOptions stated = eye_at(0.1);
  stated.look.light = lamp("D65");
  const SceneLinear with = seen(stated), without = seen(eye_at(0.1));
  const Xyz white = *xyz_of(white_d65);
  const Matrix3 to_xyz = *rgb_to_xyz(primaries_rec709);
  for (int field = 0; field < 4; ++field) {
    const auto lab = [&](const SceneLinear& picture) {
      const auto rgb = field_of(picture, field);
      return lab_of(xyz_of(to_xyz * Vector3{rgb[0], rgb[1], rgb[2]}), white);
    };
    EXPECT_LT(ciede2000(lab(with), lab(without)), 0.1) << "S/P of 2.457 by xy, 2.464 by the spectrum";
  }
}

TEST(StatedLight, RefusesDegreesThatAreNone) {
  InlineExecutor executor;
  for (const double degree : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    DevelopOptions options = eye_at(1);
    options.look.adaptation_degree = degree;
    EXPECT_FALSE(develop(coloured_frame(), options, executor)) << degree;
  }
  DevelopOptions options = eye_at(1);
  options.look.adaptation_degree = 0;
  SceneLight red{"red", 1, Xy{0.7347, 0.2653}, {}};
  options.look.light = std::make_shared<const SceneLight>(red);
  const auto refused = develop(coloured_frame(), options, executor);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("--adaptation-degree 1"), std::string::npos) << refused.error().message;
}

}  // namespace
}  // namespace lowlux::isp::look_test
