#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/source_tags.h"
#include "tests/capture/read_built.h"

namespace lowlux::test {
namespace {

TEST(DngLevels, FractionsOfTheBlackLevelAreKept) {
  DngBuilder dng;
  dng.bits = 8;
  dng.set(50714, Tag::rationals(TagType::rational, {{25, 2}}));
  const RawFrame frame = read_built(dng);
  ASSERT_TRUE(frame.raw.black_tag);
  EXPECT_EQ(frame.raw.black_tag->at(3, 5), 12.5);
}

TEST(DngLevels, ABlackLevelThatIsNotStatedIsZeroOfLinearRawAndAbsentOfMosaics) {
  for (const int samples : {1, 3}) {
    DngBuilder dng;
    dng.width = dng.height = 64;
    dng.samples = samples;
    dng.remove(50714);
    const RawFrame frame = read_built(dng);
    const std::optional<BlackLevel>& tag = frame.raw.black_tag;
    ASSERT_EQ(tag.has_value(), samples == 3);
    EXPECT_EQ(frame.raw.is_black_zero_by_default, samples == 1);
    if (tag) {
      EXPECT_EQ(tag->at(1, 2, 2), 0);
    }
  }
}

TEST(DngLevels, ACropThatTheCameraWasSetToIsWarnedOfAndPassedOn) {
  const auto with = [](double orientation, const std::vector<double>& crop) {
    DngBuilder dng;
    dng.set(274, Tag::numbers(TagType::u16, {orientation}));
    return read_built(dng.set(51125, Tag::numbers(TagType::rational, crop)));
  };
  // Where an area across the stored image, and one at its upper left corner, are in the upright image.
  const char* const crops[] = {"0%,12.5%,100%,75%", "0%,12.5%,100%,75%", "0%,12.5%,100%,75%", "0%,12.5%,100%,75%",
                               "12.5%,0%,75%,100%", "12.5%,0%,75%,100%", "12.5%,0%,75%,100%", "12.5%,0%,75%,100%"};
  const char* const corners[] = {"0%,0%,25%,50%", "75%,0%,25%,50%", "75%,50%,25%,50%", "0%,50%,25%,50%",
                                 "0%,0%,50%,25%", "50%,0%,50%,25%", "50%,75%,50%,25%", "0%,75%,50%,25%"};
  for (int i = 0; i < 8; ++i) {
    const RawFrame wide = with(i + 1, {0.125, 0, 0.875, 1}), corner = with(i + 1, {0, 0, 0.5, 0.25});
    ASSERT_EQ(wide.warnings.size(), 1u);
    EXPECT_NE(
        wide.warnings[0].find(std::string("DefaultUserCrop is not applied: develop --crop ") + crops[i] + " keeps"),
        std::string::npos)
        << wide.warnings[0];
    EXPECT_NE(corner.warnings.at(0).find(corners[i]), std::string::npos) << corner.warnings[0] << i + 1;
    ASSERT_TRUE(wide.source_tags);
    const auto& tags = wide.source_tags->main;
    EXPECT_TRUE(std::any_of(tags.begin(), tags.end(), [](const SourceTag& tag) { return tag.id == 51125; }));
  }
  for (const std::vector<double>& none : {std::vector<double>{0, 0, 1, 1}, {0.5, 0, 0.5, 1}, {0, 0, 2, 1}, {0, 1}}) {
    EXPECT_TRUE(with(1, none).warnings.empty());
  }
}

TEST(DngLevels, TablesOfTheProfileThatAreNotAppliedAreWarnedOf) {
  for (const std::uint16_t tag : {52525, 52543, 52544}) {
    DngBuilder dng;
    EXPECT_TRUE(read_built(dng).warnings.empty());
    dng.set(tag, Tag::opaque(std::vector<std::byte>(98)));
    const std::vector<std::string> warnings = read_built(dng).warnings;
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_EQ(warnings[0].rfind(tag == 52543 ? "RGBTables" : "ProfileGainTableMap", 0), 0U) << warnings[0];
  }
}

TEST(DngLevels, AStatedBlackLevelOfZeroIsPresent) {
  DngBuilder dng;
  dng.set(50714, Tag::numbers(TagType::u16, {0}));
  const RawFrame frame = read_built(dng);
  ASSERT_TRUE(frame.raw.black_tag);
  EXPECT_EQ(frame.raw.black_tag->at(0, 0), 0);
}

struct Pattern {
  int rows, columns;
};
class BlackPattern : public testing::TestWithParam<Pattern> {};

TEST_P(BlackPattern, RepeatsFromTheCornerOfTheActiveArea) {
  const auto [rows, columns] = GetParam();
  DngBuilder dng;
  dng.width = 31, dng.height = 27;
  dng.set(50829, Tag::numbers(TagType::u32, {3, 1, 26, 30}));
  dng.set(50713, Tag::numbers(TagType::u16, {static_cast<double>(rows), static_cast<double>(columns)}));
  std::vector<double> levels(static_cast<std::size_t>(rows) * columns);
  std::iota(levels.begin(), levels.end(), 64);
  dng.set(50714, Tag::numbers(TagType::u16, levels));
  const RawFrame frame = read_built(dng);
  ASSERT_TRUE(frame.raw.black_tag);
  for (int y = 0; y < 23; ++y) {
    for (int x = 0; x < 29; ++x) {
      EXPECT_EQ(frame.raw.black_tag->at(x, y), 64 + (y % rows) * columns + x % columns);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, BlackPattern,
                         testing::Values(Pattern{1, 1}, Pattern{2, 2}, Pattern{1, 2}, Pattern{2, 1}, Pattern{4, 4},
                                         Pattern{3, 5}));

/// DNG's default is a pattern of 1 x 1, which leaves the other values without a pixel.
TEST(DngLevels, ValuesForTheSitesOfTheMosaicWithoutAPatternAreUsedWithAWarning) {
  DngBuilder dng;
  dng.width = dng.height = 31;
  dng.set(50829, Tag::numbers(TagType::u32, {1, 3, 31, 31}));
  dng.set(50714, Tag::numbers(TagType::u16, {60, 61, 62, 63}));
  const RawFrame frame = read_built(dng);
  ASSERT_TRUE(frame.raw.black_tag);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) EXPECT_EQ(frame.raw.black_tag->at(x, y), 60 + y % 2 * 2 + x % 2);
  }
  EXPECT_EQ(warned(dng).find("BlackLevel has 4 values, but BlackLevelRepeatDim is missing"), 0U) << warned(dng);
  dng.set(50713, Tag::numbers(TagType::u16, {2, 2}));
  EXPECT_TRUE(read_built(dng).warnings.empty());
  dng.set(50713, Tag::numbers(TagType::u16, {1, 1}));
  EXPECT_TRUE(has(refused(dng), "BlackLevel has 4 values, its pattern needs 1"));
  DngBuilder other;
  other.set(50714, Tag::numbers(TagType::u16, {60, 61, 62}));
  EXPECT_TRUE(has(refused(other), "BlackLevel has 3 values, its pattern needs 1"));
  other.monochrome = true;
  other.set(50714, Tag::numbers(TagType::u16, {60, 61, 62, 63}));
  EXPECT_TRUE(has(refused(other), "BlackLevel has 4 values, its pattern needs 1"));
}

TEST(DngLevels, DeltasAddToThePatternAtEachActiveColumnAndRow) {
  DngBuilder dng;
  dng.width = 28, dng.height = 27;
  dng.set(50829, Tag::numbers(TagType::u32, {1, 2, 24, 28}));
  std::vector<double> columns(26, 0.0), rows(23, 0.0);
  columns[1] = 0.5, columns[2] = -1, columns[25] = 2;
  rows[0] = 0.25, rows[1] = -0.25, rows[2] = 3;
  dng.set(50715, Tag::numbers(TagType::srational, columns));
  dng.set(50716, Tag::numbers(TagType::srational, rows));
  const RawFrame frame = read_built(dng);
  ASSERT_TRUE(frame.raw.black_tag);
  EXPECT_EQ(frame.raw.black_tag->at(0, 0), 64.25);
  EXPECT_EQ(frame.raw.black_tag->at(1, 1), 64.25);
  EXPECT_EQ(frame.raw.black_tag->at(2, 2), 66);
  EXPECT_EQ(frame.raw.black_tag->at(25, 22), 66);
}

TEST(DngLevels, DeltasOfTheWrongCountAreRefused) {
  DngBuilder dng;
  dng.set(50715, Tag::numbers(TagType::srational, {0, 0.5}));
  EXPECT_TRUE(has(refused(dng), "BlackLevelDeltaH has 2 values, expected 24 values"));
}

TEST(DngLevels, LinearRawHasBlackAndWhitePerChannel) {
  DngBuilder dng;
  dng.samples = 3;
  dng.set(50714, Tag::numbers(TagType::u16, {10, 20, 30}));
  dng.set(50717, Tag::numbers(TagType::u16, {1000, 2000, 3000}));
  const RawFrame frame = read_built(dng);
  ASSERT_TRUE(frame.raw.black_tag);
  EXPECT_EQ(frame.raw.black_tag->samples, 3);
  EXPECT_EQ(frame.raw.black_tag->at(4, 4, 0), 10);
  EXPECT_EQ(frame.raw.black_tag->at(4, 4, 2), 30);
  EXPECT_EQ(frame.raw.white_dn, (std::array<double, 3>{1000, 2000, 3000}));
}

TEST(DngLevels, OneWhiteLevelStandsForAllChannels) {
  DngBuilder dng;
  dng.samples = 3;
  dng.set(50717, Tag::numbers(TagType::u16, {4000}));
  EXPECT_EQ(read_built(dng).raw.white_dn, (std::array<double, 3>{4000, 4000, 4000}));
}

TEST(DngLevels, TheWhiteLevelDefaultsToTheLargestStoredValue) {
  DngBuilder dng;
  dng.bits = 12;
  dng.remove(50717);
  EXPECT_EQ(read_built(dng).raw.white_dn[0], 4095);
}

TEST(DngLevels, WhiteMustBeAboveBlackAndTheMessageHasBothFigures) {
  DngBuilder dng;
  dng.set(50714, Tag::numbers(TagType::u16, {2000}));
  dng.set(50717, Tag::numbers(TagType::u16, {2000}));
  const Error error = refused(dng);
  EXPECT_EQ(error.code, ErrorCode::malformed);
  EXPECT_TRUE(has(error, "white level 2000 is not above black level 2000")) << error.message;
  dng.set(50717, Tag::numbers(TagType::u16, {2001}));
  EXPECT_EQ(read_built(dng).raw.white_dn[0], 2001);
}

TEST(DngLevels, EachChannelHasToHaveWhiteAboveBlack) {
  DngBuilder dng;
  dng.samples = 3;
  dng.set(50714, Tag::numbers(TagType::u16, {10, 20, 900}));
  dng.set(50717, Tag::numbers(TagType::u16, {1000, 1000, 800}));
  EXPECT_TRUE(has(refused(dng), "white level 800 is not above black level 900"));
}

TEST(DngLevels, LevelsThatAreNotNumbersAreRefusedByName) {
  DngBuilder black;
  black.set(50714, Tag::rationals(TagType::rational, {{1, 0}}));
  EXPECT_TRUE(has(refused(black), "BlackLevel"));
  DngBuilder white;
  white.set(50717, Tag::rationals(TagType::rational, {{0, 0}}));
  EXPECT_TRUE(has(refused(white), "WhiteLevel says"));
  DngBuilder zero;
  zero.set(50717, Tag::numbers(TagType::u32, {0}));
  EXPECT_TRUE(has(refused(zero), "WhiteLevel says 0"));
  DngBuilder huge;
  huge.set(50717, Tag::numbers(TagType::u32, {4294967295.0}));
  EXPECT_TRUE(has(refused(huge), "WhiteLevel says 4294967295"));
}

TEST(DngLevels, PatternsThatDoNotFitTheirCountAreRefused) {
  DngBuilder wrong;
  wrong.set(50713, Tag::numbers(TagType::u16, {2, 2}));
  wrong.set(50714, Tag::numbers(TagType::u16, {1, 2, 3}));
  EXPECT_TRUE(has(refused(wrong), "BlackLevel has 3 values, its pattern needs 4"));
  DngBuilder vast;
  vast.set(50713, Tag::numbers(TagType::u16, {65535, 65535}));
  EXPECT_TRUE(has(refused(vast), "BlackLevelRepeatDim says 65535 x 65535"));
  DngBuilder none;
  none.set(50713, Tag::numbers(TagType::u16, {0, 2}));
  EXPECT_TRUE(has(refused(none), "BlackLevelRepeatDim"));
}

}  // namespace
}  // namespace lowlux::test
