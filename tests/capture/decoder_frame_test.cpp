#include "capture/file/decoder_frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "capture/file/dng_source.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::capture {
namespace {

constexpr std::uint32_t rggb = 0x94949494, grbg = 0x61616161, gbrg = 0x49494949, bggr = 0x16161616;

/// What a decoder could say about a small Bayer raw with masked columns.
DecodedRaw decoded() {
  DecodedRaw raw;
  DecodedHeader& h = raw.header;
  h.outcome = DecodeOutcome::decoded;
  h.raw_width = 40, h.raw_height = 30, h.samples = 1;
  h.left = 6, h.top = 2, h.width = 32, h.height = 26;
  h.filters = rggb;
  h.black = 100;
  h.maximum = 4000;
  h.camera_multiplier[0] = 2, h.camera_multiplier[1] = 1, h.camera_multiplier[2] = 1.6F;
  h.sensor_temperature_c = h.camera_temperature_c = -1000;
  h.pixel_aspect = 1;
  raw.samples = Plane<std::uint16_t>(40, 30);
  return raw;
}

RawFrame frame_of(DecodedRaw raw) {
  auto frame = frame_of_decoder(std::move(raw));
  if (frame) return *std::move(frame);
  ADD_FAILURE() << frame.error().message;
  return {};
}

TEST(DecoderFrame, GeometryComesFromTheVisibleArea) {
  const RawFrame frame = frame_of(decoded());
  EXPECT_EQ(frame.raw.active, (Rect{6, 2, 32, 26}));
  EXPECT_EQ(frame.raw.default_crop, (Rect{0, 0, 32, 26}));
  EXPECT_EQ(frame.raw.dn.width(), 40);
  EXPECT_FALSE(frame.raw.masked_is_stated);
  EXPECT_EQ(frame.raw.masked.size(), 4u);
}

TEST(DecoderFrame, TheFourPatternsAreThePhasesOfTheVisibleCorner) {
  const std::pair<std::uint32_t, BayerPhase> cases[] = {{rggb, BayerPhase::rggb},
                                                        {grbg, BayerPhase::grbg},
                                                        {gbrg, BayerPhase::gbrg},
                                                        {bggr, BayerPhase::bggr},
                                                        {0xB4B4B4B4, BayerPhase::rggb}};  // 3 for the second green
  for (const auto& [filters, phase] : cases) {
    DecodedRaw raw = decoded();
    raw.header.filters = filters;
    EXPECT_EQ(frame_of(std::move(raw)).raw.phase, phase);
  }
  DecodedRaw other = decoded();
  other.header.filters = 0x94949416;
  EXPECT_FALSE(frame_of_decoder(std::move(other)));
}

TEST(DecoderFrame, BlackIsTheSumOfItsThreeParts) {
  DecodedRaw raw = decoded();
  DecodedHeader& h = raw.header;
  h.filters = 0xB4B4B4B4;
  for (int i = 0; i < 4; ++i) h.channel_black[i] = 10 * i;  // R, G, B, second G
  h.pattern_rows = 1, h.pattern_columns = 3;
  for (int i = 0; i < 3; ++i) h.pattern_black[i] = i;
  const RawFrame frame = frame_of(std::move(raw));
  ASSERT_TRUE(frame.raw.black_tag);
  const int channel[2][2] = {{0, 1}, {3, 2}};
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 12; ++x) {
      EXPECT_EQ(frame.raw.black_tag->at(x, y), 100 + 10 * channel[y % 2][x % 2] + x % 3) << x << ", " << y;
    }
  }
}

TEST(DecoderFrame, ABlackOfZeroNextToStatedMasksIsNotATag) {
  DecodedRaw raw = decoded();
  raw.header.black = 0;
  const int mask[4] = {2, 0, 28, 5};
  std::copy_n(mask, 4, raw.header.masks[0]);
  const RawFrame masked = frame_of(std::move(raw));
  EXPECT_FALSE(masked.raw.black_tag);
  EXPECT_TRUE(masked.raw.masked_is_stated);
  EXPECT_EQ(masked.raw.masked, (std::vector<Rect>{{0, 2, 5, 26}}));

  DecodedRaw zero = decoded();
  zero.header.black = 0;
  const RawFrame quoted = frame_of(std::move(zero));
  EXPECT_TRUE(quoted.raw.black_tag);
  ASSERT_EQ(quoted.warnings.size(), 1u);
  EXPECT_NE(quoted.warnings[0].find("black level of 0"), std::string::npos);
}

