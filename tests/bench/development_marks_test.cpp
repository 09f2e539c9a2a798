#include "isp/bench/marks/development_marks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"

namespace lowlux::isp {
namespace {

constexpr SceneSize size{288, 192};

SceneLinear developed(const DenoiseShot& shot, denoise::Level level, DemosaicMethod method, double exposure) {
  const int width = shot.raw_e.width(), height = shot.raw_e.height();
  InlineExecutor one;
  Plane<float> clean(width, height);
  denoise::Denoiser(width, height, 1, level)
      .run({shot.raw_e.view(), BayerPhase::rggb}, shot.noise(), {.level = level, .white_gain = bench_white_gain},
           clean.view(), {}, one);
  SceneLinear out(width, height);
  RawToRgb(width, 1).linear(mosaic_of(clean.view(), shot, NoiseLeft::reduced, method, exposure),
                            {.clip = clip_of(shot, exposure), .move_into_gamut = false}, out.view(), one);
  return out;
}

PictureMarks marks_of(denoise::Level level, DemosaicMethod method, double mean_e) {
  return measure_marks(
      [=](const DenoiseShot& shot, double exposure) { return developed(shot, level, method, exposure); }, mean_e, size);
}

/// Lines of a flat that a development keeps, and none that it makes: those of the raw's noise have this amplitude at
/// most, with five standard deviations. In addition lines of blocks are those of noise of the image's own variance.
/// The mean of each colour is kept, and so is the raw's line of 2 px: over the little noise that is left it is larger.
void expect_no_lines(const PictureMarks& marks, const std::string& name) {
  EXPECT_LE(marks.cell_of_raw, max_periodic_amplitude(2)) << name;
  EXPECT_LE(marks.block_8_of_raw, max_periodic_amplitude(8)) << name;
  EXPECT_LE(marks.block_16_of_raw, max_periodic_amplitude(16)) << name;
  EXPECT_LE(marks.block_8, max_periodic_amplitude(8)) << name;
  EXPECT_LE(marks.block_16, max_periodic_amplitude(16)) << name;
}

// Without noise reduction the error has a root mean square of 1, by definition.
TEST(PictureMarks, LevelsOfTheDenoiserMakeNoLinesAndLeaveNoMoreErrorNextToLampsThanTheRawHas) {
  for (const double mean_e : {20.0, 200.0}) {
    for (const denoise::Level level : denoise::all_levels) {
      const std::string name = std::string(denoise::name_of(level)) + " at " + std::to_string(mean_e);
      const PictureMarks marks = marks_of(level, DemosaicMethod::residual_median, mean_e);
      expect_no_lines(marks, name);
      EXPECT_LE(marks.lamp_ring, 1) << name;
    }
  }
}

// The linear filters of `malvar` spread the light of lamps by 2 px: nothing is asked of it there.
TEST(PictureMarks, MethodsOfDemosaicingMakeNoLinesAndNoErrorNextToLamps) {
  for (const DemosaicMethod method : all_demosaic_methods) {
    const PictureMarks marks = marks_of(denoise::Level::standard, method, 20);
    expect_no_lines(marks, std::string(name_of(method)));
    if (method != DemosaicMethod::malvar) {
      EXPECT_LE(marks.lamp_ring, 1) << name_of(method);
    }
  }
}

bool holds(const std::vector<Finding>& findings, const std::string& id) {
  const auto at = std::ranges::find(findings, "scenes/" + id + "/x", &Finding::id);
  return at != findings.end() && at->holds;
}

constexpr PictureMarks none{.cell = 1,
                            .block_8 = 1,
                            .block_16 = 1,
                            .lamp_ring = 0.3,
                            .lamp_far = 0.2,
                            .star_mean = 0.01,
                            .star_chroma = 0.3,
                            .star_chroma_far = 0.2,
                            .beads = 1,
                            .beads_inside = 1};

TEST(PictureMarks, FindingsHoldUpToTheirLimits) {
  for (const Finding& finding : mark_findings("x", none)) EXPECT_TRUE(finding.holds) << finding.id;
  const auto fails = [](const std::string& id, double PictureMarks::*member, double value) {
    PictureMarks marks = none;
    marks.*member = value;
    const auto findings = mark_findings("x", marks);
    EXPECT_FALSE(holds(findings, id)) << id;
    EXPECT_EQ(std::ranges::count(findings, false, &Finding::holds), 1) << id;
  };
  fails("cell", &PictureMarks::cell, 2.3);
  fails("block-8", &PictureMarks::block_8, 1.4);
  fails("block-16", &PictureMarks::block_16, 1.3);
  fails("lamp-ripples", &PictureMarks::lamp_ring, 0.5);
  fails("star-ring", &PictureMarks::star_mean, -0.2);
  fails("star-colour", &PictureMarks::star_chroma, 0.5);
  fails("beads", &PictureMarks::beads, 3);
}

// Marks that are put into an image that has none.
TEST(PictureMarks, MeshesAndRingsAreMeasured) {
  const auto with = [](double mesh, double halo) {
    return measure_marks(
        [=](const DenoiseShot& shot, double exposure) {
          SceneLinear out = developed(shot, denoise::Level::standard, DemosaicMethod::residual, exposure);
          for (Plane<float>& plane : out.plane) {
            for (int y = 0; y < out.height(); ++y) {
              for (int x = 0; x < out.width(); ++x) {
                const bool is_ring = std::abs(std::hypot(x % 96 - 48, y % 96 - 48) - 24) < 4;
                plane.at(x, y) += static_cast<float>(mesh * ((x + y) % 2) + (is_ring ? halo : 0));
              }
            }
          }
          return out;
        },
        200, size);
  };
  const PictureMarks clean = with(0, 0), meshed = with(0.01, 0), ringed = with(0, 0.05);
  EXPECT_GT(meshed.cell_of_raw, 2 * max_periodic_amplitude(2));
  EXPECT_GT(ringed.lamp_ring, 1.5 * clean.lamp_ring);
  EXPECT_GT(ringed.star_mean, clean.star_mean);
}

}  // namespace
}  // namespace lowlux::isp
