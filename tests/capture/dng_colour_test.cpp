#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "capture/dng/dng_colour.h"
#include "tests/capture/read_built.h"

namespace lowlux::test {
namespace {

const std::vector<double> some_matrix = {0.9, -0.3, -0.1, -0.5, 1.3, 0.2, -0.1, 0.2, 0.6};

TEST(DngColour, ACalibrationHasItsMatrixAndItsIlluminantsTemperature) {
  const RawFrame frame = read_built(DngBuilder{});
  EXPECT_EQ(frame.colour.source, CameraColour::Source::file_tags);
  ASSERT_EQ(frame.colour.calibrations.size(), 1u);
  const ColourCalibration& one = frame.colour.calibrations[0];
  EXPECT_EQ(one.cct_k, 6504);
  EXPECT_DOUBLE_EQ(one.xyz_to_camera[1][0], -0.45);
  EXPECT_EQ(one.camera_calibration, identity3());
  EXPECT_FALSE(one.forward);
}

TEST(DngColour, TwoCalibrationsComeByRisingTemperature) {
  DngBuilder dng;
  dng.set(50722, Tag::numbers(TagType::srational, some_matrix));
  dng.set(50779, Tag::numbers(TagType::u16, {17}));
  dng.set(50724, Tag::numbers(TagType::srational, {1.01, 0, 0, 0, 1, 0, 0, 0, 0.98}));
  dng.set(50965, Tag::numbers(TagType::srational, {0.6, 0.2, 0.16, 0.25, 0.7, 0.05, 0.01, 0.1, 0.71}));
  const auto& both = read_built(dng).colour.calibrations;
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[0].cct_k, 2856);
  EXPECT_EQ(both[1].cct_k, 6504);
  EXPECT_DOUBLE_EQ(both[0].xyz_to_camera[0][0], 0.9);
  EXPECT_DOUBLE_EQ(both[0].camera_calibration[2][2], 0.98);
  ASSERT_TRUE(both[0].forward);
  EXPECT_DOUBLE_EQ((*both[0].forward)[1][2], 0.05);
  EXPECT_DOUBLE_EQ(both[1].xyz_to_camera[0][0], 0.7);
  EXPECT_FALSE(both[1].forward);
}

TEST(DngColour, TheNeutralIsScaledToALargestValueOfOne) {
  DngBuilder dng;
  dng.set(50728, Tag::numbers(TagType::rational, {1, 2.5, 1.25}));
  const auto neutral = read_built(dng).colour.as_shot_neutral;
  ASSERT_TRUE(neutral);
  EXPECT_DOUBLE_EQ((*neutral)[0], 0.4);
  EXPECT_DOUBLE_EQ((*neutral)[1], 1);
  EXPECT_DOUBLE_EQ((*neutral)[2], 0.5);
}

TEST(DngColour, AsShotWhiteAndAnalogBalanceAreKept) {
  DngBuilder dng;
  dng.remove(50728);
  dng.set(50729, Tag::numbers(TagType::rational, {0.3457, 0.3585}));
  dng.set(50727, Tag::numbers(TagType::rational, {1.5, 1, 2}));
  const CameraColour colour = read_built(dng).colour;
  EXPECT_FALSE(colour.as_shot_neutral);
  ASSERT_TRUE(colour.as_shot_white_xy);
  EXPECT_DOUBLE_EQ((*colour.as_shot_white_xy)[0], 0.3457);
  EXPECT_EQ(colour.analog_balance, (Vector3{1.5, 1, 2}));
}

TEST(DngColour, ACameraCalibrationCountsForTheProfileOfItsSignatureOnly) {
  const auto diagonal_with = [](const char* of_camera, const char* of_profile) {
    DngBuilder dng;
    dng.set(50723, Tag::numbers(TagType::srational, {0.9, 0, 0, 0, 1, 0, 0, 0, 1.1}));
    if (of_camera != nullptr) dng.set(50931, Tag::text(of_camera));
    if (of_profile != nullptr) dng.set(50932, Tag::text(of_profile));
    const RawFrame frame = read_built(dng);
    EXPECT_TRUE(frame.warnings.empty());
    return frame.colour.calibrations.at(0).camera_calibration[0][0];
  };
  EXPECT_DOUBLE_EQ(diagonal_with(nullptr, nullptr), 0.9);
  EXPECT_DOUBLE_EQ(diagonal_with("com.adobe", "com.adobe"), 0.9);
  EXPECT_DOUBLE_EQ(diagonal_with("", nullptr), 0.9);
  EXPECT_DOUBLE_EQ(diagonal_with("com.adobe", "another"), 1);
  EXPECT_DOUBLE_EQ(diagonal_with("com.adobe", nullptr), 1);
  EXPECT_DOUBLE_EQ(diagonal_with(nullptr, "com.adobe"), 1);
}

TEST(DngColour, AnUnknownCameraWithoutMatrixHasNoCalibration) {
  DngBuilder dng;
  dng.remove(50721);
  const CameraColour colour = read_built(dng).colour;
  EXPECT_TRUE(colour.calibrations.empty());
  EXPECT_EQ(colour.source, CameraColour::Source::none);
}

TEST(DngColour, AKnownCameraWithoutMatrixGetsTheDecodersTable) {
  DngBuilder dng;
  dng.remove(50721);
  dng.set(271, Tag::text("Canon"));
  dng.set(272, Tag::text("Canon EOS 5D Mark II"));
  dng.set(50708, Tag::text("Canon EOS 5D Mark II"));
  const CameraColour colour = read_built(dng).colour;
  EXPECT_EQ(colour.source, CameraColour::Source::decoder_table);
  ASSERT_EQ(colour.calibrations.size(), 1u);
  // Adobe's matrix for this camera under D65, as dcraw publishes it.
  EXPECT_NEAR(colour.calibrations[0].xyz_to_camera[0][0], 0.4716, 1e-6);
  EXPECT_NEAR(colour.calibrations[0].xyz_to_camera[2][2], 0.6651, 1e-6);
  EXPECT_EQ(colour.calibrations[0].cct_k, 6504);
}

bool warns(const DngBuilder& dng, const std::string& words) {
  const std::string warning = warned(dng);
  EXPECT_TRUE(warning.ends_with("; the tag is ignored")) << warning;
  return warning.find(words) != std::string::npos;
}

TEST(DngColour, MatricesThatAreNotNumbersAreIgnoredByName) {
  for (const std::uint16_t id : {50722, 50723, 50964}) {
    DngBuilder dng;
    std::vector<std::pair<double, double>> values;
    values.reserve(9);
    for (const double v : some_matrix) values.emplace_back(v * 10, 10);
    values[4] = {0, 0};
    dng.set(id, Tag::rationals(TagType::srational, values));
    EXPECT_TRUE(warns(dng, "holds a value that is not a number")) << id;
    values[4] = {1, 0};
    dng.set(id, Tag::rationals(TagType::srational, values));
    EXPECT_TRUE(warns(dng, "holds a value that is not a number")) << id;
  }
}

TEST(DngColour, SingularAndTruncatedMatricesAreIgnoredByName) {
  DngBuilder rows;
  rows.set(50722, Tag::numbers(TagType::srational, {1, 2, 3, 2, 4, 6, 0, 0, 1}));
  EXPECT_TRUE(warns(rows, "ColorMatrix2 is a singular matrix"));
  EXPECT_EQ(read_built(rows).colour.calibrations.size(), 1u) << "the sound one is kept";
  DngBuilder brief;
  brief.set(50723, Tag::numbers(TagType::srational, {1, 0, 0, 0, 1, 0}));
  EXPECT_TRUE(warns(brief, "CameraCalibration1 has 6 values, expected 9 values"));
  DngBuilder forward;
  forward.set(50964, Tag::numbers(TagType::srational, {-1, 0, 0, 0, 1, 0, 0, 0, 1}));
  EXPECT_TRUE(warns(forward, "ForwardMatrix1 maps a neutral to an impossible colour"));
}

TEST(DngColour, ADamagedColourMatrixIsAnErrorUnlessAnotherOneServes) {
  std::vector<double> values = some_matrix;
  values[8] = std::numeric_limits<double>::quiet_NaN();
  DngBuilder dng;
  dng.set(50721, Tag::numbers(TagType::f32, values));
  const Error error = refused(dng);
  EXPECT_EQ(error.code, ErrorCode::malformed);
  EXPECT_TRUE(has(error, "ColorMatrix1 holds a value that is not a number"));
  dng.set(50721, Tag::numbers(TagType::srational, std::vector<double>(9, 0)));
  EXPECT_TRUE(has(refused(dng), "ColorMatrix1 is a singular matrix"));

  dng.set(50722, Tag::numbers(TagType::srational, some_matrix));
  EXPECT_TRUE(warns(dng, "ColorMatrix1 is a singular matrix"));
  EXPECT_EQ(read_built(dng).colour.calibrations.size(), 1u);
  dng.remove(50722);
  for (const std::uint16_t id : {272, 50708}) dng.set(id, Tag::text("Canon EOS 5D Mark II"));
  dng.set(271, Tag::text("Canon"));
  EXPECT_TRUE(warns(dng, "ColorMatrix1 is a singular matrix"));
  EXPECT_EQ(read_built(dng).colour.source, CameraColour::Source::decoder_table);
}

TEST(DngColour, WhitesThatCannotBeAreIgnoredByName) {
  const std::pair<std::uint16_t, Tag> cases[] = {{50728, Tag::numbers(TagType::rational, {0.5, 0, 0.6})},
                                                 {50728, Tag::rationals(TagType::rational, {{1, 2}, {1, 0}, {1, 2}})},
                                                 {50728, Tag::numbers(TagType::srational, {0.5, -1, 0.6})},
                                                 {50728, Tag::numbers(TagType::rational, {1, 1000000, 1})},
                                                 {50728, Tag::numbers(TagType::f64, {5e-306, 1e-305, 6e-306})},
                                                 {50727, Tag::numbers(TagType::rational, {1, 1, 0})},
                                                 {50729, Tag::numbers(TagType::rational, {0.7, 0.7})},
                                                 {50729, Tag::rationals(TagType::rational, {{0, 0}, {1, 3}})}};
  for (const auto& [id, tag] : cases) {
    DngBuilder dng;
    dng.set(id, tag);
    EXPECT_TRUE(warns(dng, "holds")) << id;
  }
}

TEST(DngColour, ANeutralThatNoLightHasGivesWayToTheWhiteThatTheFileStates) {
  DngBuilder dng;
  dng.set(50728, Tag::numbers(TagType::rational, {1, 0.01, 1}));
  dng.set(50729, Tag::numbers(TagType::rational, {0.3457, 0.3585}));
  EXPECT_EQ(warned(dng),
            "the as-shot neutral 1 0.01 1 is not the colour of a light under the camera's colour matrices; it is "
            "ignored, --wb sets another");
  EXPECT_FALSE(read_built(dng).colour.as_shot_neutral);
  EXPECT_TRUE(read_built(dng).colour.as_shot_white_xy);
  dng.remove(50728).set(50729, Tag::numbers(TagType::rational, {0.01, 0.001}));
  EXPECT_EQ(warned(dng).find("the as-shot white x 0.01 y 0.001 is not"), 0u);
  EXPECT_FALSE(read_built(dng).colour.as_shot_white_xy);
}

TEST(DngColour, WhitesBeyondTheSpectralLocusAreIgnoredWithAForwardMatrixToo) {
  DngBuilder dng;
  dng.set(50964, Tag::numbers(TagType::srational, {0.6, 0.2, 0.1643, 0.3, 0.6, 0.1, 0.05, 0.1, 0.6751}));
  // The last ones are yellow like sodium light, a red lamp, and equal channels (2000 K with a magenta tint).
  const std::pair<std::vector<double>, bool> cases[] = {{{1, 10, 1}, true},   {{1, 0.1, 1}, true},  {{1, 900, 1}, true},
                                                        {{1, 1, 0.1}, false}, {{5, 1, 0.2}, false}, {{1, 1, 1}, false}};
  for (const auto& [neutral, is_ignored] : cases) {
    dng.set(50728, Tag::numbers(TagType::rational, neutral));
    const RawFrame frame = read_built(dng);
    ASSERT_EQ(frame.warnings.size(), is_ignored ? 1u : 0u) << neutral[0] << " " << neutral[1];
    if (is_ignored) {
      EXPECT_NE(frame.warnings[0].find("is not the colour of a light"), std::string::npos);
    }
    EXPECT_NE(frame.colour.as_shot_neutral.has_value(), is_ignored);
  }
  dng.remove(50728).set(50729, Tag::numbers(TagType::rational, {0.4, 0.55}));
  EXPECT_TRUE(read_built(dng).warnings.empty());
  dng.set(50729, Tag::numbers(TagType::rational, {0.45, 0.08}));
  EXPECT_EQ(warned(dng).find("the as-shot white x 0.45 y 0.08 is not"), 0u);
}

TEST(DngColour, NoiseProfilesAreOneForAllOrOnePerColour) {
  DngBuilder one;
  one.set(51041, Tag::numbers(TagType::f64, {1.5e-4, 4.9e-8}));
  const auto all = read_built(one).noise;
  ASSERT_TRUE(all);
  EXPECT_EQ(all->scale, (std::array<double, 3>{1.5e-4, 1.5e-4, 1.5e-4}));
  EXPECT_EQ(all->offset[2], 4.9e-8);

  DngBuilder three;
  three.set(51041, Tag::numbers(TagType::f64, {1e-4, 1e-8, 2e-4, 2e-8, 3e-4, 3e-8}));
  const auto each = read_built(three).noise;
  ASSERT_TRUE(each);
  EXPECT_EQ(each->scale, (std::array<double, 3>{1e-4, 2e-4, 3e-4}));
  EXPECT_EQ(each->offset, (std::array<double, 3>{1e-8, 2e-8, 3e-8}));

  // NoiseReductionApplied: 0/0 is not known, as is what is not within 0 to 1.
  for (const auto& [applied, reduced] : {std::pair{0.0, false}, {0.5, true}, {1.0, true}, {7.0, false}}) {
    one.set(50935, Tag::numbers(TagType::rational, {applied}));
    EXPECT_EQ(read_built(one).noise->reduced, reduced) << applied;
  }
  EXPECT_FALSE(all->reduced);

  EXPECT_FALSE(read_built(DngBuilder{}).noise);
  DngBuilder bad;
  bad.set(51041, Tag::numbers(TagType::f64, {std::numeric_limits<double>::quiet_NaN(), 0}));
  EXPECT_TRUE(warns(bad, "NoiseProfile"));
  EXPECT_FALSE(read_built(bad).noise);
  bad.set(51041, Tag::numbers(TagType::f64, {1, 2, 3, 4}));
  EXPECT_TRUE(warns(bad, "NoiseProfile"));
}

TEST(DngColour, StandardIlluminantsHaveTheirTemperaturesAndUnknownOnesNone) {
  EXPECT_EQ(capture::illuminant_cct_k(17), 2856);  // CIE 15
  EXPECT_EQ(capture::illuminant_cct_k(18), 4874);
  EXPECT_EQ(capture::illuminant_cct_k(19), 6774);
  EXPECT_EQ(capture::illuminant_cct_k(20), 5503);
  EXPECT_EQ(capture::illuminant_cct_k(21), 6504);
  EXPECT_EQ(capture::illuminant_cct_k(22), 7504);
  EXPECT_EQ(capture::illuminant_cct_k(23), 5003);
  EXPECT_EQ(capture::illuminant_cct_k(0), 0);
  EXPECT_EQ(capture::illuminant_cct_k(255), 0);
}

TEST(DngInfo, ExifIsReadAndNonsenseStaysAbsent) {
  DngBuilder dng;
  dng.set(33434, Tag::rationals(TagType::rational, {{1, 8}}));
  dng.set(33437, Tag::rationals(TagType::rational, {{28, 10}}));
  dng.set(34855, Tag::numbers(TagType::u16, {6400}));
  dng.set(37386, Tag::rationals(TagType::rational, {{35, 1}}));
  dng.set(36867, Tag::text("2024:12:24 23:59:01"));
  dng.set(37888, Tag::rationals(TagType::srational, {{-55, 10}}));
  dng.set(305, Tag::text("firmware 1"));
  const FrameInfo info = read_built(dng).raw.info;
  EXPECT_EQ(info.make, "Test");
  EXPECT_EQ(info.model, "Camera");
  EXPECT_EQ(info.software, "firmware 1");
  EXPECT_EQ(info.exposure_s, 0.125);
  EXPECT_EQ(info.f_number, 2.8);
  EXPECT_EQ(info.iso, 6400);
  EXPECT_EQ(info.focal_length_mm, 35);
  EXPECT_EQ(info.temperature_c, -5.5);
  EXPECT_EQ(info.date_time, "2024:12:24 23:59:01");

  dng.set(33434, Tag::rationals(TagType::rational, {{0, 1}}));
  dng.set(33437, Tag::rationals(TagType::rational, {{0, 0}}));
  dng.set(34855, Tag::numbers(TagType::u16, {0}));
  dng.set(37386, Tag::rationals(TagType::rational, {{1, 0}}));
  dng.set(36867, Tag::text("yesterday"));
  dng.set(37888, Tag::rationals(TagType::srational, {{9999, 1}}));
  const FrameInfo absent = read_built(dng).raw.info;
  EXPECT_FALSE(absent.exposure_s || absent.f_number || absent.iso || absent.focal_length_mm || absent.temperature_c);
  EXPECT_EQ(absent.date_time, "");
}

TEST(DngInfo, AnIsoTooLargeForItsTagIsTakenFromTheExposureIndex) {
  DngBuilder dng;
  dng.set(34855, Tag::numbers(TagType::u16, {65535}));
  EXPECT_FALSE(read_built(dng).raw.info.iso);
  dng.set(34866, Tag::numbers(TagType::u32, {204800}));
  EXPECT_EQ(read_built(dng).raw.info.iso, 204800);
}

}  // namespace
}  // namespace lowlux::test
