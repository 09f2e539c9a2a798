#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>
#include <vector>

#include "isp/model/colour/camera_colour.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/colour_difference.h"
#include "tests/support/synthetic_chart.h"

namespace lowlux::isp::colour_checker_test {
namespace {

/// Returns the CIEDE2000 of the 24 patches: camera RGB through a matrix to XYZ under D65, against the scene's XYZ
/// adapted to D65 (Bradford), both relative to D65.
std::vector<double> patch_errors(const test::SyntheticChart& chart, const Matrix3& to_xyz) {
  const Matrix3 adaptation = *bradford_adaptation(*xy_of(chart.scene_white), white_d65);
  const Xyz display_white = *xyz_of(white_d65);
  std::vector<double> errors;
  for (int i = 0; i < test::SyntheticChart::patches; ++i) {
    const Lab rendered = lab_of(xyz_of(to_xyz * chart.camera_rgb[i]), display_white);
    const Lab truth = lab_of(xyz_of(adaptation * vector_of(chart.scene_xyz[i])), display_white);
    errors.push_back(ciede2000(rendered, truth));
  }
  return errors;
}

std::vector<double> rendering_errors(const test::ChartSetup& setup) {
  const auto chart = test::photograph_chart(setup);
  EXPECT_TRUE(chart) << (chart ? "" : chart.error().message + " " + chart.error().where);
  if (!chart) return {};
  const auto white = white_of_neutral(chart->colour, *chart->colour.as_shot_neutral);
  EXPECT_TRUE(white) << (white ? "" : white.error().message);
  if (!white) return {};
  const auto to_xyz = camera_to_xyz(chart->colour, white->xy, white_d65);
  EXPECT_TRUE(to_xyz) << (to_xyz ? "" : to_xyz.error().message);
  if (!to_xyz) return {};
  return patch_errors(*chart, *to_xyz);
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

struct Rendering {
  double mean = 0;
  double max = 0;
};

Rendering render(const test::ChartSetup& setup) {
  const std::vector<double> errors = rendering_errors(setup);
  if (errors.empty()) return {};
  const Rendering rendering{mean_of(errors), *std::max_element(errors.begin(), errors.end())};
  std::printf("  %-22s %-4s %zu calibration(s)%s: mean CIEDE2000 %.2f, max %.2f\n", setup.camera.c_str(),
              setup.light.c_str(), setup.calibration_lights.size(), setup.with_forward_matrix ? ", ForwardMatrix" : "",
              rendering.mean, rendering.max);
  return rendering;
}

// 2.5 is what issue and product ask for; a linear 3x3 matrix cannot reach 0 because no camera is a colorimeter.
TEST(ColourChecker, IsRenderedWithin2Point5InDaylightByEveryCamera) {
  const auto cameras = test::chart_cameras();
  EXPECT_EQ(cameras.size(), 22u);
  for (const std::string& camera : cameras) {
    for (const char* light : {"D65", "D50"}) {
      for (const bool forward : {false, true}) {
        EXPECT_LT(render({camera, light, {light}, forward}).mean, 2.5) << camera << " " << light;
        EXPECT_LT(render({camera, light, {"A", "D65"}, forward}).mean, 2.5) << camera << " " << light;
      }
    }
  }
}

// Tungsten stretches the blue channel; what is left is the camera's metamerism: 2.56 for the worst, 3 with margin.
TEST(ColourChecker, IsRenderedWithin3InTungstenLight) {
  for (const std::string& camera : test::chart_cameras()) {
    for (const bool forward : {false, true}) {
      EXPECT_LT(render({camera, "A", {"A", "D65"}, forward}).mean, 3.0) << camera;
    }
  }
}

/// Returns the mean CIEDE2000 over cameras and patches with a matrix for D65 alone: as camera_to_xyz() renders it, and
/// with the inverse of the matrix, adapted from the white that the matrix gives the neutral.
struct DaylightMatrixErrors {
  double rendered = 0;
  double inverted = 0;
};

DaylightMatrixErrors daylight_matrix_errors(const std::string& light) {
  DaylightMatrixErrors errors;
  const std::vector<std::string> cameras = test::chart_cameras();
  for (const std::string& camera : cameras) {
    const auto chart = test::photograph_chart({camera, light, {"D65"}, false});
    EXPECT_TRUE(chart) << camera << " " << light;
    if (!chart) return errors;
    const auto white = white_of_neutral(chart->colour, *chart->colour.as_shot_neutral);
    EXPECT_TRUE(white) << camera << " " << light;
    if (!white) return errors;
    Matrix3 inverted = *bradford_adaptation(white->xy, white_d65) * *inverse(*xyz_to_camera(chart->colour, white->xy));
    inverted = (1 / (inverted * *chart->colour.as_shot_neutral)[1]) * inverted;
    errors.rendered += mean_of(patch_errors(*chart, *camera_to_xyz(chart->colour, white->xy, white_d65)));
    errors.inverted += mean_of(patch_errors(*chart, inverted));
  }
  errors.rendered /= static_cast<double>(cameras.size());
  errors.inverted /= static_cast<double>(cameras.size());
  std::printf("  %-11s mean CIEDE2000 %.2f, by the inverse %.2f\n", light.c_str(), errors.rendered, errors.inverted);
  return errors;
}

// Raw files often have a daylight matrix alone. Artificial light is far from daylight in spectrum, not in colour only.
TEST(ColourChecker, WithADaylightMatrixAloneIsCloserThanByItsInverse) {
  for (const char* light : {"A", "D50", "D55", "FL2", "FL7", "FL11", "LED-B1", "LED-B2", "LED-B3", "LED-B4", "LED-B5",
                            "LED-RGB1", "LED-V1", "HPS_generic"}) {
    const DaylightMatrixErrors errors = daylight_matrix_errors(light);
    EXPECT_LT(errors.rendered, errors.inverted) << light;
  }
  // In shade the inverse is better, by a quarter of one CIEDE2000 at most.
  const DaylightMatrixErrors shade = daylight_matrix_errors("D75");
  EXPECT_LT(shade.rendered, shade.inverted + 0.25);
  const DaylightMatrixErrors same = daylight_matrix_errors("D65");
  EXPECT_NEAR(same.rendered, same.inverted, 0.01);  // D65 by its spectrum and by its temperature
}

// The daylight matrix alone does worse in tungsten light than the two together.
TEST(ColourChecker, NeedsTheSecondCalibrationInTungstenLight) {
  double with_one = 0, with_two = 0;
  for (const std::string& camera : test::chart_cameras()) {
    with_one += render({camera, "A", {"D65"}, false}).mean;
    with_two += render({camera, "A", {"A", "D65"}, false}).mean;
  }
  EXPECT_GT(with_one, 1.2 * with_two);
}

// Greys reflect nearly evenly, so a camera sees them as it sees the white and no metamerism excuses an error: a* and b*
// within 1 of the truth (Ohta's greys themselves have chromas of 0.1 to 0.9; his white falls off below 420 nm).
TEST(ColourChecker, GreysStayGrey) {
  for (const std::string& camera : test::chart_cameras()) {
    const auto chart = test::photograph_chart({camera, "D50", {"A", "D65"}, true});
    ASSERT_TRUE(chart);
    const auto white = white_of_neutral(chart->colour, *chart->colour.as_shot_neutral);
    ASSERT_TRUE(white);
    const Matrix3 to_xyz = *camera_to_xyz(chart->colour, white->xy, white_d65);
    const Matrix3 adaptation = *bradford_adaptation(*xy_of(chart->scene_white), white_d65);
    for (int patch = 18; patch < 24; ++patch) {
      const Lab found = lab_of(xyz_of(to_xyz * chart->camera_rgb[patch]), *xyz_of(white_d65));
      const Lab truth = lab_of(xyz_of(adaptation * vector_of(chart->scene_xyz[patch])), *xyz_of(white_d65));
      EXPECT_LT(std::hypot(found.a - truth.a, found.b - truth.b), 1) << camera << " patch " << patch + 1;
    }
  }
}

}  // namespace
}  // namespace lowlux::isp::colour_checker_test
