// Tags of a raw that lowlux does not use survive: all of them in DNGs, those of the taking in finished images. Source
// and result are compared tag by tag.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "capture/dng/tiff_directory.h"
#include "tests/capture/x_trans_colours.h"
#include "tests/cli/command.h"
#include "tests/support/dng/dng_builder.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using capture::TiffEntry;
using capture::TiffFile;
using test::DngBuilder;
using test::lowlux;
using test::Tag;
using test::TagType;

constexpr std::uint16_t exif_pointer = 34665, gps_pointer = 34853, opcode_list3 = 51022;

std::vector<std::byte> bytes_of_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<std::byte> out(std::filesystem::file_size(path));
  file.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(out.size()));
  return out;
}

/// An opcode list of WarpRectilinear, which lowlux does not apply, behind FixVignetteRadial, which it does.
std::vector<std::byte> opcodes(bool with_vignette) {
  test::ByteWriter out(true);
  out.number(with_vignette ? 2 : 1, 4);
  if (with_vignette) {
    for (const std::uint32_t word : {3U, 0x01030000U, 0U, 56U}) out.number(word, 4);
    for (int i = 0; i < 7; ++i) out.number(i < 5 ? 0 : 0x3FE0000000000000, 8);  // no gain, about the centre
  }
  for (const std::uint32_t word : {1U, 0x01030000U, 1U, 68U, 1U}) out.number(word, 4);
  for (int i = 0; i < 8; ++i) out.number(i == 0 ? 0x3FF0000000000000 : i > 5 ? 0x3FE0000000000000 : 0, 8);
  return out.out;
}

enum class Layout : std::uint8_t { bayer, x_trans, linear_raw, monochrome };

/// A DNG of grey with Poisson-like noise, and with the tags of a camera, a lens, a place and a profile.
std::vector<std::byte> source_dng(bool big_endian, Layout layout = Layout::bayer) {
  DngBuilder dng;
  dng.width = 192, dng.height = 128, dng.big_endian = big_endian;
  if (layout == Layout::linear_raw) dng.samples = 3;
  dng.monochrome = layout == Layout::monochrome;
  if (layout == Layout::x_trans) {
    dng.set(33421, Tag::numbers(TagType::u16, {6, 6}));
    dng.set(33422, Tag::numbers(TagType::byte, test::x_trans_colours({})));
  }
  std::mt19937 draw(7);
  std::normal_distribution<double> noise(0, 40);
  for (int i = 0; i < dng.width * dng.height * dng.samples; ++i) {
    dng.pixels.push_back(static_cast<std::uint16_t>(std::lround(3000 + noise(draw))));
  }
  dng.set(51041, Tag::numbers(TagType::f64, {1e-6, 4e-7}));  // NoiseProfile
  dng.set(50728, Tag::numbers(TagType::rational, {0.5, 1, 0.6}));
  dng.set(315, Tag::text("An Author"));
  dng.set(33432, Tag::text("(c) An Author"));
  std::vector<std::byte> xmp(5000, std::byte{'x'});
  dng.set(700, Tag{TagType::byte, {{0, 0}}, xmp});
  dng.set(50708, Tag::text("Maker Model Unique"));
  dng.set(50709, Tag::text("Localized"));
  dng.set(50730, Tag::rationals(TagType::srational, {{-35, 100}}));  // BaselineExposure
  dng.set(50732, Tag::rationals(TagType::rational, {{4, 3}}));
  dng.set(50735, Tag::text("serial 17"));
  dng.set(50736, Tag::rationals(TagType::rational, {{24, 1}, {70, 1}, {28, 10}, {0, 0}}));  // LensInfo, one unknown
  dng.set(50740, Tag::opaque(std::vector<std::byte>(777, std::byte{0xA5})));
  dng.set(50741, Tag::numbers(TagType::u16, {1}));
  dng.set(50936, Tag::text("Profile"));
  dng.set(50937, Tag::numbers(TagType::u32, {2, 2, 1}));
  dng.set(50938, Tag::numbers(TagType::f32, {0, 1, 1, 0, 1, 1, 3, 1, 1, 5, 1.25, 0.5}));
  dng.set(50940, Tag::numbers(TagType::f32, {0, 0, 0.25, 0.5, 1, 1}));
  dng.set(50942, Tag::text("free"));
  dng.set(opcode_list3, Tag::opaque(opcodes(true)));
  dng.set(33434, Tag::rationals(TagType::rational, {{1, 30}}));
  dng.set(42036, Tag::text("A Lens 24-70"));
  dng.set(42034, Tag::rationals(TagType::rational, {{24, 1}, {70, 1}, {28, 10}, {0, 0}}));
  dng.set(37500, Tag::opaque(std::vector<std::byte>(6000, std::byte{0x11})));  // MakerNote
  dng.set(37383, Tag::numbers(TagType::u16, {5}));                             // MeteringMode
  dng.set(gps_pointer, Tag::numbers(TagType::u32, {0}));
  std::vector<std::byte> file = dng.build();
  if (file.size() % 2 != 0) file.push_back({});
  dng.set(gps_pointer, Tag::numbers(TagType::u32, {static_cast<double>(file.size())}));
  const std::size_t gps = file.size();
  file = dng.build();
  file.resize(gps);
  test::TagDirectory place;
  place[1] = Tag::text("N");
  place[2] = Tag::rationals(TagType::rational, {{48, 1}, {51, 1}, {296137, 10007}});
  place[5] = Tag::numbers(TagType::byte, {0});
  const auto directory = test::encode_directory(place, gps, big_endian);
  file.insert(file.end(), directory.begin(), directory.end());
  return file;
}

