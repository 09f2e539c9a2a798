// Tags that are passed on, as they are collected from a file.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "capture/dng/source_tags.h"
#include "capture/dng/tiff_directory.h"
#include "capture/file/dng_source.h"
#include "tests/support/dng/dng_builder.h"

namespace lowlux::capture {
namespace {

using test::DngBuilder;
using test::Tag;
using test::TagType;

std::vector<std::byte> values_of(const SourceTags& tags, std::uint16_t id) {
  const auto at = std::find_if(tags.main.begin(), tags.main.end(), [id](const SourceTag& tag) { return tag.id == id; });
  return at == tags.main.end() ? std::vector<std::byte>{} : at->values;
}

std::shared_ptr<const SourceTags> tags_of(const std::vector<std::byte>& file, std::vector<std::string>& warnings) {
  const auto dng = open_dng(file);
  EXPECT_TRUE(dng && *dng);
  return dng && *dng ? dng_source_tags(file, **dng, warnings) : nullptr;
}

TEST(SourceTags, TablesOfTheProfileFollowTheSortedCalibrations) {
  for (const bool daylight_first : {false, true}) {
    for (const bool big_endian : {false, true}) {
      DngBuilder dng;
      dng.big_endian = big_endian;
      for (const std::uint16_t id : {50721, 50722}) {
        dng.set(id, Tag::numbers(TagType::srational, {1, 0, 0, 0, 1, 0, 0, 0, 1}));
      }
      dng.set(50778, Tag::numbers(TagType::u16, {daylight_first ? 21.0 : 17.0}));
      dng.set(50779, Tag::numbers(TagType::u16, {daylight_first ? 17.0 : 21.0}));
      dng.set(50938, Tag::numbers(TagType::f32, {1, 1, 1}));
      dng.set(50939, Tag::numbers(TagType::f32, {2, 2, 2}));
      std::vector<std::string> warnings;
      const auto tags = tags_of(dng.build(), warnings);
      ASSERT_TRUE(tags);
      for (const auto& [id, written] : {std::pair<std::uint16_t, float>{50938, daylight_first ? 2.0F : 1.0F},
                                        {50939, daylight_first ? 1.0F : 2.0F}}) {
        const auto values = values_of(*tags, id);
        ASSERT_EQ(values.size(), 12u);
        EXPECT_EQ(load_f32(values.data(), false), written) << id;
      }
    }
  }
}

TEST(SourceTags, DataOfLowluxItselfAreNotPassedOn) {
  for (const std::string maker : {"lowlux", "Maker!"}) {
    std::vector<std::byte> bytes(40);
    std::transform(maker.begin(), maker.end(), bytes.begin(), [](char c) { return static_cast<std::byte>(c); });
    DngBuilder dng;
    std::vector<std::string> warnings;
    const auto tags = tags_of(dng.set(50740, Tag::opaque(bytes)).build(), warnings);
    ASSERT_TRUE(tags);
    EXPECT_EQ(values_of(*tags, 50740).empty(), maker == "lowlux");
  }
}

TEST(SourceTags, ManyTagsOfTheSameBytesAreBounded) {
  // 100 EXIF tags, each of which names the same megabyte.
  constexpr std::size_t megabyte = std::size_t{1} << 20;
  DngBuilder dng;
  for (std::uint16_t i = 0; i < 100; ++i) {
    dng.set(static_cast<std::uint16_t>(41000 + i), Tag::opaque(std::vector<std::byte>(16, std::byte{1})));
  }
  auto bytes = dng.build();
  const auto tiff = TiffFile::open(bytes);
  const auto main = tiff->directory(tiff->first_directory());
  const auto exif = tiff->directory(**main->whole({34665, "ExifIFD"}));
  std::vector<std::size_t> places;
  for (const TiffEntry& entry : exif->entries) {
    if (entry.id >= 41000 && entry.id < 41100) places.push_back(entry.place);
  }
  ASSERT_EQ(places.size(), 100u);
  bytes.resize(bytes.size() + megabyte + 8);
  for (const std::size_t place : places) {
    for (const auto& [at, number] : {std::pair{place + 4, megabyte}, {place + 8, std::size_t{8}}}) {
      for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::byte>(number >> (8 * i) & 255);
    }
  }
  std::vector<std::string> warnings;
  const auto tags = tags_of(bytes, warnings);
  ASSERT_TRUE(tags);
  std::size_t sum = 0;
  for (const SourceTag& tag : tags->exif) sum += tag.values.size();
  EXPECT_LE(sum, 64 * megabyte);
  EXPECT_GE(sum, 60 * megabyte);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("too many or too large"), std::string::npos) << warnings[0];
}

TEST(SourceTags, BaselineExposureIsBoundedAndOfNumbers) {
  for (const auto& [tag, expected] : {std::pair{Tag::rationals(TagType::srational, {{-7, 4}}), -1.75},
                                      {Tag::rationals(TagType::srational, {{1, 0}}), 0.0},
                                      {Tag::rationals(TagType::srational, {{1000, 1}}), 0.0},
                                      {Tag::text("bright"), 0.0}}) {
    DngBuilder dng;
    std::vector<std::string> warnings;
    EXPECT_EQ(tags_of(dng.set(50730, tag).build(), warnings)->baseline_exposure_ev, expected);
  }
}

TEST(SourceTags, KeepTheMakerNoteOnlyIfTheFileStatesThatItIsSafe) {
  for (const auto& [safety, is_kept] : {std::pair{-1, false}, {0, false}, {1, true}, {2, false}}) {
    DngBuilder dng;
    dng.set(37500, Tag::opaque(std::vector<std::byte>(60, std::byte{0x11})));
    dng.set(37383, Tag::numbers(TagType::u16, {5}));
    if (safety >= 0) dng.set(50741, Tag::numbers(TagType::u16, {static_cast<double>(safety)}));
    std::vector<std::string> warnings;
    const auto tags = tags_of(dng.build(), warnings);
    ASSERT_TRUE(tags);
    const auto has = [&](std::uint16_t id) {
      return std::any_of(tags->exif.begin(), tags->exif.end(), [id](const SourceTag& tag) { return tag.id == id; });
    };
    EXPECT_EQ(has(37500), is_kept) << safety;
    EXPECT_TRUE(has(37383)) << safety;
    EXPECT_TRUE(warnings.empty());
  }
}

/// Returns a DNG with a GPS directory of a latitude.
std::vector<std::byte> dng_with_gps() {
  DngBuilder dng;
  dng.set(34853, Tag::numbers(TagType::u32, {0}));
  const std::size_t end = dng.build().size() / 2 * 2 + 2;
  std::vector<std::byte> file = dng.set(34853, Tag::numbers(TagType::u32, {static_cast<double>(end)})).build();
  file.resize(end);
  test::TagDirectory place;
  place[1] = Tag::text("N");
  place[2] = Tag::rationals(TagType::rational, {{48, 1}, {51, 1}, {30, 1}});
  const auto directory = test::encode_directory(place, end, false);
  file.insert(file.end(), directory.begin(), directory.end());
  return file;
}

/// Returns the place of the entry of a tag in the first directory, or in that of GPS.
std::size_t gps_entry_of(const std::vector<std::byte>& file, std::uint16_t id) {
  const auto tiff = TiffFile::open(file);
  const auto main = tiff->directory(tiff->first_directory());
  const auto gps = tiff->directory(**main->whole({34853, "GPSInfo"}));
  return (id == 34853 ? *main : *gps).find({id, ""})->place;
}

void overwrite(std::vector<std::byte>& file, std::size_t at, std::uint32_t value, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) file[at + i] = static_cast<std::byte>(value >> (8 * i) & 255);
}

