#include "tests/hard_cases/looks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

#include "isp/model/appearance/appearance_model.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/live_pipeline.h"
#include "tests/reference/night_look_ref.h"

namespace lowlux::hard_cases {
namespace {

constexpr int width = 64, height = 48;
constexpr double black_dn = 512, range_dn = 15000;
constexpr std::array<float, 9> as_it_is{1, 0, 0, 0, 1, 0, 0, 0, 1};

RawFrame frame_of(const auto& rgb_at) {
  RawFrame frame;
  frame.raw.dn = Plane<std::uint16_t>(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double value = rgb_at(x, y)[static_cast<std::size_t>(colour_at(BayerPhase::rggb, x, y))];
      frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(black_dn + range_dn * value));
    }
  }
  frame.raw.active = frame.raw.default_crop = {0, 0, width, height};
  frame.raw.black_tag = BlackLevel{.pattern_dn = {black_dn}};
  frame.raw.white_dn.fill(black_dn + range_dn);
  const Matrix3 xyz_to_srgb{{{3.2406, -1.5372, -0.4986}, {-0.9689, 1.8758, 0.0415}, {0.0557, -0.2040, 1.0570}}};
  frame.colour.calibrations = {{.cct_k = 6504, .xyz_to_camera = xyz_to_srgb}};
  frame.colour.as_shot_neutral = Vector3{1, 1, 1};
  frame.colour.source = CameraColour::Source::file_tags;
  return frame;
}

RawFrame frame_of(const SeenField& field) {
  return frame_of([&](int, int) { return field.rgb; });
}

isp::LookChoice eye_at(double cd_m2) {
  isp::LookChoice look{.look = isp::Look::eye, .scene_luminance_cd_m2 = cd_m2};
  look.which = isp::LookChoice::Which::listed;
  return look;
}

isp::NightLook rec709_look(const SeenField& field) {
  isp::NightLook look;
  look.cd_m2_per_unit = field.cd_m2;
  look.scotopic_ratio_of_white = field.scotopic_ratio;
  look.luminance = {0.2126f, 0.7152f, 0.0722f};
  look.rods = {-0.0126f, 0.6204f, 0.3922f};
  for (int c = 0; c < 3; ++c) look.tint[c] = static_cast<float>(isp::rod_tint[c]);
  return look;
}

}  // namespace

double look_against_reference(const SeenField& field, Denormals mode) {
  CameraRgb camera(width, height);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) camera.plane[c].at(x, y) = field.rgb[c] * static_cast<float>(x + 8) / 72;
    }
  }
  const isp::NightLook look = rec709_look(field);
  const auto expected = reference::night_look(std::as_const(camera).view(), as_it_is, 1, look);
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  isp::NightLookGrid maker(4 * width, 4 * height);
  const LookGrid grid = in_mode(
      mode, [&] { return maker.make(std::as_const(camera).view(), as_it_is, 1, look, std::nullopt, executor); });
  double worst = 0;
  for (int k = 0; k < LookGrid::parts; ++k) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        keep_worst(worst, std::abs(static_cast<double>(grid.part[k].at(x, y)) - expected[k].clamped(x, y)));
      }
    }
  }
  return worst;
}

double look_through_file(const SeenField& field, Denormals mode) {
  isp::DevelopOptions options{.exposure_ev = 0,
                              .tone = isp::ToneCurve::none,
                              .space = OutputSpace::linear_srgb,
                              .samples = SampleType::f32,
                              .find_defects = false};
  options.look = eye_at(field.cd_m2);
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  const auto developed = in_mode(mode, [&, frame = frame_of(field)] { return isp::develop(frame, options, executor); });
  EXPECT_TRUE(developed) << developed.error().message;
  if (!developed) return NAN;
  const bool black = *std::max_element(field.rgb.begin(), field.rgb.end()) == 0;
  double wrong = 0;
  for (const Plane<float>& plane : std::get<SceneLinear>(developed->picture).plane) {
    const auto expected = black ? 0.0 : static_cast<double>(plane.at(0, 0));
    for (std::size_t i = 0; i < plane.size(); ++i) {
      wrong += std::abs(static_cast<double>(plane.data()[i]) - expected) <= 1e-5 ? 0 : 1;
    }
  }
  return wrong;
}

double look_through_live(const SeenField& field, Denormals mode) {
  const RawFrame frame = frame_of(field);
  isp::DevelopOptions options{.exposure_ev = 0, .find_defects = false};
  options.look = eye_at(field.cd_m2);
  isp::LiveSetup setup;
  setup.format = {.bits = 14, .phase = frame.raw.phase};
  setup.width = width;
  setup.height = height;
  setup.active = frame.raw.active;
  setup.white_dn = frame.raw.white_dn[0];
  setup.colour = frame.colour;
  setup.look = options.look;
  isp::LiveFacts facts{.black_dn = PerSite<double>{black_dn, black_dn, black_dn, black_dn}};
  facts.neutral = frame.colour.as_shot_neutral;
  facts.exposure_ev = 0;
  facts.scene_luminance_cd_m2 = field.cd_m2;
  facts.denoise.mode = isp::LiveDenoise::Mode::off;
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  return in_mode(mode, [&] {
    const auto developed = isp::develop(frame, options, executor);
    auto live = isp::LivePipeline::make(setup, executor);
    EXPECT_TRUE(developed && live);
    if (!developed || !live) return double{NAN};
    const std::span dn(frame.raw.dn.data(), frame.raw.dn.size());
    (*live)->read(std::as_bytes(dn), 2 * width, facts, true);
    EXPECT_TRUE((*live)->plan(facts));
    struct Count {
      PlaneView<const std::uint8_t> expected;
      std::array<double, 2> wrong{};  // of the threads
    } count{std::get<Encoded8>(developed->picture).codes.view(), {}};
    (*live)->render({[](void* context, int thread, int y, const std::uint8_t* rgb, int pixels) {
                       auto& c = *static_cast<Count*>(context);
                       for (int i = 0; i < 3 * pixels; ++i) c.wrong[thread] += rgb[i] == c.expected.at(i, y) ? 0 : 1;
                     },
                     &count});
    return count.wrong[0] + count.wrong[1];
  });
}

double models_through_file(Denormals mode) {
  const RawFrame frame = frame_of([](int x, int y) -> std::array<double, 3> {
    constexpr std::array<std::array<double, 3>, 4> fields{
        {{0, 0, 0}, {-0.02, -0.01, -0.03}, {1, 1, 1}, {0.8, 0.01, 0}}};
    return fields[static_cast<std::size_t>(2 * (y / 24) + x / 32)];
  });
  isp::DevelopOptions options{.exposure_ev = 0,
                              .tone = isp::ToneCurve::none,
                              .space = OutputSpace::linear_srgb,
                              .samples = SampleType::f32,
                              .find_defects = false};
  options.look.look = isp::Look::model;
  options.look.scene_luminance_cd_m2 = 0.05;
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  double wrong = 0;
  for (const isp::AppearanceModel& model : isp::appearance_models()) {
    options.look.model = std::string(model.name);
    const auto developed = in_mode(mode, [&] { return isp::develop(frame, options, executor); });
    EXPECT_TRUE(developed) << developed.error().message;
    if (!developed) return NAN;
    for (const Plane<float>& plane : std::get<SceneLinear>(developed->picture).plane) {
      wrong += static_cast<double>(
          std::count_if(plane.data(), plane.data() + plane.size(), [](float v) { return !std::isfinite(v); }));
    }
  }
  return wrong;
}

}  // namespace lowlux::hard_cases
