#include "calib/chart/chart_finder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "tests/calib/chart_frame.h"

namespace lowlux::calib {
namespace {

using test::ChartPhotograph;

/// The search sees the middle 0.76 of a cell and patches fill 0.86 of it: 0.05 cells either way look alike, 0.06 and
/// 0.067 at a corner, where that of the outer patches' middles is extended by half a cell; and the last step is 0.0125
/// each way. The measured half of a patch is 0.18 cells away from its border.
constexpr double place_tolerance_cells = 0.11;

void expect_found(const ChartPhotograph& photograph) {
  SCOPED_TRACE(testing::Message() << "cell " << photograph.cell_px << " px, " << photograph.angle_deg << " degrees, "
                                  << photograph.exposure << " of the range");
  const auto found = find_chart(test::photographed(photograph), lowlux_detect_charts);
  ASSERT_TRUE(found) << found.error().message;
  for (const auto& [u, v] : {std::pair{0.0, 0.0}, {6.0, 0.0}, {6.0, 4.0}, {0.0, 4.0}}) {
    const PicturePoint at = found->grid.at(u, v), expected = test::half_size_point(photograph, u, v);
    EXPECT_LE(std::hypot(at.x - expected.x, at.y - expected.y), place_tolerance_cells * photograph.cell_px / 2)
        << u << " " << v;
  }
  for (std::size_t i = 0; i < 24; ++i) {
    const ChartPatch& patch = found->patches[i];
    ASSERT_TRUE(usable(patch)) << i;
    for (std::size_t c = 0; c < 3; ++c) {
      const double truth = photograph.exposure * test::daylight_chart().camera_rgb[i][c];
      EXPECT_NEAR(patch.camera_rgb[c], truth, 5 * patch.standard_error[c]) << i << " " << c;
    }
  }
}

TEST(ChartFinder, FindsChartsOfManySizesTurnsAndExposures) {
  expect_found({.cell_px = 100});
  expect_found({.cell_px = 44, .angle_deg = 12});
  expect_found({.centre_x = 520, .cell_px = 90, .angle_deg = 180, .exposure = 0.3});
  expect_found({.width = 760, .height = 1000, .centre_x = 380, .centre_y = 500, .cell_px = 100, .angle_deg = 90});
  expect_found({.cell_px = 80, .angle_deg = -33, .keystone = 0.1});
  expect_found({.cell_px = 110, .angle_deg = 3, .exposure = 0.02, .read_noise_dn = 6, .seed = 2});
}

TEST(ChartFinder, FindsALargePictureAtTheSizeItsDetectorTakes) {
  expect_found({.width = 2600, .height = 1900, .centre_x = 1200, .centre_y = 900, .cell_px = 300, .angle_deg = 5});
}

TEST(ChartFinder, RecognisesAMirroredChartByItsColours) {
  const auto found = find_chart(test::photographed({.mirrored = true}), lowlux_detect_charts);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(found->ciede2000, 3);  // CIEDE2000: what a matrix leaves of this camera under another light
  EXPECT_GT(found->grid.at(0, 0).x, found->grid.at(6, 0).x);
}

TEST(ChartFinder, RefusesAPictureWithoutAChart) {
  std::array<Vector3, 24> grey;
  grey.fill({0.0, 0.0, 0.0});
  const auto found = find_chart(test::half_size(test::photograph_patches({}, grey)), lowlux_detect_charts);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::insufficient);
  EXPECT_NE(found.error().message.find("no chart found"), std::string::npos) << found.error().message;
}

TEST(ChartFinder, RefusesPatchesInAnotherOrder) {
  std::array<Vector3, 24> shuffled = test::daylight_chart().camera_rgb;
  for (std::size_t i = 0; i < 24; ++i) shuffled[i] = test::daylight_chart().camera_rgb[7 * i % 24];  // 7 and 24 coprime
  static constexpr ChartPhotograph photograph{};
  const auto found = find_chart(test::half_size(test::photograph_patches(photograph, shuffled)),
                                [](const DetectorPicture&, ChartShape* shapes, int) noexcept {
                                  shapes[0].corner = {
                                      test::half_size_point(photograph, 0, 0), test::half_size_point(photograph, 6, 0),
                                      test::half_size_point(photograph, 6, 4), test::half_size_point(photograph, 0, 4)};
                                  return 1;
                                });
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().message.find("differs from a ColorChecker by"), std::string::npos) << found.error().message;
}

