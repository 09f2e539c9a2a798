#include "isp/pipeline/finished/retarget_picture.h"
#include "isp/pipeline/finished/display_target.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <variant>

#include "isp/model/colour/colorimetry.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

// A ramp of a muted orange, and at its end a column of pure blue.
SceneLinear ramp() {
  SceneLinear xyz(33, 5);
  const Matrix3 to_xyz = *rgb_to_xyz(primaries_rec709);
  for (int y = 0; y < xyz.height(); ++y) {
    for (int x = 0; x < xyz.width(); ++x) {
      const double light = 0.02 * x;
      const Vector3 colour = to_xyz * (x == 32 ? Vector3{0, 0, 1} : Vector3{light, 0.9 * light, 0.85 * light});
      for (int k = 0; k < 3; ++k) xyz.plane[k].at(x, y) = static_cast<float>(colour[k]);
    }
  }
  return xyz;
}

RetargetedPicture made(const RetargetOptions& options, SampleType samples, int threads) {
  PoolExecutor executor(threads);
  auto result = retarget_picture(ramp(), options, samples, executor);
  EXPECT_TRUE(result) << result.error().message;
  return result ? std::move(*result) : RetargetedPicture{};
}

TEST(RetargetPicture, AllSampleTypesHoldTheColoursOfTheMap) {
  RetargetOptions options;
  options.method = RetargetMethod::shin;  // the quickest to tabulate
  options.display_cd_m2 = 10;
  const auto map = retargeting(options);
  ASSERT_TRUE(map);
  const RetargetedPicture codes8 = made(options, SampleType::u8, 2), codes16 = made(options, SampleType::u16, 1);
  const RetargetedPicture light = made(options, SampleType::f32, 1);
  for (int x = 4; x < 32; ++x) {
    const double l = 0.02 * x;
    const Vector3 source{encode_transfer(OutputSpace::srgb, l), encode_transfer(OutputSpace::srgb, 0.9 * l),
                         encode_transfer(OutputSpace::srgb, 0.85 * l)};
    const Vector3 wanted = (*map)(source).code;
    for (int c = 0; c < 3; ++c) {
      // The table's own error, which is reported, and half a code of 8 bits.
      const double tolerance = codes16.error.max_steps / 255;
      const int code16 = std::get<Encoded16>(codes16.picture).codes.at(3 * x + c, 2);
      EXPECT_NEAR(code16 / 65535.0, wanted[c], tolerance) << x;
      EXPECT_NEAR(std::get<Encoded8>(codes8.picture).codes.at(3 * x + c, 2), 255 * code16 / 65535.0, 0.51) << x;
      EXPECT_NEAR(std::get<SceneLinear>(light.picture).plane[c].at(x, 2),
                  decode_transfer(OutputSpace::srgb, code16 / 65535.0), 1e-6)
          << x;
    }
  }
}

TEST(RetargetPicture, TellsWhatShareOfThePixelsTheDisplayCannotShow) {
  RetargetOptions options;
  options.method = RetargetMethod::shin;
  options.display_cd_m2 = 100;
  const RetargetedPicture picture = made(options, SampleType::u8, 1);
  EXPECT_NEAR(picture.fraction_outside_gamut, 1.0 / 33, 1e-12) << "the blue column, all pixels being asked";
  EXPECT_EQ(picture.levels, 33);
  EXPECT_LT(picture.error.mean_ciede2000, retarget_table_tolerance);
  EXPECT_GT(picture.error.max_ciede2000, picture.error.mean_ciede2000);
}

TEST(RetargetPicture, RefusesWhatTheMethodRefuses) {
  InlineExecutor one;
  RetargetOptions options;
  options.display_cd_m2 = -1;
  EXPECT_FALSE(retarget_picture(ramp(), options, SampleType::u8, one));
}

}  // namespace
}  // namespace lowlux::isp
