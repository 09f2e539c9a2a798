#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <utility>

#include "capture/file/dng_source.h"
#include "isp/output/dng/dng_writer.h"
#include "tests/codec/pictures.h"
#include "tests/support/as_floats.h"
#include "tests/support/raw_frames.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::plain_frame;

/// libtiff takes rationals as floats, which are within 6e-8 of a figure, and finds fractions that are closer still.
constexpr double rational_tolerance = 1e-7;  // relative

RawFrame round_trip(const RawFrame& frame, const isp::DngWriteOptions& options = {}) {
  const test::ScratchDirectory scratch;
  const auto written = isp::write_dng(frame, scratch.file("a.dng"), options);
  EXPECT_TRUE(written) << (written ? "" : written.error().message);
  auto read = capture::read_raw(scratch.file("a.dng"));
  EXPECT_TRUE(read) << (read ? "" : read.error().message);
  if (!read) return {};
  EXPECT_TRUE(read->warnings.empty()) << read->warnings.front();
  return *std::move(read);
}

void expect_near(const Matrix3& found, const Matrix3& expected) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      EXPECT_NEAR(found[i][j], expected[i][j], rational_tolerance * std::fabs(expected[i][j])) << i << j;
    }
  }
}

TEST(DngRoundTrip, EveryPhaseAndLayoutAtOddAndEvenSizesIsBitExact) {
  for (const auto& [width, height] : {std::pair{22, 22}, {23, 31}, {64, 25}, {701, 1503}}) {
    for (int phase = 0; phase < 4; ++phase) {
      const RawFrame frame = plain_frame(width, height, SensorLayout::bayer, static_cast<BayerPhase>(phase));
      const RawFrame read = round_trip(frame);
      EXPECT_EQ(read.raw.layout, SensorLayout::bayer);
      EXPECT_EQ(read.raw.phase, frame.raw.phase);
      EXPECT_TRUE(test::same_bits(read.raw.dn, frame.raw.dn)) << width << " x " << height;
    }
    for (const SensorLayout layout : {SensorLayout::monochrome, SensorLayout::linear_rgb}) {
      const RawFrame frame = plain_frame(width, height, layout);
      const RawFrame read = round_trip(frame);
      EXPECT_EQ(read.raw.layout, layout);
      EXPECT_TRUE(test::same_bits(read.raw.dn, frame.raw.dn)) << width << " x " << height;
      EXPECT_EQ(read.colour.calibrations.size(), frame.colour.calibrations.size());
    }
  }
}

/// The tiles of a lossless JPEG are decoded by LibRaw, deflated floats by lowlux.
TEST(DngRoundTrip, CompressedSamplesOfDrawnSizesAreBitExact) {
  const std::uint64_t seed = std::random_device{}();
  std::mt19937_64 random(seed);
  const auto side = [&] { return static_cast<int>(22 * std::exp2(std::uniform_real_distribution<>(0, 6.5)(random))); };
  for (int i = 0; i < 40; ++i) {
    const int width = i < 6 ? 1024 : side(), height = side();  // 1024: two tiles
    const auto layout = static_cast<SensorLayout>(i % 3);
    RawFrame frame = plain_frame(width, height, layout, static_cast<BayerPhase>(random() % 4));
    const bool floats = i % 4 == 3;
    if (floats) {
      test::make_floats(frame.raw);
    } else {
      const double noise = std::exp2(std::uniform_real_distribution<>(0, 16)(random));
      std::uniform_real_distribution<> values(0, noise);
      for (std::size_t k = 0; k < frame.raw.samples(); ++k) {
        frame.raw.dn.data()[k] = static_cast<std::uint16_t>(values(random));
      }
    }
    const RawFrame read = round_trip(frame, {.compression = isp::DngCompression::lossless});
    ASSERT_EQ(read.raw.layout, layout);
    const bool same =
        floats ? test::same_bits(read.raw.dn_float, frame.raw.dn_float) : test::same_bits(read.raw.dn, frame.raw.dn);
    EXPECT_TRUE(same) << "seed " << seed << ", frame " << i << ": " << width << " x " << height;
    EXPECT_TRUE(layout != SensorLayout::bayer || read.raw.phase == frame.raw.phase);
    EXPECT_EQ(read.raw.white_dn, frame.raw.white_dn);
  }
}

