#include "capture/camera/camera_frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "isp/model/colour/camera_colour.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/correlated_colour_temperature.h"

namespace lowlux {
namespace {

using capture::CameraFormat;
using capture::CameraFrame;

CameraFormat format_of(int bits, BayerPhase phase = BayerPhase::rggb, SensorLayout layout = SensorLayout::bayer) {
  const RawPacking packing = bits == 8 ? RawPacking::byte : RawPacking::little16;
  CameraFormat out{.raw = {bits, packing, layout, phase}, .width = 6, .height = 4};
  out.stride_bytes = row_bytes(out.raw, out.width) + 10;
  return out;
}

class CameraFrames : public testing::Test {
 protected:
  RawFrame converted(const CameraFormat& format) {
    memory_.resize(capture::frame_bytes(format));
    frame_.bytes = memory_;
    return capture::raw_frame_of(frame_, format, "Camera 1");
  }
  std::vector<std::byte> memory_;
  CameraFrame frame_;
};

bool warns(const RawFrame& frame, const std::string& text) {
  return std::ranges::any_of(frame.warnings, [&](const auto& w) { return w.find(text) != std::string::npos; });
}

TEST_F(CameraFrames, HoldTheCodesOfTheirRowsWithoutWhatAStrideAdds) {
  const CameraFormat format = format_of(10, BayerPhase::gbrg);
  memory_.assign(capture::frame_bytes(format), std::byte{0xFF});
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 6; ++x) {
      memory_[y * format.stride_bytes + 2 * x] = static_cast<std::byte>(16 * y + x);
      memory_[y * format.stride_bytes + 2 * x + 1] = std::byte{1};
    }
  }
  const RawFrame frame = converted(format);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 6; ++x) EXPECT_EQ(frame.raw.dn.at(x, y), 256 + 16 * y + x);
  }
  EXPECT_EQ(frame.raw.phase, BayerPhase::gbrg);
  EXPECT_EQ(frame.raw.active, (Rect{0, 0, 6, 4}));
  EXPECT_EQ(frame.raw.white_dn, (std::array<double, 3>{1023, 1023, 1023}));
  EXPECT_EQ(frame.raw.info.model, "Camera 1");
  EXPECT_FALSE(frame.raw.black_tag);
  EXPECT_FALSE(frame.raw.info.exposure_s || frame.raw.info.iso || frame.raw.info.temperature_c);
}

TEST_F(CameraFrames, PutTheBlackLevelOfEachColourOnItsSite) {
  frame_.facts.black_level_dn = {64, 65, 66.25, 67};
  for (const BayerPhase phase : {BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr}) {
    const RawFrame frame = converted(format_of(10, phase));
    ASSERT_TRUE(frame.raw.black_tag);
    for (int site = 0; site < 4; ++site) {
      const int x = site & 1, y = site >> 1;
      double expected = y == red_row(phase) ? 65 : 66.25;
      if (colour_at(phase, x, y) == CfaColour::red) expected = 64;
      if (colour_at(phase, x, y) == CfaColour::blue) expected = 67;
      EXPECT_EQ(frame.raw.black_tag->at(x, y), expected) << static_cast<int>(phase) << " " << site;
    }
  }
}

TEST_F(CameraFrames, SayHowTheyWereTaken) {
  frame_.facts.exposure_s = 0.02;
  frame_.facts.analogue_gain = 2.004;
  frame_.facts.temperature_c = -3.5;
  const FrameInfo info = converted(format_of(12)).raw.info;
  EXPECT_EQ(info.exposure_s, static_cast<double>(0.02F));
  EXPECT_EQ(info.iso, 200);
  EXPECT_EQ(info.temperature_c, -3.5);
}

