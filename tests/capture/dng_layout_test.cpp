#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>

#include "tests/capture/read_built.h"

namespace lowlux::test {
namespace {

using Case = std::tuple<int, int, DngStorage>;  // phase, bits, storage

class DngRoundTrip : public testing::TestWithParam<Case> {};

TEST_P(DngRoundTrip, GivesBackEverySampleAndThePhase) {
  const auto [phase, bits, storage] = GetParam();
  DngBuilder dng;
  dng.width = 38, dng.height = 26;
  dng.phase = static_cast<BayerPhase>(phase);
  dng.bits = bits;
  dng.storage = storage;
  const RawFrame frame = read_built(dng);
  EXPECT_EQ(frame.raw.layout, SensorLayout::bayer);
  EXPECT_EQ(frame.raw.phase, dng.phase);
  EXPECT_EQ(samples_of(frame), ramp(dng));
  EXPECT_EQ(frame.raw.white_dn[0], (1 << bits) - 1);
  EXPECT_EQ(frame.raw.active, (Rect{0, 0, 38, 26}));
}

INSTANTIATE_TEST_SUITE_P(PhasesBitsAndStorage, DngRoundTrip,
                         testing::Combine(testing::Values(0, 1, 2, 3), testing::Values(8, 10, 12, 14, 16),
                                          testing::Values(DngStorage::uncompressed, DngStorage::lossless_jpeg,
                                                          DngStorage::tiled_lossless_jpeg)));

TEST(DngLayout, OddBitCountsAreUnpackedToo) {
  for (const int bits : {9, 11, 13, 15}) {
    DngBuilder dng;
    dng.width = 29, dng.height = 23, dng.bits = bits;
    EXPECT_EQ(samples_of(read_built(dng)), ramp(dng)) << bits << " bits";
  }
}

TEST(DngLayout, OneJpegComponentPerRowIsReadLikeTwo) {
  DngBuilder dng;
  dng.width = 25, dng.height = 23, dng.bits = 12;
  dng.storage = DngStorage::lossless_jpeg;
  dng.jpeg_components = 1;
  EXPECT_EQ(samples_of(read_built(dng)), ramp(dng));
}

TEST(DngLayout, BigEndianFilesAreReadLikeLittleEndianOnes) {
  for (const int bits : {12, 16}) {
    DngBuilder dng;
    dng.big_endian = true;
    dng.bits = bits;
    dng.set(50714, Tag::rationals(TagType::rational, {{25, 2}}));
    const RawFrame frame = read_built(dng);
    EXPECT_EQ(samples_of(frame), ramp(dng));
    ASSERT_TRUE(frame.raw.black_tag);
    EXPECT_EQ(frame.raw.black_tag->at(0, 0), 12.5);
  }
}

TEST(DngLayout, TheRawImageIsFoundInASubIfdBehindAPreview) {
  DngBuilder dng;
  dng.raw_in_sub_ifd = true;
  dng.width = 40, dng.height = 24;
  dng.phase = BayerPhase::gbrg;
  dng.set(274, Tag::numbers(TagType::u16, {6}));
  const RawFrame frame = read_built(dng);
  EXPECT_EQ(samples_of(frame), ramp(dng));
  EXPECT_EQ(frame.raw.phase, BayerPhase::gbrg);
  EXPECT_EQ(frame.raw.info.orientation, Orientation::rotate_90);
  EXPECT_EQ(frame.colour.calibrations.size(), 1u);
}

TEST(DngLayout, OddActiveAreasKeepOriginSizeAndThePhaseOfTheirCorner) {
  for (int phase = 0; phase < 4; ++phase) {
    DngBuilder dng;
    dng.width = 33, dng.height = 29;
    dng.phase = static_cast<BayerPhase>(phase);
    dng.set(50829, Tag::numbers(TagType::u32, {3, 5, 28, 32}));
    const RawFrame frame = read_built(dng);
    EXPECT_EQ(frame.raw.active, (Rect{5, 3, 27, 25}));
    EXPECT_EQ(frame.raw.phase, dng.phase);
    EXPECT_EQ(frame.raw.dn.width(), 33);
    EXPECT_EQ(frame.raw.dn.height(), 29);
    EXPECT_EQ(samples_of(frame), ramp(dng));
    EXPECT_EQ(frame.raw.default_crop, (Rect{0, 0, 27, 25}));
  }
}

TEST(DngLayout, BordersAreMaskedOnlyByAssumptionUnlessTheFileSaysSo) {
  DngBuilder dng;
  dng.width = 40, dng.height = 36;
  dng.set(50829, Tag::numbers(TagType::u32, {2, 4, 35, 39}));
  const RawFrame assumed = read_built(dng);
  EXPECT_FALSE(assumed.raw.masked_is_stated);
  EXPECT_EQ(assumed.raw.masked, (std::vector<Rect>{{0, 0, 4, 36}, {39, 0, 1, 36}, {4, 0, 35, 2}, {4, 35, 35, 1}}));
  int pixels = 0;
  for (const Rect& r : assumed.raw.masked) pixels += r.width * r.height;
  EXPECT_EQ(pixels, 40 * 36 - 35 * 33);

  dng.set(50830, Tag::numbers(TagType::u32, {2, 0, 35, 3, 0, 4, 1, 39}));
  const RawFrame stated = read_built(dng);
  EXPECT_TRUE(stated.raw.masked_is_stated);
  EXPECT_EQ(stated.raw.masked, (std::vector<Rect>{{0, 2, 3, 33}, {4, 0, 35, 1}}));
}

TEST(DngLayout, AFrameWithoutBordersHasNoMaskedPixels) {
  const RawFrame frame = read_built(DngBuilder{});
  EXPECT_TRUE(frame.raw.masked.empty());
  EXPECT_FALSE(frame.raw.masked_is_stated);
}

TEST(DngLayout, TheDefaultCropCountsFromTheActiveArea) {
  DngBuilder dng;
  dng.width = 40, dng.height = 36;
  dng.set(50829, Tag::numbers(TagType::u32, {2, 4, 36, 40}));
  dng.set(50719, Tag::numbers(TagType::rational, {1, 3}));
  dng.set(50720, Tag::numbers(TagType::u16, {12, 9}));
  EXPECT_EQ(read_built(dng).raw.default_crop, (Rect{1, 3, 12, 9}));

  dng.set(50720, Tag::numbers(TagType::u16, {100, 9}));
  const RawFrame frame = read_built(dng);
  EXPECT_EQ(frame.raw.default_crop, (Rect{1, 3, 35, 9}));
  ASSERT_EQ(frame.warnings.size(), 1u);
  EXPECT_NE(frame.warnings[0].find("DefaultCropSize"), std::string::npos);
}

TEST(DngLayout, EveryOrientationIsKept) {
  for (int orientation = 1; orientation <= 8; ++orientation) {
    DngBuilder dng;
    dng.set(274, Tag::numbers(TagType::u16, {static_cast<double>(orientation)}));
    EXPECT_EQ(static_cast<int>(read_built(dng).raw.info.orientation), orientation);
  }
}

TEST(DngLayout, MonochromeHasOneSampleAndNoColour) {
  for (const DngStorage storage : {DngStorage::uncompressed, DngStorage::lossless_jpeg}) {
    DngBuilder dng;
    dng.width = 38, dng.height = 30, dng.bits = 14;
    dng.monochrome = true;
    dng.storage = storage;
    const RawFrame frame = read_built(dng);
    EXPECT_EQ(frame.raw.layout, SensorLayout::monochrome);
    EXPECT_EQ(samples_of(frame), ramp(dng));
    EXPECT_EQ(frame.raw.white_dn, (std::array<double, 3>{16383, 16383, 16383}));
    EXPECT_TRUE(frame.colour.calibrations.empty());
  }
}

TEST(DngLayout, LinearRawKeepsThreeInterleavedSamples) {
  for (const DngStorage storage :
       {DngStorage::uncompressed, DngStorage::lossless_jpeg, DngStorage::tiled_lossless_jpeg}) {
    DngBuilder dng;
    dng.width = 37, dng.height = 31, dng.samples = 3;
    dng.storage = storage;
    const RawFrame frame = read_built(dng);
    EXPECT_EQ(frame.raw.layout, SensorLayout::linear_rgb);
    EXPECT_EQ(frame.raw.dn.width(), 111);
    EXPECT_EQ(frame.raw.dn.height(), 31);
    EXPECT_EQ(samples_of(frame), ramp(dng));
    EXPECT_EQ(frame.colour.calibrations.size(), 1u);
  }
}

TEST(DngLayout, AdjacentStripsAreOnePiece) {
  DngBuilder dng;
  dng.width = 31, dng.height = 30, dng.bits = 10;
  dng.rows_per_strip = 4;
  EXPECT_EQ(samples_of(read_built(dng)), ramp(dng));
}

TEST(DngLayout, StripsThatTheDecoderWouldMisplaceAreReadInTheirPlaces) {
  DngBuilder swapped;
  swapped.rows_per_strip = 12;
  const auto offset = static_cast<double>(swapped.build().size() - 1152);  // 24 x 24 samples of 16 bits
  swapped.set(273, Tag::numbers(TagType::u32, {offset + 576, offset}));
  auto expected = ramp(swapped);
  std::rotate(expected.begin(), expected.begin() + 288, expected.end());
  EXPECT_EQ(samples_of(read_built(swapped)), expected);

  DngBuilder strips;
  strips.storage = DngStorage::lossless_jpeg;
  strips.rows_per_strip = 12;
  strips.set(273, Tag::numbers(TagType::u32, {8, 8}));
  strips.set(279, Tag::numbers(TagType::u32, {8, 8}));
  EXPECT_TRUE(has(refused(strips), "overlap"));
}

TEST(DngLayout, KindsThatAreNotDevelopedAreNamed) {
  const auto with = [](std::uint16_t id, const Tag& tag) {
    DngBuilder dng;
    dng.set(id, tag);
    return refused(dng);
  };
  DngBuilder x_trans;
  x_trans.set(33421, Tag::numbers(TagType::u16, {6, 6}));
  x_trans.set(33422, Tag::numbers(TagType::byte, std::vector<double>(36, 1)));
  EXPECT_TRUE(has(refused(x_trans), "not X-Trans"));
  EXPECT_EQ(refused(x_trans).code, ErrorCode::unsupported);
  EXPECT_TRUE(has(with(33422, Tag::numbers(TagType::byte, {0, 1, 2, 1})), "Bayer"));
  EXPECT_TRUE(has(with(50710, Tag::numbers(TagType::byte, {3, 4, 5})), "colours other than R, G, B"));
  EXPECT_TRUE(has(with(50710, Tag::numbers(TagType::byte, {0, 1, 2, 6})), "colours other than R, G, B"));
  EXPECT_TRUE(has(with(50711, Tag::numbers(TagType::u16, {2})), "not rectangular"));
  EXPECT_TRUE(has(with(258, Tag::numbers(TagType::u16, {32})), "32 bits"));
  EXPECT_TRUE(has(with(259, Tag::numbers(TagType::u16, {9})), "VC-5"));
  EXPECT_TRUE(has(with(259, Tag::numbers(TagType::u16, {52546})), "JPEG XL"));  // decoded, if it were one
  EXPECT_TRUE(has(with(259, Tag::numbers(TagType::u16, {34892})), "lossy JPEG is supported for LinearRaw images"));
  EXPECT_TRUE(has(with(259, Tag::numbers(TagType::u16, {777})), "compression 777"));
}

TEST(DngLayout, SamplesThatAreNotUnsignedIntegersOrFloatsAreRefused) {
  for (const double format : {0, 2, 5, 6}) {
    DngBuilder dng;
    EXPECT_TRUE(has(refused(dng.set(339, Tag::numbers(TagType::u16, {format}))), "signed or complex numbers"));
  }
  DngBuilder mixed;
  mixed.samples = 3;
  EXPECT_TRUE(has(refused(mixed.set(339, Tag::numbers(TagType::u16, {1, 1, 2}))), "mixed formats"));
  for (const double format : {1, 4}) {
    DngBuilder dng;
    dng.set(339, Tag::numbers(TagType::u16, {format}));
    EXPECT_EQ(samples_of(read_built(dng)), ramp(dng));
  }
}

TEST(DngLayout, AFileForReadersOfAnUnknownVersionIsWarnedOf) {
  for (const auto& [major, minor] : {std::pair{1.0, 0.0}, {1.0, 7.0}, {1.0, 8.0}, {2.0, 0.0}}) {
    DngBuilder dng;
    dng.set(50707, Tag::numbers(TagType::byte, {major, minor, 1, 0}));
    if (major == 1 && minor <= 7) {
      EXPECT_TRUE(read_built(dng).warnings.empty());
    } else {
      EXPECT_EQ(warned(dng).find("the file requires a reader of DNG"), 0U);
    }
  }
}

TEST(DngLayout, ReversedBytesAreRefusedWhereTheOrderOfBitsCounts) {
  for (const auto storage : {DngStorage::uncompressed, DngStorage::lossless_jpeg}) {
    DngBuilder dng;
    dng.bits = 12;
    dng.storage = storage;
    dng.set(266, Tag::numbers(TagType::u16, {1}));
    EXPECT_EQ(samples_of(read_built(dng)), ramp(dng));
    dng.set(266, Tag::numbers(TagType::u16, {2}));
    if (storage == DngStorage::uncompressed) {
      EXPECT_TRUE(has(refused(dng), "lowest bit of each byte first (FillOrder 2)"));
    } else {
      EXPECT_EQ(samples_of(read_built(dng)), ramp(dng));
    }
  }
}

TEST(DngLayout, ALinearizationTableIsAppliedBeforeTheLevelsCount) {
  DngBuilder dng;
  dng.bits = 8;
  std::vector<double> table(256);
  for (int i = 0; i < 256; ++i) table[i] = i * i;
  dng.set(50712, Tag::numbers(TagType::u16, table));
  dng.set(50717, Tag::numbers(TagType::u16, {65025}));
  const RawFrame frame = read_built(dng);
  const auto stored = ramp(dng), linear = samples_of(frame);
  ASSERT_EQ(linear.size(), stored.size());
  for (std::size_t i = 0; i < stored.size(); ++i) EXPECT_EQ(linear[i], stored[i] * stored[i]);
  EXPECT_EQ(frame.raw.white_dn[1], 65025);
}

TEST(DngLayout, ALinearizationTableShorterThanTheRangeHoldsItsLastValue) {
  DngBuilder dng;
  dng.bits = 12;
  dng.set(50712, Tag::numbers(TagType::u16, {0, 10, 20, 40}));
  dng.set(50714, Tag::numbers(TagType::u16, {1}));
  dng.set(50717, Tag::numbers(TagType::u16, {40}));
  dng.pixels = std::vector<std::uint16_t>(std::size_t{24} * 24, 3);
  dng.pixels[0] = 1, dng.pixels[1] = 2, dng.pixels[2] = 4095;
  const auto linear = samples_of(read_built(dng));
  EXPECT_EQ(linear[0], 10);
  EXPECT_EQ(linear[1], 20);
  EXPECT_EQ(linear[2], 40);
  EXPECT_EQ(linear[3], 40);
}

}  // namespace
}  // namespace lowlux::test