TEST(DngRoundTrip, FloatingPointSamplesOfAnyLayoutAndSizeAreBitExact) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 30}, {22, 22}, {701, 1503}}) {
    for (const SensorLayout layout : {SensorLayout::bayer, SensorLayout::monochrome, SensorLayout::linear_rgb}) {
      RawFrame frame = plain_frame(width, height, layout);
      test::make_floats(frame.raw, 1.0 / 65535);  // not exact, so that all bits are used
      frame.raw.white_dn.fill(1);
      frame.raw.dn_float.data()[0] = -1e-30F;
      frame.raw.dn_float.data()[frame.raw.samples() - 1] = 16'777'216.0F;
      frame.noise = NoiseProfile{{1e-9, 1e-9, 1e-9}, {1e-17, 1e-17, 1e-17}};
      const RawFrame read = round_trip(frame);
      EXPECT_EQ(read.raw.layout, layout);
      EXPECT_TRUE(test::same_bits(read.raw.dn_float, frame.raw.dn_float)) << width << " x " << height;
      EXPECT_EQ(read.raw.white_dn, frame.raw.white_dn);
      EXPECT_EQ(read.noise->scale, frame.noise->scale);
      EXPECT_EQ(read.noise->offset, frame.noise->offset);
      EXPECT_NEAR(read.raw.black_tag->pattern_dn[0], 256.0 / 65535, rational_tolerance);
    }
  }
}

TEST(DngRoundTrip, BordersMasksAndCropKeepTheirPlacesAndThePhaseItsCorner) {
  RawFrame frame = plain_frame(40, 36, SensorLayout::bayer, BayerPhase::gbrg);
  frame.raw.active = {5, 3, 33, 31};
  frame.raw.default_crop = {2, 1, 30, 29};
  frame.raw.masked = {{0, 3, 4, 31}, {5, 0, 33, 2}};
  frame.raw.masked_is_stated = true;
  const RawFrame stated = round_trip(frame);
  EXPECT_EQ(stated.raw.active, frame.raw.active);
  EXPECT_EQ(stated.raw.default_crop, frame.raw.default_crop);
  EXPECT_EQ(stated.raw.masked, frame.raw.masked);
  EXPECT_TRUE(stated.raw.masked_is_stated);
  EXPECT_EQ(stated.raw.phase, BayerPhase::gbrg);

  frame.raw.masked_is_stated = false;  // taken to be masked, and not written as if the source had said so
  EXPECT_FALSE(round_trip(frame).raw.masked_is_stated);
}

// 90,000 blocks: more bytes than a count of 16 bits states.
TEST(DngRoundTrip, TheNoiseRatioKeepsItsBlocksAndPowersOfTwo) {
  RawFrame frame = plain_frame(610, 607);
  frame.raw.active = {4, 6, 600, 600};
  frame.raw.default_crop = {0, 0, 600, 600};
  NoiseRatio ratio{.block_px = 2, .ratio = Plane<float>(300, 300)};
  for (std::size_t i = 0; i < ratio.ratio.size(); ++i) {
    ratio.ratio.data()[i] = std::exp2(static_cast<float>(i * i % 15) - 6);
  }
  const Plane<float> expected = ratio.ratio.clone();
  frame.noise_ratio = std::make_shared<const NoiseRatio>(std::move(ratio));
  const RawFrame read = round_trip(frame);
  ASSERT_NE(read.noise_ratio, nullptr);
  EXPECT_EQ(read.noise_ratio->block_px, 2);
  EXPECT_TRUE(test::same_bits(read.noise_ratio->ratio, expected));
  EXPECT_TRUE(test::same_bits(read.raw.dn, frame.raw.dn));
  frame.noise_ratio = nullptr;
  EXPECT_EQ(round_trip(frame).noise_ratio, nullptr);
}