TEST_F(CameraFrames, BringWhiteToWhiteAndGiveTheCamerasMatrixBack) {
  frame_.facts.colour_gains = {2.0, 1.6};
  frame_.facts.colour_matrix = {1.7, -0.5, -0.2, -0.3, 1.6, -0.3, 0.0, -0.6, 1.6};
  for (const std::optional<double> cct_k : {std::optional<double>(), std::optional(3200.0), std::optional(5500.0)}) {
    frame_.facts.colour_temperature_k = cct_k;
    const RawFrame frame = converted(format_of(10));
    EXPECT_TRUE(frame.warnings.empty());
    ASSERT_EQ(frame.colour.calibrations.size(), 1u);
    ASSERT_TRUE(frame.colour.as_shot_neutral);
    const Vector3& neutral = *frame.colour.as_shot_neutral;
    EXPECT_NEAR(neutral[0], 0.5, 1e-6);  // rounded to 2^-20
    EXPECT_NEAR(neutral[2], 0.625, 1e-6);
    // A white as shot is the light that was told of, 1e-4 in xy: the matrix is rounded to 2^-16.
    const auto white = isp::white_of_neutral(frame.colour, neutral);
    const isp::Xy told = cct_k ? *isp::white_of_temperature(*cct_k) : isp::white_d65;
    ASSERT_TRUE(white);
    EXPECT_NEAR(white->xy.x, told.x, 1e-4);
    EXPECT_NEAR(white->xy.y, told.y, 1e-4);
    // Camera RGB of a colour goes where gains and matrix lead it.
    const auto to_xyz = isp::camera_to_xyz(frame.colour, white->xy, isp::white_d65);
    const auto to_srgb = inverse(*isp::rgb_to_xyz(isp::primaries_rec709));
    ASSERT_TRUE(to_xyz && to_srgb);
    const Vector3 got = *to_srgb * (*to_xyz * Vector3{0.2, 0.3, 0.1});
    const Vector3 balanced{0.2 * 2, 0.3, 0.1 * 1.6};
    for (int i = 0; i < 3; ++i) {
      double expected = 0;
      for (int j = 0; j < 3; ++j) expected += (*frame_.facts.colour_matrix)[3 * i + j] * balanced[j];
      EXPECT_NEAR(got[i], expected, 2e-4) << i;  // twice the neutral's and the matrix' roundings through a factor of 2
    }
  }
}

TEST_F(CameraFrames, TakeUnknownColoursForThoseOfSrgbAndSaySo) {
  const RawFrame frame = converted(format_of(10));
  ASSERT_EQ(frame.colour.calibrations.size(), 1u);
  EXPECT_FALSE(frame.colour.as_shot_neutral);
  EXPECT_TRUE(warns(frame, std::string(capture::colours_unknown)));
  const auto to_xyz = isp::camera_to_xyz(frame.colour, isp::white_d65, isp::white_d65);
  const Matrix3 expected = *isp::rgb_to_xyz(isp::primaries_rec709);
  ASSERT_TRUE(to_xyz);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      EXPECT_NEAR((*to_xyz)[i][j], expected[i][j], 1e-4) << i << j;  // of 2^-16 for each figure
  }
}

TEST_F(CameraFrames, OfOneColourHaveNoMatrix) {
  frame_.facts.colour_gains = {2.0, 1.6};
  frame_.facts.black_level_dn = {16, 16, 16, 16};
  const RawFrame frame = converted(format_of(8, BayerPhase::rggb, SensorLayout::monochrome));
  EXPECT_TRUE(frame.colour.calibrations.empty());
  EXPECT_FALSE(frame.colour.as_shot_neutral);
  EXPECT_TRUE(frame.warnings.empty());
  EXPECT_EQ(frame.raw.white_dn[1], 255);
  EXPECT_EQ(frame.raw.black_tag->at(1, 1), 16);
}

TEST_F(CameraFrames, LeaveFactsOutThatCannotBe) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double level : {nan, -1.0, 1023.0, 1e30}) {
    frame_.facts = {};
    frame_.facts.black_level_dn = {64, 64, level, 64};
    const RawFrame frame = converted(format_of(10));
    EXPECT_FALSE(frame.raw.black_tag) << level;
    EXPECT_TRUE(warns(frame, "black level")) << level;
  }
  for (const double gain : {nan, 0.0, -2.0, 1e-4, 1e4}) {
    frame_.facts = {};
    frame_.facts.colour_gains = {1.5, gain};
    const RawFrame frame = converted(format_of(10));
    EXPECT_FALSE(frame.colour.as_shot_neutral) << gain;
    EXPECT_TRUE(warns(frame, "colour gains")) << gain;
  }
  for (const double figure : {nan, 1e3, 0.0}) {  // with 0 two rows are the same
    frame_.facts = {};
    frame_.facts.colour_matrix = {1, 0, 0, 1, figure, 0, 0, 0, 1};
    const RawFrame frame = converted(format_of(10));
    EXPECT_TRUE(warns(frame, "colour matrix")) << figure;
    EXPECT_EQ(frame.colour.calibrations.size(), 1u) << figure;
  }
  frame_.facts = {};
  frame_.facts.exposure_s = 0;
  frame_.facts.analogue_gain = -1;
  frame_.facts.temperature_c = nan;
  frame_.facts.colour_temperature_k = nan;
  const RawFrame frame = converted(format_of(10));
  EXPECT_FALSE(frame.raw.info.exposure_s || frame.raw.info.iso || frame.raw.info.temperature_c);
  EXPECT_EQ(frame.colour.calibrations.at(0).cct_k, 6504);
}

}  // namespace
}  // namespace lowlux