TEST(SourceTags, ADamagedGpsDirectoryIsWarnedOfByName) {
  std::vector<std::string> warnings;
  EXPECT_EQ(tags_of(dng_with_gps(), warnings)->gps.size(), 2u);
  EXPECT_TRUE(warnings.empty());
  struct Damage {
    std::size_t place, bytes;
    std::uint32_t value;
  };
  for (const Damage& damage : {Damage{8, 4, 0xFFFFFFF0}, {4, 4, 0x7FFFFFFF}, {4, 4, 0}, {2, 2, 2}}) {
    std::vector<std::byte> file = dng_with_gps();
    overwrite(file, gps_entry_of(file, 34853) + damage.place, damage.value, damage.bytes);
    warnings.clear();
    EXPECT_TRUE(tags_of(file, warnings)->gps.empty());
    ASSERT_EQ(warnings.size(), 1u) << damage.value;
    EXPECT_EQ(warnings[0].find("the tags of GPSInfo (tag 34853) are not copied: the tag "), 0u) << warnings[0];
  }
  std::vector<std::byte> file = dng_with_gps();
  overwrite(file, gps_entry_of(file, 34853) + 8, 0, 4);  // no directory
  warnings.clear();
  EXPECT_TRUE(tags_of(file, warnings)->gps.empty());
  EXPECT_TRUE(warnings.empty());
}

TEST(SourceTags, ADamagedGpsTagIsCalledOne) {
  std::vector<std::byte> file = dng_with_gps();
  overwrite(file, gps_entry_of(file, 2) + 8, 0x7FFFFFFF, 4);
  std::vector<std::string> warnings;
  EXPECT_EQ(tags_of(file, warnings)->gps.size(), 1u);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0], "GPS tag 2 is not copied: its values lie beyond the end of the file");
}

// An uncompressed TIFF raw that is not a DNG: LibRaw decodes it.
TEST(SourceTags, CamerasOfOtherRawsAreNamedAsTheFileDoes) {
  for (const bool big_endian : {false, true}) {
    DngBuilder raw;
    raw.big_endian = big_endian;
    raw.width = 64, raw.height = 48;
    for (const std::uint16_t id : {50706, 50707, 50708}) raw.remove(id);  // DNGVersion and UniqueCameraModel
    raw.set(271, Tag::text("NIKON CORPORATION")).set(272, Tag::text("NIKON D750"));
    const auto frame = read_raw(raw.build(), "a.nef");
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->raw.info.make, "NIKON CORPORATION");
    EXPECT_EQ(frame->raw.info.model, "NIKON D750");
    ASSERT_TRUE(frame->source_tags);
    EXPECT_EQ(text_of(frame->source_tags->main, 50708), "Nikon D750");
  }
}

}  // namespace
}  // namespace lowlux::capture
