#include "tests/hard_cases/looks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "isp/pipeline/develop.h"
#include "isp/pipeline/live/live_pipeline.h"
#include "tests/hard_cases/rec709_camera.h"
#include "tests/reference/night_look_ref.h"
#include "tests/reference/raw_to_rgb_ref.h"

namespace lowlux::hard_cases {
namespace {

constexpr int width = 64, height = 48;
constexpr std::array<float, 9> as_it_is{1, 0, 0, 0, 1, 0, 0, 0, 1};
// Photopic and scotopic luminance of linear Rec. 709, D65 white having Y = 1 (spec 0.1, R3).
constexpr Vector3 photopic{0.2126, 0.7152, 0.0722}, scotopic{-0.03097, 1.52426, 0.96370};
constexpr double scotopic_of_white = scotopic[0] + scotopic[1] + scotopic[2];

RawFrame frame_of(const SeenField& field) {
  return rec709_frame(
      width, height, [&](int, int) { return field.rgb; }, field.light);
}

isp::NightLook rec709_look(const SeenField& field) {
  isp::NightLook look;
  look.cd_m2_per_unit = field.cd_m2;
  look.scotopic_ratio_of_white = -1.52356 * field.light.x + 2.71012 * field.light.y + 1.09735 * field.light.z;
  for (int c = 0; c < 3; ++c) {
    look.luminance[c] = static_cast<float>(photopic[c]);
    look.rods[c] = static_cast<float>(scotopic[c] / scotopic_of_white);
    look.tint[c] = static_cast<float>(isp::rod_tint[c]);
  }
  return look;
}

double luminance_of(const SeenField& field) {
  double y = 0;
  for (int c = 0; c < 3; ++c) y += photopic[c] * static_cast<double>(field.rgb[c]);
  return y;
}

/// Every effect that has a size, the field being as bright as it is; of black, white is told.
isp::LookChoice eye_on(const SeenField& field) {
  isp::LookChoice look{.look = isp::Look::eye,
                       .scene_luminance_cd_m2 = field.cd_m2 * std::max(luminance_of(field), 1e-6)};
  look.which = isp::LookChoice::Which::listed;
  return look;
}

/// The field, as an eye adapted to it sees it: every pixel alike.
reference::Rgb seen_of(const SeenField& field) {
  CameraRgb camera(width / LookGrid::cell, height / LookGrid::cell);
  for (int c = 0; c < 3; ++c) std::fill_n(camera.plane[c].data(), camera.plane[c].size(), field.rgb[c]);
  isp::NightLook look = rec709_look(field);
  look.pixels_per_degree = width / isp::LookChoice{}.field_of_view_deg;
  look.dark = 1e-5f;  // the least of a look: an even frame shows no noise
  std::vector<Plane<float>> memory;
  const auto parts = reference::night_look(std::as_const(camera).view(), as_it_is, 1, look);
  const LookGrid grid = reference::look_grid(parts, look, memory);
  return reference::seen({field.rgb[0], field.rgb[1], field.rgb[2]}, grid, width / 2, height / 2);
}

double error_of_grid(const SeenField& field, Denormals mode) {
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

double error_of_file(const SeenField& field, Denormals mode) {
  isp::DevelopOptions options{.exposure_ev = 0,
                              .tone = isp::ToneCurve::none,
                              .space = OutputSpace::linear_srgb,
                              .samples = SampleType::f32,
                              .find_defects = false};
  options.look = eye_on(field);
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  const auto developed = in_mode(mode, [&, frame = frame_of(field)] { return isp::develop(frame, options, executor); });
  EXPECT_TRUE(developed) << developed.error().message;
  if (!developed) return NAN;
  const reference::Rgb expected = seen_of(field);
  double worst = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const Plane<float>& plane = std::get<SceneLinear>(developed->picture).plane[c];
    for (std::size_t i = 0; i < plane.size(); ++i) {
      keep_worst(worst, std::abs(static_cast<double>(plane.data()[i]) - expected[c]));
    }
  }
  return worst;
}

isp::LiveSetup setup_of(const RawFrame& frame, const isp::LookChoice& look) {
  isp::LiveSetup setup;
  setup.format = {.bits = 14, .phase = frame.raw.phase};
  setup.width = width;
  setup.height = height;
  setup.active = frame.raw.active;
  setup.white_dn = frame.raw.white_dn[0];
  setup.colour = frame.colour;
  setup.tone = isp::ToneCurve::none;
  setup.look = look;
  return setup;
}

isp::LiveFacts facts_of(const RawFrame& frame, const isp::LookChoice& look) {
  isp::LiveFacts facts;
  facts.black_dn.emplace().fill(rec709_black_dn);
  facts.neutral = frame.colour.as_shot_neutral;
  facts.exposure_ev = 0;
  facts.scene_luminance_cd_m2 = look.scene_luminance_cd_m2;
  facts.denoise.mode = isp::LiveDenoise::Mode::off;
  return facts;
}

/// A picture that a stream left in codes.
Plane<std::uint8_t> codes_of(const RawFrame& frame, const isp::LookChoice& look, Denormals mode) {
  const isp::LiveFacts facts = facts_of(frame, look);
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  Plane<std::uint8_t> codes;
  in_mode(mode, [&] {
    auto live = isp::LivePipeline::make(setup_of(frame, look), executor);
    EXPECT_TRUE(live) << live.error().message;
    if (!live) return;
    (*live)->read(std::as_bytes(std::span(frame.raw.dn.data(), frame.raw.dn.size())), 2 * width, facts, true);
    EXPECT_TRUE((*live)->plan(facts));
    codes = Plane<std::uint8_t>(3 * width, height);
    (*live)->render({[](void* context, int, int y, const std::uint8_t* rgb, int pixels) {
                       std::copy_n(rgb, 3 * pixels, static_cast<Plane<std::uint8_t>*>(context)->row(y));
                     },
                     &codes});
  });
  return codes;
}

double error_of_live(const SeenField& field, Denormals mode) {
  const Plane<std::uint8_t> codes = codes_of(frame_of(field), eye_on(field), mode);
  if (codes.size() == 0) return NAN;
  const reference::Rgb shown = reference::moved_into_gamut(seen_of(field), rec709_look(field).luminance);
  double worst = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < 3 * width; ++x) {
      const double expected = 255 * reference::srgb_encoded(shown[static_cast<std::size_t>(x % 3)]);
      keep_worst(worst, std::abs(codes.at(x, y) - expected));
    }
  }
  return worst;
}

double worst_of(std::span<const SeenField> fields, Denormals mode, double (*error)(const SeenField&, Denormals)) {
  double worst = 0;
  for (SeenField field : fields) {
    field.rgb = in_codes(field.rgb);
    keep_worst(worst, error(field, mode));
  }
  return worst;
}

}  // namespace

double look_against_reference(std::span<const SeenField> fields, Denormals mode) {
  return worst_of(fields, mode, error_of_grid);
}

double look_through_file(std::span<const SeenField> fields, Denormals mode) {
  return worst_of(fields, mode, error_of_file);
}

double look_through_live(std::span<const SeenField> fields, Denormals mode) {
  return worst_of(fields, mode, error_of_live);
}

}  // namespace lowlux::hard_cases