TEST(ChartFinder, RefusesTwoCharts) {
  ChartPhotograph photograph{.width = 1200, .height = 600, .centre_x = 300, .centre_y = 300, .cell_px = 80};
  RawFrame frame = test::photograph_patches(photograph, test::daylight_chart().camera_rgb);
  photograph.centre_x = 900;
  test::add_patches(photograph, test::daylight_chart().camera_rgb, frame);
  const auto found = find_chart(test::half_size(frame), lowlux_detect_charts);
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().message.find("2 charts were found"), std::string::npos) << found.error().message;
}

TEST(ChartFinder, LeavesOutAClippedPatchAndRefusesManyOfThem) {
  const auto one = find_chart(test::photographed({.exposure = 1.2}), lowlux_detect_charts);
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_FALSE(usable(one->patches[18]));
  EXPECT_TRUE(usable(one->patches[20]));
  EXPECT_EQ(samples_of(one->patches, {}).size(), 23U);
  const auto many = find_chart(test::photographed({.exposure = 4}), lowlux_detect_charts);
  ASSERT_FALSE(many);
  EXPECT_NE(many.error().message.find("expose shorter"), std::string::npos) << many.error().message;
}

TEST(ChartFinder, RefusesAChartThatDrownsInNoise) {
  static constexpr ChartPhotograph dark{.cell_px = 32, .exposure = 0.006, .read_noise_dn = 6};
  const auto found = find_chart(test::photographed(dark), [](const DetectorPicture&, ChartShape* shapes, int) noexcept {
    shapes[0].corner = {test::half_size_point(dark, 0, 0), test::half_size_point(dark, 6, 0),
                        test::half_size_point(dark, 6, 4), test::half_size_point(dark, 0, 4)};
    return 1;
  });
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().message.find("too dark"), std::string::npos) << found.error().message;
}

TEST(ChartFinder, ReportsAFailedDetector) {
  const auto found =
      find_chart(test::photographed({}), [](const DetectorPicture&, ChartShape*, int) noexcept { return -1; });
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::unreadable);
}

TEST(ChartFinder, SurvivesShapesThatAreNone) {
  const auto found = find_chart(test::photographed({}), [](const DetectorPicture&, ChartShape* shapes, int) noexcept {
    shapes[0].corner = {};                                                      // a point
    shapes[1].corner = {{{0, 0}, {NAN, 0}, {60, 40}, {0, 40}}};                 // no place
    shapes[2].corner = {{{-1e9, -1e9}, {1e9, -1e9}, {1e9, 1e9}, {-1e9, 1e9}}};  // far outside
    return 3;
  });
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().message.find("no chart found"), std::string::npos);
}

TEST(ChartFinder, RefusesAPictureTooSmallForAChart) {
  const auto found = find_chart(test::photographed({.width = 126, .height = 90}), lowlux_detect_charts);
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().message.find("no chart found"), std::string::npos);
}

TEST(ChartNeutral, IsTheGreyRowsWithTheLightsFallTakenOut) {
  const ChartPhotograph photograph{.light_x = 0.2, .light_y = -0.1};
  const auto found = find_chart(test::photographed(photograph), lowlux_detect_charts);
  ASSERT_TRUE(found) << found.error().message;
  const auto neutral = chart_neutral(found->patches, {0.2, -0.1});
  ASSERT_TRUE(neutral);
  Vector3 row{};
  for (std::size_t i = 18; i < 24; ++i) {
    for (std::size_t c = 0; c < 3; ++c) row[c] += test::daylight_chart().camera_rgb[i][c];
  }
  // 0.2 % relative: six patches of some 600 pixels and 100 to 10000 e- each.
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR((*neutral)[c], row[c] / row[1], 0.002) << c;
}

}  // namespace
}  // namespace lowlux::calib