TEST(DngRoundTrip, BlackLevelsKeepFractionsSitesAndDeltas) {
  RawFrame frame = plain_frame(30, 24);
  frame.raw.black_tag = BlackLevel{.rows = 2, .columns = 2, .pattern_dn = {255.75, 1.0 / 3, 0, 1024.1}};
  frame.raw.active = {2, 0, 28, 24};
  frame.raw.default_crop = {0, 0, 28, 24};
  for (int i = 0; i < 28; ++i) frame.raw.black_tag->column_dn.push_back(0.37 * (i - 9));
  for (int i = 0; i < 24; ++i) frame.raw.black_tag->row_dn.push_back(-0.011 * i);
  const RawFrame read = round_trip(frame);
  ASSERT_TRUE(read.raw.black_tag);
  EXPECT_EQ(read.raw.black_tag->rows, 2);
  EXPECT_EQ(read.raw.black_tag->columns, 2);
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 28; ++x) {
      EXPECT_NEAR(read.raw.black_tag->at(x, y), frame.raw.black_tag->at(x, y), 1100 * rational_tolerance);  // DN
    }
  }
}

TEST(DngRoundTrip, EachColourOfLinearRgbHasItsOwnLevels) {
  RawFrame frame = plain_frame(24, 24, SensorLayout::linear_rgb);
  frame.raw.black_tag->pattern_dn = {10, 20.5, 30};
  frame.raw.white_dn = {60000, 61000, 62000};
  const RawFrame read = round_trip(frame);
  EXPECT_EQ(read.raw.black_tag->pattern_dn, frame.raw.black_tag->pattern_dn);
  EXPECT_EQ(read.raw.white_dn, frame.raw.white_dn);
}

TEST(DngRoundTrip, AnUnknownBlackLevelStaysUnknown) {
  RawFrame frame = plain_frame(24, 24);
  frame.raw.black_tag.reset();
  EXPECT_FALSE(round_trip(frame).raw.black_tag);
}

TEST(DngRoundTrip, WhiteLevelsAreWholeAndRounded) {
  RawFrame frame = plain_frame(24, 24);
  frame.raw.white_dn = {16000.4, 16000.4, 16000.4};
  EXPECT_EQ(round_trip(frame).raw.white_dn, (std::array<double, 3>{16000, 16000, 16000}));
}

TEST(DngRoundTrip, BothCalibrationsTheNeutralAndTheNoiseComeBack) {
  RawFrame frame = plain_frame(24, 24);
  CameraColour& colour = frame.colour;
  ColourCalibration lamp;
  lamp.cct_k = 2856;
  lamp.xyz_to_camera = {{{0.9123457, -0.3, -1.0 / 3}, {-0.5, 1.3, 0.2}, {-0.1, 1e-3, 0.6}}};
  lamp.camera_calibration = diagonal3({1.01, 1, 0.98});
  lamp.forward = Matrix3{{{0.7, 0.2, 0.0642}, {0.3, 0.8, -0.1}, {0, -0.1, 0.9251}}};
  colour.calibrations.insert(colour.calibrations.begin(), lamp);
  colour.analog_balance = {1.5, 1, 0.75};
  colour.as_shot_neutral = Vector3{0.4712345, 1, 0.61};
  frame.noise = NoiseProfile{{1e-4, 2e-4, 3e-4}, {1e-7, -2e-7, 1.0 / 3e7}};
  const RawFrame read = round_trip(frame);
  ASSERT_EQ(read.colour.calibrations.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    const ColourCalibration &found = read.colour.calibrations[i], &expected = colour.calibrations[i];
    EXPECT_EQ(found.cct_k, expected.cct_k);
    expect_near(found.xyz_to_camera, expected.xyz_to_camera);
    expect_near(found.camera_calibration, expected.camera_calibration);
    ASSERT_EQ(found.forward.has_value(), expected.forward.has_value());
    if (found.forward) expect_near(*found.forward, *expected.forward);
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(read.colour.analog_balance[i], colour.analog_balance[i], rational_tolerance * 1.5);
    EXPECT_NEAR((*read.colour.as_shot_neutral)[i], (*colour.as_shot_neutral)[i], rational_tolerance);
    EXPECT_EQ(read.noise->scale[i], frame.noise->scale[i]);  // doubles
    EXPECT_EQ(read.noise->offset[i], frame.noise->offset[i]);
  }
  EXPECT_FALSE(read.colour.as_shot_white_xy);
}