TEST(DecoderFrame, AHeaderlessDumpIsReadFromEndToEnd) {
  // LibRaw knows the AVT F-080C by the size of its dumps: 1024 x 768 pixels of 8 bits, RGGB.
  std::vector<std::byte> dump(std::size_t{1024} * 768);
  for (std::size_t i = 0; i < dump.size(); ++i) dump[i] = static_cast<std::byte>(i * 2654435761U >> 13);
  const auto frame = read_raw(dump, "dump.raw");
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->raw.info.model, "F-080C");
  const auto is_guess = [](const std::string& w) {
    return w.find("F-080C was guessed from the size of the file alone") != std::string::npos;
  };
  EXPECT_EQ(std::count_if(frame->warnings.begin(), frame->warnings.end(), is_guess), 1);
  EXPECT_EQ(frame->raw.active, (Rect{0, 0, 1024, 768}));
  EXPECT_EQ(frame->raw.phase, BayerPhase::rggb);
  EXPECT_EQ(frame->raw.white_dn[0], 255);
  EXPECT_TRUE(frame->colour.calibrations.empty());
  for (std::size_t i = 0; i < dump.size(); ++i) {
    ASSERT_EQ(frame->raw.dn.data()[i], std::to_integer<int>(dump[i])) << i;
  }
}

// The header of a Nokia raw: data offset, bytes, width and height from byte 300 on. The file has the size of the dump.
TEST(DecoderFrame, AFileWithAHeaderIsNotAGuessAlthoughDumpsHaveItsSize) {
  std::vector<std::byte> file(std::size_t{1024} * 768, std::byte{100});
  std::memcpy(file.data(), "NOKIARAW", 8);
  const std::uint32_t offset = 4096, bytes = 512 * 512;
  const std::uint16_t size[2] = {512, 512};
  std::memcpy(&file[300], &offset, 4);
  std::memcpy(&file[304], &bytes, 4);
  std::memcpy(&file[308], size, 4);
  const auto frame = read_raw(file, "nokia.raw");
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_NE(frame->raw.info.model, "F-080C");
  for (const std::string& warning : frame->warnings) EXPECT_EQ(warning.find("guessed"), std::string::npos) << warning;
}

TEST(DecoderFrame, TheNeutralIsTheInverseOfTheMultipliers) {
  const auto neutral = frame_of(decoded()).colour.as_shot_neutral;
  ASSERT_TRUE(neutral);
  EXPECT_DOUBLE_EQ((*neutral)[0], 0.5);
  EXPECT_DOUBLE_EQ((*neutral)[1], 1);
  EXPECT_NEAR((*neutral)[2], 0.625, 1e-7);  // float multipliers
  for (const float unknown : {0.0F, -1.0F, std::numeric_limits<float>::quiet_NaN()}) {
    DecodedRaw raw = decoded();
    raw.header.camera_multiplier[0] = unknown;
    EXPECT_FALSE(frame_of(std::move(raw)).colour.as_shot_neutral);
  }
}

TEST(DecoderFrame, TheTableMatrixIsUsedIfItHasAnInverse) {
  EXPECT_EQ(frame_of(decoded()).colour.source, CameraColour::Source::none);
  DecodedRaw raw = decoded();
  for (int i = 0; i < 3; ++i) raw.header.xyz_to_camera[i][i] = 0.5F;
  const CameraColour colour = frame_of(std::move(raw)).colour;
  EXPECT_EQ(colour.source, CameraColour::Source::decoder_table);
  ASSERT_EQ(colour.calibrations.size(), 1u);
  EXPECT_EQ(colour.calibrations[0].xyz_to_camera, (0.5 * identity3()));
  EXPECT_EQ(colour.calibrations[0].cct_k, 6504);
}