/// Values of a tag, and its type and count, in an order of bytes that does not depend on the file.
struct Values {
  TiffEntry::Type type{};
  std::vector<double> numbers;  // of rationals numerators and denominators
  friend bool operator==(const Values&, const Values&) = default;
};

Values values_of(const TiffEntry& entry) {
  Values out{entry.type, {}};
  const bool rational = entry.type == TiffEntry::Type::rational || entry.type == TiffEntry::Type::srational;
  EXPECT_TRUE(entry.inside_file) << entry.id;
  if (!entry.inside_file) return out;
  for (std::size_t i = 0; i < entry.count; ++i) {
    if (rational) {
      for (const std::size_t at : {8 * i, 8 * i + 4}) {
        out.numbers.push_back(capture::load_u32(entry.values.data() + at, entry.big_endian));
      }
    } else {
      out.numbers.push_back(entry.number(i));
    }
  }
  return out;
}

struct Directories {
  std::map<std::uint16_t, Values> main, exif, gps;
};

Directories directories_of(std::span<const std::byte> tiff_bytes) {
  Directories out;
  const auto tiff = TiffFile::open(tiff_bytes);
  EXPECT_TRUE(tiff);
  if (!tiff) return out;
  const auto fill = [&](std::uint32_t offset, auto& to) {
    const auto directory = tiff->directory(offset);
    ASSERT_TRUE(directory);
    std::uint16_t last = 0;
    for (const TiffEntry& entry : directory->entries) {
      EXPECT_LT(last, entry.id) << "tags are in rising order";
      last = entry.id;
      to[entry.id] = values_of(entry);
    }
  };
  fill(tiff->first_directory(), out.main);
  for (const auto& [pointer, to] : {std::pair{exif_pointer, &out.exif}, {gps_pointer, &out.gps}}) {
    if (out.main.contains(pointer)) fill(static_cast<std::uint32_t>(out.main[pointer].numbers[0]), *to);
  }
  return out;
}

/// The EXIF block of a JPEG or PNG, from its TIFF header on.
std::vector<std::byte> exif_of(const std::vector<std::byte>& file) {
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  const bool png = text.substr(1, 3) == "PNG";
  const std::size_t at = png ? text.find("eXIf") + 4 : text.find(std::string_view("Exif\0\0", 6)) + 6;
  return {file.begin() + static_cast<std::ptrdiff_t>(at), file.end()};
}