TEST(DngRoundTrip, AWhiteIsWrittenWhereThereIsNoNeutral) {
  RawFrame frame = plain_frame(24, 24);
  frame.colour.as_shot_neutral.reset();
  frame.colour.as_shot_white_xy = {0.4476, 0.4074};
  const RawFrame read = round_trip(frame);
  EXPECT_FALSE(read.colour.as_shot_neutral);
  EXPECT_NEAR((*read.colour.as_shot_white_xy)[0], 0.4476, rational_tolerance);
  EXPECT_NEAR((*read.colour.as_shot_white_xy)[1], 0.4074, rational_tolerance);
}

TEST(DngRoundTrip, MonochromeKeepsItsNoiseProfile) {
  RawFrame frame = plain_frame(24, 24, SensorLayout::monochrome);
  frame.noise = NoiseProfile{{1e-4, 1e-4, 1e-4}, {1e-7, 1e-7, 1e-7}};
  EXPECT_EQ(round_trip(frame).noise->scale, frame.noise->scale);
}

TEST(DngRoundTrip, AFrameWithoutColourOrNoiseGetsNone) {
  RawFrame frame = plain_frame(24, 24);
  frame.colour = {};
  const RawFrame read = round_trip(frame);
  EXPECT_TRUE(read.colour.calibrations.empty());
  EXPECT_FALSE(read.colour.as_shot_neutral || read.colour.as_shot_white_xy || read.noise);
}

TEST(DngRoundTrip, TheShotAndEveryOrientationComeBack) {
  RawFrame frame = plain_frame(24, 24);
  FrameInfo& info = frame.raw.info;
  info.software = "other";
  info.date_time = "2024:02:03 04:05:06";
  info.exposure_s = 1.0 / 30;
  info.iso = 409600;
  info.f_number = 1.8;
  info.focal_length_mm = 35.5;
  info.temperature_c = -12.25;
  for (int orientation = 1; orientation <= 8; ++orientation) {
    info.orientation = static_cast<Orientation>(orientation);
    const FrameInfo read = round_trip(frame, {.software = "lowlux 9"}).raw.info;
    EXPECT_EQ(read.orientation, info.orientation);
    EXPECT_EQ(read.make, "Maker");
    EXPECT_EQ(read.model, "Model 1");
    EXPECT_EQ(read.software, "lowlux 9");
    EXPECT_EQ(read.date_time, info.date_time);
    EXPECT_NEAR(read.exposure_s.value_or(0), 1.0 / 30, rational_tolerance / 30);
    EXPECT_EQ(read.iso, 409600);
    EXPECT_NEAR(read.f_number.value_or(0), 1.8, 1.8 * rational_tolerance);
    EXPECT_EQ(read.focal_length_mm, 35.5);
    EXPECT_EQ(read.temperature_c, -12.25);
  }
}

TEST(DngRoundTrip, WhatIsUnknownOfTheShotStaysUnknown) {
  const FrameInfo read = round_trip(plain_frame(24, 24)).raw.info;
  EXPECT_FALSE(read.exposure_s || read.iso || read.f_number || read.focal_length_mm || read.temperature_c);
  EXPECT_EQ(read.date_time, "");
}

