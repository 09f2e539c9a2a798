#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/pipeline/develop.h"
#include "isp/render/output_space.h"
#include "tests/support/synthetic_chart.h"

namespace lowlux::isp {
namespace {

constexpr int patch_side = 32;
constexpr int columns = 6;
constexpr double black_dn = 256;
constexpr double white_dn = 16383;

// The chart as a noise-free mosaic: each patch fills a square; a perfect diffuser would reach white.
RawFrame photograph(const test::SyntheticChart& chart, BayerPhase phase) {
  RawFrame frame;
  RawDn& raw = frame.raw;
  raw.phase = phase;
  raw.dn = Plane<std::uint16_t>(columns * patch_side, 4 * patch_side);
  for (int y = 0; y < raw.dn.height(); ++y) {
    for (int x = 0; x < raw.dn.width(); ++x) {
      const Vector3& rgb = chart.camera_rgb[y / patch_side * columns + x / patch_side];
      const double signal = rgb[static_cast<int>(colour_at(phase, x, y))];
      raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(black_dn + signal * (white_dn - black_dn)));
    }
  }
  raw.active = {0, 0, raw.dn.width(), raw.dn.height()};
  raw.default_crop = raw.active;
  raw.black_tag = BlackLevel{.pattern_dn = {black_dn}};
  raw.white_dn = {white_dn, white_dn, white_dn};
  frame.colour = chart.colour;
  return frame;
}

// Mean over the middle of a patch, as linear sRGB.
Vector3 linear_patch(const Picture& picture, int patch) {
  Vector3 sum{};
  const int x0 = patch % columns * patch_side + patch_side / 4;
  const int y0 = patch / columns * patch_side + patch_side / 4;
  for (int y = y0; y < y0 + patch_side / 2; ++y) {
    for (int x = x0; x < x0 + patch_side / 2; ++x) {
      for (int c = 0; c < 3; ++c) {
        if (const auto* codes = std::get_if<Encoded8>(&picture)) {
          sum[c] += decode_transfer(OutputSpace::srgb, codes->codes.at(3 * x + c, y) / 255.0);
        } else {
          sum[c] += std::get<SceneLinear>(picture).plane[c].at(x, y);
        }
      }
    }
  }
  for (double& v : sum) v /= patch_side * patch_side / 4.0;
  return sum;
}

struct Errors {
  double mean = 0;
  double max = 0;
};

Errors rendering_errors(const test::SyntheticChart& chart, const Picture& picture) {
  const Matrix3 to_xyz = *rgb_to_xyz(primaries_rec709);
  const Matrix3 adapt = *bradford_adaptation(*xy_of(chart.scene_white), white_d65);
  const Xyz white = *xyz_of(white_d65);
  Errors errors;
  for (int i = 0; i < test::SyntheticChart::patches; ++i) {
    const Lab rendered = lab_of(xyz_of(to_xyz * linear_patch(picture, i)), white);
    const Lab truth = lab_of(xyz_of(adapt * vector_of(chart.scene_xyz[i])), white);
    const double error = ciede2000(rendered, truth);
    errors.mean += error / test::SyntheticChart::patches;
    errors.max = std::max(errors.max, error);
  }
  return errors;
}

// The bound is the product's: 2.5 in daylight. Files hold 8 bits here, so quantisation and the gamut move are in it.
TEST(ColourCheckerPipeline, RendersTheChartWithin2Point5FromMosaicToPicture) {
  InlineExecutor executor;
  for (const std::string& camera : test::chart_cameras()) {
    for (const SampleType samples : {SampleType::f32, SampleType::u8}) {
      const auto chart = test::photograph_chart({.camera = camera, .light = "D65", .calibration_lights = {"A", "D65"}});
      ASSERT_TRUE(chart);
      DevelopOptions options{.exposure_ev = 0, .tone = ToneCurve::none, .samples = samples};
      options.space = samples == SampleType::f32 ? OutputSpace::linear_srgb : OutputSpace::srgb;
      const auto developed = develop(photograph(*chart, BayerPhase::grbg), options, executor);
      ASSERT_TRUE(developed) << developed.error().message;
      const Errors errors = rendering_errors(*chart, developed->picture);
      std::printf("  %-22s %-5s mean CIEDE2000 %.2f, max %.2f\n", camera.c_str(),
                  samples == SampleType::f32 ? "float" : "8 bit", errors.mean, errors.max);
      EXPECT_LT(errors.mean, 2.5) << camera;
    }
  }
}

TEST(ColourCheckerPipeline, EveryPhaseGivesTheSameColours) {
  InlineExecutor executor;
  const auto chart = test::photograph_chart({});
  ASSERT_TRUE(chart);
  const DevelopOptions options{
      .exposure_ev = 0, .tone = ToneCurve::none, .space = OutputSpace::linear_srgb, .samples = SampleType::f32};
  const auto first = develop(photograph(*chart, BayerPhase::rggb), options, executor);
  for (int phase = 0; phase < 4; ++phase) {
    const auto other = develop(photograph(*chart, static_cast<BayerPhase>(phase)), options, executor);
    ASSERT_TRUE(first && other);
    for (int i = 0; i < test::SyntheticChart::patches; ++i) {
      for (int c = 0; c < 3; ++c) {  // flat patches: float rounding of the demosaicing filters only
        EXPECT_NEAR(linear_patch(first->picture, i)[c], linear_patch(other->picture, i)[c], 1e-5);
      }
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