// A camera that LibRaw knows by its matrix to sRGB: white-balanced camera RGB becomes XYZ as if it were sRGB of D65.
TEST(DecoderFrame, AMatrixToSrgbIsUsedWithTheWhiteOfTheShot) {
  DecodedRaw raw = decoded();
  const float to_srgb[3][3] = {{1.81F, -0.34F, -0.47F}, {-0.44F, 1.86F, -0.42F}, {-0.68F, -1.39F, 3.07F}};
  std::copy_n(&to_srgb[0][0], 9, &raw.header.camera_to_srgb[0][0]);
  for (int i = 0; i < 3; ++i) raw.header.camera_multiplier[i] = 0;
  DecodedRaw without_white = decoded();
  without_white.header = raw.header;
  EXPECT_EQ(frame_of(std::move(without_white)).colour.source, CameraColour::Source::none);
  const float gain[3] = {1.6F, 1, 1.25F};
  std::copy_n(gain, 3, raw.header.camera_multiplier);
  const CameraColour colour = frame_of(std::move(raw)).colour;
  EXPECT_EQ(colour.source, CameraColour::Source::decoder_table);
  ASSERT_EQ(colour.calibrations.size(), 1u);
  EXPECT_EQ(colour.calibrations[0].cct_k, 6504);
  const Vector3 srgb{0.2, 0.7, 0.4};
  const Vector3 camera = colour.calibrations[0].xyz_to_camera * (*isp::rgb_to_xyz(isp::primaries_rec709) * srgb);
  for (int i = 0; i < 3; ++i) {
    double back = 0;
    for (int j = 0; j < 3; ++j) back += to_srgb[i][j] * camera[j] * gain[j];
    EXPECT_NEAR(back, srgb[i], 1e-6);  // float multipliers
  }
}

TEST(DecoderFrame, FlipsBecomeOrientations) {
  const Orientation expected[8] = {
      Orientation::normal,    Orientation::mirror_horizontal, Orientation::mirror_vertical, Orientation::rotate_180,
      Orientation::transpose, Orientation::rotate_270,        Orientation::rotate_90,       Orientation::transverse};
  for (int flip = 0; flip < 8; ++flip) {
    DecodedRaw raw = decoded();
    raw.header.flip = flip;
    EXPECT_EQ(frame_of(std::move(raw)).raw.info.orientation, expected[flip]);
  }
  DecodedRaw odd = decoded();
  odd.header.flip = 90;
  EXPECT_EQ(frame_of(std::move(odd)).raw.info.orientation, Orientation::normal);
}

TEST(DecoderFrame, ImpossibleFiguresAreErrors) {
  const auto refused = [](auto change) {
    DecodedRaw raw = decoded();
    change(raw.header);
    const auto frame = frame_of_decoder(std::move(raw));
    return frame ? std::string() : frame.error().message;
  };
  EXPECT_NE(refused([](auto& h) { h.left = 20; }).find("visible area"), std::string::npos);
  EXPECT_NE(refused([](auto& h) { h.width = std::numeric_limits<int>::max(); }).find("visible area"),
            std::string::npos);
  EXPECT_NE(refused([](auto& h) { h.top = -1; }).find("visible area"), std::string::npos);
  EXPECT_NE(refused([](auto& h) { h.maximum = 0; }).find("white level of 0"), std::string::npos);
  EXPECT_NE(refused([](auto& h) { h.black = 4000; }).find("not above black level 4000"), std::string::npos);
}

TEST(DecoderFrame, InfoKeepsPlausibleValues) {
  DecodedRaw raw = decoded();
  raw.header.iso = 3200;
  raw.header.exposure_s = 0.5F;
  raw.header.f_number = 0;
  raw.header.camera_temperature_c = 31;
  const FrameInfo info = frame_of(std::move(raw)).raw.info;
  EXPECT_EQ(info.iso, 3200);
  EXPECT_EQ(info.exposure_s, 0.5);
  EXPECT_FALSE(info.f_number);
  EXPECT_FALSE(info.focal_length_mm);
  EXPECT_EQ(info.temperature_c, 31);
}

TEST(DecoderFrame, MonochromeAndThreeSamplesHaveTheirLayouts) {
  DecodedRaw mono = decoded();
  mono.header.filters = 0;
  EXPECT_EQ(frame_of(std::move(mono)).raw.layout, SensorLayout::monochrome);
  DecodedRaw rgb = decoded();
  rgb.header.filters = 0;
  rgb.header.samples = 3;
  EXPECT_EQ(frame_of(std::move(rgb)).raw.layout, SensorLayout::linear_rgb);
}

}  // namespace
}  // namespace lowlux::capture