class SourceTagsCommand : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return folder_.file(name); }
  void write(const std::string& name, const std::vector<std::byte>& bytes) {
    std::ofstream out(file(name), std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  static void run(const std::vector<std::string>& words) {
    const auto result = lowlux(words);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

  test::ScratchDirectory folder_;
};

/// @param with_profile  false: the result has no colour matrices, and thus no profile that refers to them
void expect_kept(const std::vector<std::byte>& source, const std::vector<std::byte>& result) {
  const Directories before = directories_of(source), after = directories_of(result);
  for (const std::uint16_t id :
       {315, 700, 33432, 50708, 50709, 50732, 50735, 50736, 50740, 50741, 50936, 50937, 50938, 50940, 50942}) {
    ASSERT_TRUE(after.main.contains(id)) << id;
    EXPECT_EQ(after.main.at(id), before.main.at(id)) << "tag " << id;
  }
  for (const auto& [id, values] : before.exif) {
    ASSERT_TRUE(after.exif.contains(id)) << id;
    if (id == 33434) continue;  // the time is read and written, by libtiff
    EXPECT_EQ(after.exif.at(id), values) << "EXIF tag " << id;
  }
  const auto& seconds = after.exif.at(33434).numbers;
  EXPECT_NEAR(seconds[0] / seconds[1], 1.0 / 30, 1e-7 / 30);
  EXPECT_EQ(before.gps.size(), 3u);
  EXPECT_EQ(after.gps, before.gps);
  const auto& baseline = after.main.at(50730).numbers;  // SRATIONAL, read as unsigned words
  EXPECT_NEAR(static_cast<std::int32_t>(static_cast<std::uint32_t>(baseline[0])) / baseline[1], -0.35, 1e-7);
  // The vignette is in OpcodeList2 now; what lowlux does not apply stays.
  std::vector<double> warp;
  for (const std::byte b : opcodes(false)) warp.push_back(std::to_integer<int>(b));
  EXPECT_EQ(after.main.at(opcode_list3).numbers, warp);
}

TEST_F(SourceTagsCommand, SurviveDenoisingAndMerging) {
  for (const bool big_endian : {false, true}) {
    const auto source = source_dng(big_endian);
    write("a.dng", source);
    write("b.dng", source);
    run({"denoise", file("a.dng"), "-o", file("clean.dng"), "--force", "--quiet"});
    expect_kept(source, bytes_of_file(file("clean.dng")));
    run({"merge", file("a.dng"), file("b.dng"), "-o", file("merged.dng"), "--force", "--quiet"});
    expect_kept(source, bytes_of_file(file("merged.dng")));
    // What lowlux wrote is itself a source.
    run({"denoise", file("clean.dng"), "-o", file("again.dng"), "--force", "--quiet"});
    expect_kept(source, bytes_of_file(file("again.dng")));
  }
}

TEST_F(SourceTagsCommand, SurviveDenoisingOfFilesThatAreNoMosaics) {
  for (const Layout layout : {Layout::linear_raw, Layout::monochrome, Layout::x_trans}) {
    SCOPED_TRACE(static_cast<int>(layout));
    const auto source = source_dng(layout == Layout::monochrome, layout);
    write("a.dng", source);
    run({"denoise", file("a.dng"), "-o", file("clean.dng"), "--force", "--quiet"});
    expect_kept(source, bytes_of_file(file("clean.dng")));
    run({"denoise", file("clean.dng"), "-o", file("again.dng"), "--force", "--quiet"});
    expect_kept(source, bytes_of_file(file("again.dng")));
  }
}

TEST_F(SourceTagsCommand, LensAndPlaceReachFinishedImages) {
  for (const bool big_endian : {false, true}) {
    const auto source = source_dng(big_endian);
    const Directories before = directories_of(source);
    write("a.dng", source);
    for (const std::string name : {"a.jpg", "a.png", "a.tif"}) {
      run({"develop", file("a.dng"), "-o", file(name), "--force", "--quiet"});
      const auto result = bytes_of_file(file(name));
      const Directories after = directories_of(name == "a.tif" ? result : exif_of(result));
      for (const std::uint16_t id : {315, 33432}) EXPECT_EQ(after.main.at(id), before.main.at(id)) << name << id;
      for (const std::uint16_t id : {42034, 42036, 37383}) EXPECT_EQ(after.exif.at(id), before.exif.at(id)) << name;
      EXPECT_EQ(after.gps, before.gps) << name;
      EXPECT_FALSE(after.exif.contains(37500)) << "offsets of maker's notes do not survive";
      for (const std::uint16_t id : {700, 50708, 50938}) EXPECT_FALSE(after.main.contains(id)) << name << id;
    }
  }
}

TEST_F(SourceTagsCommand, SurviveTheConversionOfFinishedImages) {
  write("a.dng", source_dng(false));
  for (const std::string source : {"a.jpg", "a.png", "a.tif"}) {
    run({"develop", file("a.dng"), "-o", file(source), "--force", "--quiet"});
    const auto before_bytes = bytes_of_file(file(source));
    const Directories before = directories_of(source == "a.tif" ? before_bytes : exif_of(before_bytes));
    for (const std::vector<std::string>& verb : std::vector<std::vector<std::string>>{
             {"retarget", "--display-luminance", "5"}, {"resaturate", "--black", "1,1,1"}}) {
      for (const std::string result : {"b.jpg", "b.png", "b.tif"}) {
        std::vector<std::string> words{verb[0], file(source), "-o", file(result), "--force", "--quiet"};
        words.insert(words.end(), verb.begin() + 1, verb.end());
        run(words);
        const auto bytes = bytes_of_file(file(result));
        const Directories after = directories_of(result == "b.tif" ? bytes : exif_of(bytes));
        for (const std::uint16_t id : {271, 272, 315, 33432}) {
          EXPECT_EQ(after.main.at(id), before.main.at(id)) << verb[0] << " " << source << " " << result << " " << id;
        }
        for (const std::uint16_t id : {33434, 42034, 42036, 37383}) {
          ASSERT_TRUE(after.exif.contains(id)) << source << " " << result << " " << id;
          const auto &was = before.exif.at(id).numbers, &is = after.exif.at(id).numbers;
          if (id == 33434) {  // libtiff rounds the time to a float
            EXPECT_NEAR(is[0] / is[1], was[0] / was[1], 2e-7 * was[0] / was[1]);
          } else {
            EXPECT_EQ(is, was) << source << " " << result << " " << id;
          }
        }
        EXPECT_EQ(after.gps, before.gps) << source << " " << result;
      }
    }
  }
}

TEST_F(SourceTagsCommand, ExiftoolAgreesWhereItIsInstalled) {
  if (!std::filesystem::exists("/usr/bin/exiftool")) GTEST_SKIP() << "exiftool is not installed";
  write("a.dng", source_dng(true));
  run({"denoise", file("a.dng"), "-o", file("clean.dng"), "--quiet"});
  const std::vector<std::string> words{"/usr/bin/exiftool",  "-n",           "-s3",
                                       "-LensModel",         "-GPSLatitude", "-LensInfo",
                                       "-UniqueCameraModel", "-DNGLensInfo", "-warning"};
  std::vector<std::string> before = words, after = words;
  before.push_back(file("a.dng"));
  after.push_back(file("clean.dng"));
  const auto first = test::run_process(before), second = test::run_process(after);
  EXPECT_NE(first.out.find("A Lens 24-70"), std::string::npos);
  EXPECT_EQ(first.out, second.out);
}

TEST_F(SourceTagsCommand, BaselineExposureAddsToAGivenExposureOfImagesToBeLookedAt) {
  DngBuilder dng;
  dng.width = 192, dng.height = 128;
  write("plain.dng", dng.build());
  write("bright.dng", dng.set(50730, Tag::rationals(TagType::srational, {{3, 2}})).build());
  write("extreme.dng", dng.set(50730, Tag::rationals(TagType::srational, {{99, 1}})).build());
  const auto developed = [&](const std::string& raw, const std::vector<std::string>& more) {
    std::vector<std::string> words{"develop", file(raw), "-o", file("out.png"), "--force", "--quiet"};
    if (!more.empty() && more.front() == "--space") words[3] = file("out.tif");
    words.insert(words.end(), more.begin(), more.end());
    run(words);
    return bytes_of_file(words[3]);
  };
  const auto at = [&](const std::string& raw, const std::string& ev) { return developed(raw, {"--exposure", ev}); };
  EXPECT_EQ(at("bright.dng", "-1"), at("plain.dng", "0.5"));
  EXPECT_NE(at("bright.dng", "-1"), at("plain.dng", "-1"));
  EXPECT_EQ(at("extreme.dng", "0"), at("plain.dng", "12"));
  EXPECT_EQ(developed("bright.dng", {"--exposure", "0", "--baseline-exposure", "off"}), at("plain.dng", "0"));
  EXPECT_EQ(developed("bright.dng", {}), developed("plain.dng", {})) << "the automatic exposure measures the image";
  const std::vector<std::string> linear{"--space", "linear-srgb", "--bits", "32"};
  EXPECT_EQ(developed("bright.dng", linear), developed("plain.dng", linear));
}

TEST_F(SourceTagsCommand, DamagedTagsAreLeftOutWithAWarning) {
  DngBuilder dng;
  dng.width = 192, dng.height = 128;
  auto bytes = dng.set(700, Tag::opaque(std::vector<std::byte>(1000, std::byte{1}))).build();
  const std::size_t entry = TiffFile::open(bytes)->directory(8)->find({700, "XMP"})->place;
  for (std::size_t i = 0; i < 4; ++i) bytes[entry + 8 + i] = std::byte{0x7F};  // beyond the end
  write("a.dng", bytes);
  const auto result = lowlux({"develop", file("a.dng"), "-o", file("a.jpg")});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("tag 700 is not copied: its values lie beyond"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace lowlux
