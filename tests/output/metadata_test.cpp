#include "isp/output/picture/metadata.h"

#include <gtest/gtest.h>
#include <libexif/exif-data.h>

#include <cmath>
#include <limits>
#include <memory>
#include <optional>

namespace lowlux::isp::metadata_test {
namespace {

struct Unref {
  void operator()(ExifData* data) const { exif_data_unref(data); }
};
using Data = std::unique_ptr<ExifData, Unref>;

/// Reads a block as libexif does, which wants the prefix of JPEG's segment.
Data parse(const std::vector<std::byte>& block) {
  std::vector<unsigned char> bytes{'E', 'x', 'i', 'f', 0, 0};
  for (const std::byte b : block) bytes.push_back(std::to_integer<unsigned char>(b));
  Data data(exif_data_new());
  exif_data_unset_option(data.get(), EXIF_DATA_OPTION_FOLLOW_SPECIFICATION);
  exif_data_load_data(data.get(), bytes.data(), static_cast<unsigned>(bytes.size()));
  return data;
}

const ExifEntry* entry(const Data& data, int tag) {
  const ExifEntry* in_main = exif_content_get_entry(data->ifd[EXIF_IFD_0], static_cast<ExifTag>(tag));
  return in_main != nullptr ? in_main : exif_content_get_entry(data->ifd[EXIF_IFD_EXIF], static_cast<ExifTag>(tag));
}

std::optional<std::string> text(const Data& data, int tag) {
  const ExifEntry* e = entry(data, tag);
  if (e == nullptr || e->format != EXIF_FORMAT_ASCII) return std::nullopt;
  return std::string(reinterpret_cast<const char*>(e->data), e->size - 1);
}

std::optional<unsigned> whole(const Data& data, int tag) {
  const ExifEntry* e = entry(data, tag);
  if (e == nullptr) return std::nullopt;
  const auto order = exif_data_get_byte_order(data.get());
  return e->format == EXIF_FORMAT_SHORT ? exif_get_short(e->data, order) : exif_get_long(e->data, order);
}

std::optional<ExifRational> fraction(const Data& data, int tag) {
  const ExifEntry* e = entry(data, tag);
  if (e == nullptr || e->format != EXIF_FORMAT_RATIONAL) return std::nullopt;
  return exif_get_rational(e->data, exif_data_get_byte_order(data.get()));
}

FrameInfo camera_info() {
  FrameInfo info;
  info.make = "Maker";
  info.model = "Model 1";
  info.software = "firmware 3";
  info.date_time = "2024:02:03 04:05:06";
  info.exposure_s = 1.0 / 30;
  info.iso = 3200;
  info.f_number = 1.8;
  info.focal_length_mm = 35;
  info.orientation = Orientation::rotate_90;
  return info;
}

TEST(ExifBlock, TellsHowTheFrameWasTaken) {
  const Data data = parse(exif_block(camera_info(), {4000, 3000, OutputSpace::srgb, "lowlux 9"}));
  EXPECT_EQ(text(data, EXIF_TAG_MAKE), "Maker");
  EXPECT_EQ(text(data, EXIF_TAG_MODEL), "Model 1");
  EXPECT_EQ(text(data, EXIF_TAG_SOFTWARE), "lowlux 9");
  EXPECT_EQ(text(data, EXIF_TAG_DATE_TIME_ORIGINAL), "2024:02:03 04:05:06");
  EXPECT_EQ(fraction(data, EXIF_TAG_EXPOSURE_TIME)->numerator, 1U);
  EXPECT_EQ(fraction(data, EXIF_TAG_EXPOSURE_TIME)->denominator, 30U);
  EXPECT_EQ(fraction(data, EXIF_TAG_FNUMBER)->numerator, 9U);
  EXPECT_EQ(fraction(data, EXIF_TAG_FNUMBER)->denominator, 5U);
  EXPECT_EQ(fraction(data, EXIF_TAG_FOCAL_LENGTH)->numerator, 35U);
  EXPECT_EQ(whole(data, EXIF_TAG_ISO_SPEED_RATINGS), 3200U);
  EXPECT_EQ(whole(data, EXIF_TAG_PIXEL_X_DIMENSION), 4000U);
  EXPECT_EQ(whole(data, EXIF_TAG_PIXEL_Y_DIMENSION), 3000U);
  EXPECT_EQ(whole(data, EXIF_TAG_COLOR_SPACE), 1U);
}

TEST(ExifBlock, PixelsAreUprightWhateverTheCameraHeld) {
  EXPECT_EQ(whole(parse(exif_block(camera_info(), {})), EXIF_TAG_ORIENTATION), 1U);
}

TEST(ExifBlock, OnlySrgbCallsItselfSrgb) {
  for (const OutputSpace space : {OutputSpace::display_p3, OutputSpace::linear_srgb, OutputSpace::camera}) {
    const Data data = parse(exif_block(camera_info(), {.width = 1, .height = 1, .space = space, .software = ""}));
    EXPECT_EQ(whole(data, EXIF_TAG_COLOR_SPACE), 0xFFFFU);
  }
}

TEST(ExifBlock, WhatIsUnknownStaysAbsent) {
  const Data data = parse(exif_block({}, {4, 3, OutputSpace::srgb, ""}));
  for (const int tag : {EXIF_TAG_MAKE, EXIF_TAG_MODEL, EXIF_TAG_SOFTWARE, EXIF_TAG_DATE_TIME,
                        EXIF_TAG_DATE_TIME_ORIGINAL, EXIF_TAG_EXPOSURE_TIME, EXIF_TAG_FNUMBER,
                        EXIF_TAG_ISO_SPEED_RATINGS, EXIF_TAG_FOCAL_LENGTH, EXIF_TAG_SENSITIVITY_TYPE}) {
    EXPECT_EQ(entry(data, tag), nullptr) << tag;
  }
  EXPECT_EQ(whole(data, EXIF_TAG_PIXEL_X_DIMENSION), 4U);
}

TEST(ExifBlock, SensitivitiesThatNeedMoreThan16BitsAreToldInFull) {
  FrameInfo info;
  info.iso = 65534;
  Data data = parse(exif_block(info, {}));
  EXPECT_EQ(whole(data, EXIF_TAG_ISO_SPEED_RATINGS), 65534U);
  EXPECT_EQ(entry(data, EXIF_TAG_RECOMMENDED_EXPOSURE_INDEX), nullptr);
  info.iso = 409600;
  data = parse(exif_block(info, {}));
  EXPECT_EQ(whole(data, EXIF_TAG_ISO_SPEED_RATINGS), 65535U);
  EXPECT_EQ(whole(data, EXIF_TAG_SENSITIVITY_TYPE), 2U);
  EXPECT_EQ(whole(data, EXIF_TAG_RECOMMENDED_EXPOSURE_INDEX), 409600U);
}

TEST(ExifBlock, ExposuresOfAnyLengthKeepTheirValue) {
  for (const double exposure_s :
       {1.0 / 32000, 1.0 / 8000, 1.0 / 3, 0.3, 0.033333333333, 2.5, 30.0, 3600.0, 0.123456789}) {
    FrameInfo info;
    info.exposure_s = exposure_s;
    const auto read = fraction(parse(exif_block(info, {})), EXIF_TAG_EXPOSURE_TIME);
    ASSERT_TRUE(read);
    EXPECT_NEAR(static_cast<double>(read->numerator) / read->denominator, exposure_s, 1e-8 * exposure_s);
  }
}

TEST(ExifBlock, NumbersThatCannotBeAreLeftOut) {
  for (const double number : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity(), 1e300, 1e-300}) {
    FrameInfo info;
    info.exposure_s = info.f_number = info.focal_length_mm = info.iso = number;
    const Data data = parse(exif_block(info, {}));
    for (const int tag :
         {EXIF_TAG_EXPOSURE_TIME, EXIF_TAG_FNUMBER, EXIF_TAG_FOCAL_LENGTH, EXIF_TAG_ISO_SPEED_RATINGS}) {
      EXPECT_EQ(entry(data, tag), nullptr) << number;
    }
  }
}

TEST(ExifBlock, TextIsCleanedAndTimesMustHaveTheirShape) {
  FrameInfo info;
  info.make = std::string("A\0B\n\xFF", 5) + "C";
  info.model = std::string(100'000, 'x');
  for (const char* time : {"yesterday", "2024-02-03 04:05:06", "2024:02:03T04:05:06", "2024:02:03 04:05:0x"}) {
    info.date_time = time;
    const Data data = parse(exif_block(info, {}));
    EXPECT_EQ(text(data, EXIF_TAG_MAKE), "ABC");
    EXPECT_EQ(text(data, EXIF_TAG_MODEL), std::string(255, 'x'));
    EXPECT_EQ(entry(data, EXIF_TAG_DATE_TIME_ORIGINAL), nullptr) << time;
  }
}

TEST(WrittenInfo, IsUprightAndNamesTheProgramThatWroteIt) {
  const FrameInfo info = written_info(camera_info(), "lowlux 9");
  EXPECT_EQ(info.orientation, Orientation::normal);
  EXPECT_EQ(info.software, "lowlux 9");
  EXPECT_EQ(info.make, "Maker");
  EXPECT_EQ(info.iso, 3200);
}

}  // namespace
}  // namespace lowlux::isp::metadata_test
