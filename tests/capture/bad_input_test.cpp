#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>

#include "tests/capture/read_built.h"

namespace lowlux::test::bad_input_test {
namespace {

std::vector<std::byte> bytes_of(const std::string& text) {
  std::vector<std::byte> out;
  std::transform(text.begin(), text.end(), std::back_inserter(out), [](char c) { return static_cast<std::byte>(c); });
  return out;
}

/// A file with most of what the reader looks at.
DngBuilder rich() {
  DngBuilder dng;
  dng.width = 48, dng.height = 40, dng.bits = 12;
  dng.raw_in_sub_ifd = true;
  dng.storage = DngStorage::lossless_jpeg;
  dng.set(50829, Tag::numbers(TagType::u32, {3, 5, 38, 46}));
  dng.set(50830, Tag::numbers(TagType::u32, {3, 0, 38, 4}));
  dng.set(50713, Tag::numbers(TagType::u16, {2, 2}));
  dng.set(50714, Tag::numbers(TagType::rational, {64, 65, 66.5, 67}));
  dng.set(50715, Tag::numbers(TagType::srational, std::vector<double>(41, 0.5)));
  dng.set(50722, Tag::numbers(TagType::srational, {0.9, -0.3, -0.1, -0.5, 1.3, 0.2, -0.1, 0.2, 0.6}));
  dng.set(50779, Tag::numbers(TagType::u16, {17}));
  dng.set(51041, Tag::numbers(TagType::f64, {1e-4, 1e-7}));
  dng.set(33434, Tag::rationals(TagType::rational, {{1, 30}}));
  std::vector<std::byte> opcodes;
  for (const std::uint32_t word : {1U, 5U, 0x01030000U, 0U, 20U, 0U, 1U, 0U, 7U, 9U}) append_u32(opcodes, word);
  dng.set(51008, Tag::opaque(opcodes));
  return dng;
}

class TemporaryFile {
 public:
  explicit TemporaryFile(const std::vector<std::byte>& bytes)
      : path_(std::filesystem::temp_directory_path() / ("lowlux-" + std::to_string(getpid()) + ".dng")) {
    std::ofstream(path_, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
  }
  ~TemporaryFile() { std::filesystem::remove(path_); }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

TEST(BadInput, TheRichFileIsGood) {
  const RawFrame frame = read_built(rich());
  EXPECT_EQ(samples_of(frame), ramp(rich()));
  EXPECT_EQ(frame.corrections.defects.size(), 1u);
}

TEST(BadInput, EveryTruncationIsRefusedOrLosesNothingThatMatters) {
  for (const DngBuilder& dng : {rich(), DngBuilder{}}) {
    const std::vector<std::byte> whole = dng.build();
    const std::size_t data = dng.raw_in_sub_ifd ? whole.size() - 48 : whole.size();  // a preview may end it
    for (std::size_t length = 0; length < data; length += length < 64 ? 1 : 41) {
      const Error error = refused({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)});
      EXPECT_NE(error.code, ErrorCode::not_found) << length;
    }
  }
}

TEST(BadInput, FlippedBitsGiveAnErrorOrAFrameButNeverACrash) {
  std::mt19937 random(20240607);
  int good = 0, bad = 0;
  for (const DngBuilder& dng : {rich(), DngBuilder{}}) {
    const std::vector<std::byte> whole = dng.build();
    for (int i = 0; i < 250; ++i) {
      std::vector<std::byte> flipped = whole;
      const std::size_t at = random() % std::min<std::size_t>(flipped.size(), 1500);
      flipped[at] ^= static_cast<std::byte>(1U << random() % 8);
      const auto frame = read_bytes(flipped, {.max_pixels = 4'000'000, .max_decode_cpu_s = 2});
      ++(frame ? good : bad);
      if (frame) {
        EXPECT_LE(frame->raw.active.x + frame->raw.active.width, frame->raw.dn.width());
        EXPECT_LE(frame->raw.active.y + frame->raw.active.height, frame->raw.dn.height());
      }
    }
  }
  EXPECT_GT(good, 0);
  EXPECT_GT(bad, 0);
}

TEST(BadInput, AnEmptyFileIsCalledEmpty) { EXPECT_TRUE(has(refused(std::vector<std::byte>{}), "empty")); }

TEST(BadInput, TextIsNotTakenForTheDumpOfACameraThatHasItsSize) {
  std::string letters(std::size_t{1024} * 768, 'a');
  for (std::size_t i = 1023; i < letters.size(); i += 1024) letters[i] = '\n';
  EXPECT_TRUE(has(refused(bytes_of(letters)), "this is text"));
}

TEST(BadInput, ADumpWhoseSamplesCanBePrintedIsNotTakenForText) {
  // LibRaw knows a Kodak C603 by the size of its YCbCr samples, 2848 x 2134 x 1.5 bytes.
  const auto frame = read_bytes(bytes_of(std::string(9116448, 'a')));
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->raw.info.make, "Kodak");
  EXPECT_EQ(frame->raw.layout, SensorLayout::linear_rgb);
}

TEST(BadInput, TextInOneLineIsTextUnlessItIsARaw) {
  EXPECT_TRUE(has(refused(bytes_of(std::string(100'000, 'a'))), "this is text"));
}

TEST(BadInput, FilesThatAreNotRawAreNamedByTheirType) {
  EXPECT_TRUE(has(refused(bytes_of("Dear reader,\nthis is a letter and no photograph.\n")), "this is text"));
  EXPECT_TRUE(has(refused(bytes_of("\xFF\xD8\xFF\xE0 and so on")), "a JPEG image"));
  EXPECT_TRUE(has(refused(bytes_of("\x89PNG\r\n\x1a\n")), "a PNG image"));
  DngBuilder picture;
  picture.samples = 3;
  picture.bits = 8;
  picture.set(262, Tag::numbers(TagType::u16, {2}));
  EXPECT_TRUE(has(refused(picture), "contains no raw image"));
  picture.remove(50706).remove(50707);
  EXPECT_TRUE(has(refused(picture), "a TIFF image"));
}

TEST(BadInput, AFileIsTextOnlyIfMoreThanItsFirstRowsCanBePrinted) {
  // Rows of a raw without a header can have the bytes of letters; the rest has not.
  std::string samples(std::size_t{1024} * 768, 'a');
  samples[4096] = '\x01';
  EXPECT_FALSE(has(refused(bytes_of(samples.substr(0, 5000))), "text"));
  samples[4096] = '\xC3';  // what follows is not the rest of a character of UTF-8
  EXPECT_FALSE(has(refused(bytes_of(samples.substr(0, 5000))), "text"));
  EXPECT_TRUE(has(refused(bytes_of("gr\xC3\xBC\xC3\x9F"
                                   "e, \xE2\x82\xAC 5\n")),
                  "this is text"));
}

TEST(BadInput, ACropOutsideOfTheActiveAreaIsIgnored) {
  DngBuilder dng;
  dng.set(50719, Tag::numbers(TagType::u32, {24, 0}));
  dng.set(50720, Tag::numbers(TagType::u32, {24, 24}));
  EXPECT_NE(warned(dng).find("the tag DefaultCropSize states a crop outside of the active area"), std::string::npos);
  EXPECT_EQ(read_built(dng).raw.default_crop, (Rect{0, 0, 24, 24}));
  dng.set(50719, Tag::rationals(TagType::rational, {{0, 0}, {1, 0}}));
  EXPECT_NE(warned(dng).find("DefaultCropSize"), std::string::npos);
}

TEST(BadInput, AnActiveAreaOutsideOfTheReadoutIsRefusedAndAMaskedOneIgnored) {
  for (const std::vector<double>& area :
       {std::vector<double>{0, 0, 25, 24}, {0, 0, 24, 4294967295.0}, {5, 5, 5, 20}, {20, 5, 5, 20}}) {
    DngBuilder active;
    active.set(50829, Tag::numbers(TagType::u32, area));
    EXPECT_EQ(refused(active).code, ErrorCode::malformed);
    DngBuilder masked;
    masked.set(50830, Tag::numbers(TagType::u32, area));
    EXPECT_NE(warned(masked).find("MaskedAreas"), std::string::npos);
    EXPECT_FALSE(read_built(masked).raw.masked_is_stated);
  }
}

TEST(BadInput, AbsurdDimensionsAreRefusedWithoutTakingTheirMemory) {
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  const auto sized = [](double width, double height) {
    DngBuilder dng;
    dng.set(256, Tag::numbers(TagType::u32, {width}));
    dng.set(257, Tag::numbers(TagType::u32, {height}));
    return dng;
  };
  EXPECT_TRUE(has(refused(sized(65535, 65535)), "65535 x 65535"));
  EXPECT_TRUE(has(refused(sized(2147483648.0, 24)), "2147483648 x 24 pixels cannot be decoded"));
  EXPECT_TRUE(has(refused(sized(4294967295.0, 4294967295.0)), "cannot be decoded"));
  EXPECT_TRUE(has(refused(sized(0, 24)), "0 x 24"));
  DngBuilder compressed = sized(64000, 64000);
  compressed.storage = DngStorage::lossless_jpeg;
  EXPECT_EQ(refused(compressed).code, ErrorCode::too_large);
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 64 << 10) << "KiB";
}

TEST(BadInput, FewerTilesOfLosslessJpegThanTheImageNeedsAreRefused) {
  DngBuilder dng;
  dng.storage = DngStorage::tiled_lossless_jpeg;
  const auto offsets = Tag::numbers(TagType::u32, {1000, 1100, 1200});
  dng.set(324, offsets).set(325, Tag::numbers(TagType::u32, {22, 22, 22}));
  EXPECT_TRUE(has(refused(dng), "24 x 24 pixels needs 4 strips or tiles, the file has 3"));
}

TEST(BadInput, LimitsOfTheCallerHold) {
  DngBuilder dng;
  dng.width = dng.height = 100;
  EXPECT_EQ(refused(dng, {.max_pixels = 9999}).code, ErrorCode::too_large);
  EXPECT_TRUE(read_bytes(dng.build(), {.max_pixels = 10000}));
  EXPECT_EQ(refused(dng, {.max_file_bytes = 20000}).code, ErrorCode::too_large);
}

TEST(BadInput, ImageDataBeyondTheFileIsSaidWithBothSizes) {
  const std::vector<std::byte> whole = DngBuilder{}.build();
  const Error error = refused({whole.begin(), whole.end() - 1});
  EXPECT_TRUE(has(
      error, "reaches to byte " + std::to_string(whole.size()) + ", the file has " + std::to_string(whole.size() - 1)))
      << error.message;
  DngBuilder brief;
  brief.set(279, Tag::numbers(TagType::u32, {100}));
  EXPECT_TRUE(has(refused(brief), "a strip or tile of 24 x 24 pixels has 100 bytes, too few for 1152"));
}

TEST(BadInput, DamagedLosslessJpegIsAnError) {
  DngBuilder dng;
  dng.storage = DngStorage::lossless_jpeg;
  std::vector<std::byte> bytes = dng.build();
  for (std::size_t i = bytes.size() - 700; i < bytes.size() - 100; ++i) bytes[i] = std::byte{0xFF};
  EXPECT_EQ(refused(bytes).code, ErrorCode::malformed);
}

TEST(BadInput, DirectoriesThatPointAtEachOtherEnd) {
  DngBuilder dng;
  dng.set(330, Tag::numbers(TagType::u32, {8, 8, 8, 9, 4294967295.0}));
  EXPECT_EQ(samples_of(read_built(dng)), ramp(dng));
}

TEST(BadInput, PathsThatAreNoReadableFileAreOneClearLine) {
  const auto missing = capture::read_raw(std::filesystem::path("/no/such/file.dng"));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::not_found);
  EXPECT_EQ(missing.error().where, "/no/such/file.dng");
  const auto directory = capture::read_raw(std::filesystem::temp_directory_path());
  ASSERT_FALSE(directory);
  EXPECT_EQ(directory.error().code, ErrorCode::unreadable);
  EXPECT_TRUE(has(directory.error(), "directory"));
  const auto device = capture::read_raw(std::filesystem::path("/dev/null"));
  ASSERT_FALSE(device);
  EXPECT_TRUE(has(device.error(), "regular file"));
}

TEST(BadInput, FilesAreReadLikeBytes) {
  const TemporaryFile file(rich().build());
  const auto frame = capture::read_raw(file.path());
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(samples_of(*frame), ramp(rich()));
  const TemporaryFile empty({});
  const auto nothing = capture::read_raw(empty.path());
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().where, empty.path().string());
}

}  // namespace
}  // namespace lowlux::test::bad_input_test