TEST(DngRoundTrip, CorrectionsNotYetAppliedStayAskedFor) {
  RawFrame frame = plain_frame(40, 36);
  frame.raw.active = {5, 3, 33, 31};
  frame.raw.default_crop = {0, 0, 33, 31};
  GainMap map;
  map.top = 1, map.bottom = 31, map.right = 33, map.row_pitch = 2, map.column_pitch = 2;
  map.points_v = 2, map.points_h = 3, map.spacing_h = 0.5, map.origin_v = 0.125;
  map.gain = {1, 1.5F, 2, 1.25F, 1, 1.0F / 3};
  frame.corrections.gain_maps = {map};
  frame.corrections.radial_gains = {{{0.1, -0.2, 0.3, 1.0 / 3, 1e-9}, 0.25, 0.75}};
  frame.corrections.defects = {{0, 0, 1, 1}, {7, 9, 3, 2}, {32, 30, 1, 1}};
  const RawCorrections read = round_trip(frame).corrections;
  ASSERT_EQ(read.gain_maps.size(), 1u);
  const GainMap& found = read.gain_maps[0];
  EXPECT_EQ(found.gain, map.gain);
  EXPECT_EQ(std::tuple(found.top, found.left, found.bottom, found.right, found.row_pitch, found.column_pitch),
            std::tuple(1, 0, 31, 33, 2, 2));
  EXPECT_EQ(std::tuple(found.points_v, found.points_h, found.spacing_v, found.spacing_h, found.origin_v),
            std::tuple(2, 3, 1.0, 0.5, 0.125));
  ASSERT_EQ(read.radial_gains.size(), 1u);
  EXPECT_EQ(std::memcmp(&read.radial_gains[0], frame.corrections.radial_gains.data(), sizeof(RadialGain)), 0);
  ASSERT_EQ(read.defects.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const DefectRect &a = read.defects[i], &b = frame.corrections.defects[i];
    EXPECT_EQ(std::tuple(a.x, a.y, a.width, a.height), std::tuple(b.x, b.y, b.width, b.height));
  }
}

/// A second pass changes nothing: what was rounded stays where it is.
TEST(DngRoundTrip, ReadingAndWritingAgainIsTheIdentity) {
  RawFrame frame = plain_frame(24, 24);
  frame.colour.as_shot_neutral = Vector3{0.333, 1, 0.777};
  const RawFrame once = round_trip(frame);
  const RawFrame twice = round_trip(once);
  EXPECT_EQ(once.colour.as_shot_neutral, twice.colour.as_shot_neutral);
  EXPECT_EQ(once.colour.calibrations[0].xyz_to_camera, twice.colour.calibrations[0].xyz_to_camera);
}

TEST(DngRoundTrip, TheRealFileKeepsItsSamplesLevelsAndColour) {
  const auto frame = capture::read_raw(LOWLUX_TESTDATA "/raws/canon_kissx4_ml_colorchart.dng");
  ASSERT_TRUE(frame) << frame.error().message;
  const RawFrame read = round_trip(*frame);
  EXPECT_TRUE(test::same_bits(read.raw.dn, frame->raw.dn));
  EXPECT_EQ(read.raw.active, frame->raw.active);
  EXPECT_EQ(read.raw.black_tag->pattern_dn, frame->raw.black_tag->pattern_dn);
  EXPECT_EQ(read.raw.white_dn, frame->raw.white_dn);
  ASSERT_EQ(read.colour.calibrations.size(), frame->colour.calibrations.size());
  for (std::size_t i = 0; i < read.colour.calibrations.size(); ++i) {
    EXPECT_EQ(read.colour.calibrations[i].cct_k, frame->colour.calibrations[i].cct_k);
    expect_near(read.colour.calibrations[i].xyz_to_camera, frame->colour.calibrations[i].xyz_to_camera);
  }
}

}  // namespace
}  // namespace lowlux
