// EXIF and GPS tags of raw formats other than DNG: constructed files, compared with what was written, and with what
// exiftool reads from them and from the DNG that their tags are passed on to.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "capture/dng/source_tags.h"
#include "isp/output/dng/dng_writer.h"
#include "tests/support/dng/tiff_writer.h"
#include "tests/support/frames.h"
#include "tests/support/process.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::exif_blocks_test {
namespace {

using test::Tag;
using test::TagDirectory;
using test::TagType;
using Bytes = std::vector<std::byte>;

Bytes bytes_of_text(std::string_view text) {
  Bytes out(text.size());
  std::memcpy(out.data(), text.data(), text.size());
  return out;
}

void append(Bytes& to, const Bytes& bytes) { to.insert(to.end(), bytes.begin(), bytes.end()); }

struct Camera {
  TagDirectory main, exif, gps;
};

Camera camera(const char* make, const char* model) {
  Camera out;
  out.main[271] = Tag::text(make);
  out.main[272] = Tag::text(model);
  out.main[274] = Tag::numbers(TagType::u16, {6});
  out.main[315] = Tag::text("An Author");
  out.main[33432] = Tag::text("(c) An Author");
  out.exif[33434] = Tag::rationals(TagType::rational, {{1, 60}});
  out.exif[33437] = Tag::rationals(TagType::rational, {{28, 10}});
  out.exif[34855] = Tag::numbers(TagType::u16, {1600});
  out.exif[36867] = Tag::text("2024:02:03 04:05:06");
  out.exif[37383] = Tag::numbers(TagType::u16, {5});
  out.exif[37386] = Tag::rationals(TagType::rational, {{50, 1}});
  out.exif[37500] = Tag::opaque(bytes_of_text("maker's note with offsets of its own file"));
  out.exif[42034] = Tag::rationals(TagType::rational, {{24, 1}, {70, 1}, {28, 10}, {28, 10}});
  out.exif[42036] = Tag::text("A Lens 24-70mm F2.8");
  out.exif[42037] = Tag::text("L0000017");
  out.gps[1] = Tag::text("N");
  out.gps[2] = Tag::rationals(TagType::rational, {{48, 1}, {51, 1}, {296137, 10007}});
  out.gps[3] = Tag::text("E");
  out.gps[4] = Tag::rationals(TagType::rational, {{2, 1}, {17, 1}, {40, 1}});
  return out;
}

/// A TIFF structure with another mark, if any, of these directories, and a JPEG image in a tag of RW2.
Bytes tiff_of(const Camera& of, bool big_endian, std::uint16_t mark = 42, const Bytes& jpeg = {}) {
  test::ByteWriter header(big_endian);
  header.append(bytes_of_text(big_endian ? "MM" : "II"));
  header.number(mark, 2);
  header.number(8, 4);
  TagDirectory main = of.main;
  if (!jpeg.empty()) main[0x2E] = Tag::opaque(jpeg);
  if (!of.exif.empty()) main[34665] = Tag::numbers(TagType::u32, {0});
  if (!of.gps.empty()) main[34853] = Tag::numbers(TagType::u32, {0});
  const auto end = [&](std::size_t at, const TagDirectory& directory) {
    const std::size_t size = at + test::encode_directory(directory, at, big_endian).size();
    return size + size % 2;
  };
  const std::size_t exif = end(8, main), gps = end(exif, of.exif);
  if (!of.exif.empty()) main[34665] = Tag::numbers(TagType::u32, {static_cast<double>(exif)});
  if (!of.gps.empty()) main[34853] = Tag::numbers(TagType::u32, {static_cast<double>(gps)});
  Bytes out = header.out;
  append(out, test::encode_directory(main, 8, big_endian));
  out.resize(exif);
  if (!of.exif.empty()) append(out, test::encode_directory(of.exif, exif, big_endian));
  out.resize(std::max(out.size(), gps));
  if (!of.gps.empty()) append(out, test::encode_directory(of.gps, gps, big_endian));
  return out;
}

Bytes jpeg_of(const Bytes& tiff) {
  test::ByteWriter out(true);
  out.number(0xFFD8FFE0, 4);  // an APP0 comes first
  out.number(16, 2);
  out.append(bytes_of_text(std::string_view("JFIF\0\1\1\0\0\1\0\1\0\0", 14)));
  out.number(0xFFFFFFE1, 4);  // two fill bytes (ITU T.81, B.1.1.2)
  out.number(2 + 6 + tiff.size(), 2);
  out.append(bytes_of_text(std::string_view("Exif\0\0", 6)));
  out.append(tiff);
  out.number(0xFFD9, 2);
  return out.out;
}

Bytes raf_of(const Bytes& jpeg) {
  Bytes out = bytes_of_text("FUJIFILMCCD-RAW 0201FF383501X-T2");
  out.resize(84);
  test::ByteWriter directory(true);
  directory.number(148, 4);
  directory.number(jpeg.size(), 4);
  for (int i = 0; i < 4; ++i) directory.number(148 + jpeg.size(), 4);
  append(out, directory.out);
  out.resize(148);
  append(out, jpeg);
  out.resize(out.size() + 64);
  return out;
}

Bytes box(std::string_view type, const Bytes& content) {
  test::ByteWriter out(true);
  out.number(8 + content.size(), 4);
  out.append(bytes_of_text(type));
  out.append(content);
  return out.out;
}

Bytes cr3_of(const Camera& of) {
  const auto only = [](const TagDirectory& directory) { return tiff_of({directory, {}, {}}, false); };
  Bytes canon = bytes_of_text("\x85\xC0\xB6\x87\x82\x0F\x11\xE0\x81\x11\xF4\xCE\x46\x2B\x6A\x48");
  append(canon, box("CNCV", bytes_of_text("CanonCR3_001/00.09.00/00.00.00")));
  append(canon, box("CMT1", only(of.main)));
  append(canon, box("CMT2", only(of.exif)));
  append(canon, box("CMT3", only({{1, Tag::numbers(TagType::u16, {2, 0})}})));
  append(canon, box("CMT4", only(of.gps)));
  Bytes out = box("ftyp", bytes_of_text(std::string_view("crx \0\0\0\1crx isom", 16)));
  append(out, box("moov", box("uuid", canon)));
  append(out, box("mdat", Bytes(64)));
  return out;
}

struct Format {
  const char* name;
  Bytes file;
};

std::vector<Format> formats() {
  Camera panasonic = camera("Panasonic", "DC-G9");
  Camera outer = panasonic;
  outer.exif = {{33434, panasonic.exif[33434]}, {42036, Tag::text("Of the outer directory")}};
  outer.gps.clear();
  const Bytes rw2 = tiff_of(outer, false, 0x55, jpeg_of(tiff_of(panasonic, false)));
  return {{"a.cr2", tiff_of(camera("Canon", "Canon EOS 6D"), false)},
          {"a.nef", tiff_of(camera("NIKON CORPORATION", "NIKON D750"), true)},
          {"a.arw", tiff_of(camera("SONY", "ILCE-7M3"), false)},
          {"a.orf", tiff_of(camera("OLYMPUS IMAGING CORP.", "E-M5"), false, 0x4F52)},
          {"s.orf", tiff_of(camera("OLYMPUS IMAGING CORP.", "E-M5"), false, 0x5352)},
          {"m.orf", tiff_of(camera("OLYMPUS IMAGING CORP.", "E-M5"), true, 0x4F52)},
          {"a.rw2", rw2},
          {"a.raf", raf_of(jpeg_of(tiff_of(camera("FUJIFILM", "X-T2"), false)))},
          {"a.cr3", cr3_of(camera("Canon", "Canon EOS R"))}};
}

const SourceTag* find(const std::vector<SourceTag>& tags, std::uint16_t id) {
  const auto at = std::find_if(tags.begin(), tags.end(), [id](const SourceTag& tag) { return tag.id == id; });
  return at == tags.end() ? nullptr : &*at;
}

std::string text_of(const SourceTag* tag) {
  if (tag == nullptr) return "absent";
  return {reinterpret_cast<const char*>(tag->values.data()), tag->values.size() - 1};
}

TEST(ExifBlocks, AuthorLensAndPlaceAreFoundInEveryFormat) {
  for (const auto& [name, file] : formats()) {
    std::vector<std::string> warnings;
    const auto tags = capture::raw_source_tags(file, warnings);
    ASSERT_TRUE(tags) << name;
    EXPECT_EQ(text_of(find(tags->main, 315)), "An Author") << name;
    EXPECT_EQ(text_of(find(tags->exif, 42037)), "L0000017") << name;
    const bool is_rw2 = name == std::string_view("a.rw2");
    EXPECT_EQ(text_of(find(tags->exif, 42036)), is_rw2 ? "Of the outer directory" : "A Lens 24-70mm F2.8") << name;
    EXPECT_EQ(std::count_if(tags->exif.begin(), tags->exif.end(), [](const auto& t) { return t.id == 42036; }), 1);
    const SourceTag* latitude = find(tags->gps, 2);
    ASSERT_NE(latitude, nullptr) << name;
    EXPECT_EQ(capture::load_u32(latitude->values.data() + 16, false), 296137U) << name;
    EXPECT_EQ(find(tags->exif, 37500), nullptr) << name << ": maker notes refer to places in their file";
    EXPECT_EQ(find(tags->exif, 33434), nullptr) << name << ": FrameInfo states the exposure time";
    EXPECT_TRUE(warnings.empty()) << name << warnings.front();
  }
}

TEST(ExifBlocks, OtherFilesHaveNone) {
  std::vector<std::string> warnings;
  for (const Bytes& file : {Bytes{}, Bytes(100, std::byte{'a'}), jpeg_of(tiff_of(camera("A", "B"), true)),
                            bytes_of_text("FUJIFILMCCD-RAW "), box("ftyp", bytes_of_text("crx "))}) {
    EXPECT_EQ(capture::raw_source_tags(file, warnings), nullptr);
  }
  EXPECT_TRUE(warnings.empty());
}

// Any byte may be any other, and any end may be missing: nothing outside the file is read (the sanitizers watch).
TEST(ExifBlocks, DamagedFilesGiveWhatIsWhole) {
  constexpr unsigned seed = 11;
  std::mt19937 draw(seed);
  for (const auto& [name, file] : formats()) {
    for (int i = 0; i < 400; ++i) {
      Bytes damaged = file;
      for (unsigned n = draw() % 8; n > 0; --n) damaged[draw() % damaged.size()] = static_cast<std::byte>(draw());
      damaged.resize(damaged.size() - draw() % 2 * (draw() % damaged.size()));
      std::vector<std::string> warnings;
      const auto tags = capture::raw_source_tags(damaged, warnings);
      EXPECT_LE(tags ? bytes_of(*tags) : 0, std::size_t{64} << 20) << name << " seed " << seed << " draw " << i;
    }
  }
}

// Lines "group:tag: value" of exiftool's groups ExifIFD and GPS, numbers unrounded.
std::map<std::string, std::string> exiftool(const std::string& file) {
  const auto result = test::run_process(
      {"/usr/bin/exiftool", "-n", "-G1", "-s", "-ExifIFD:all", "-GPS:all", "-IFD0:Artist", "-IFD0:Copyright", file});
  std::map<std::string, std::string> out;
  for (std::size_t at = 0; at < result.out.size();) {
    const std::size_t end = std::min(result.out.find('\n', at), result.out.size());
    const std::string line = result.out.substr(at, end - at);
    at = end + 1;
    const std::size_t colon = line.find(": ");
    if (colon == std::string::npos) continue;
    std::string key = line.substr(0, colon);
    key.erase(std::remove(key.begin(), key.end(), ' '), key.end());
    out[key] = line.substr(colon + 2);
  }
  return out;
}

TEST(ExifBlocks, ExiftoolReadsTheSameTagsFromTheDngThatTheyArePassedOnTo) {
  if (!std::filesystem::exists("/usr/bin/exiftool")) GTEST_SKIP() << "exiftool is not installed";
  const test::ScratchDirectory scratch;
  for (const auto& [name, file] : formats()) {
    if (name == std::string_view("a.rw2")) continue;  // exiftool names the tags of its two directories alike
    const std::string source = scratch.file(name), copy = scratch.file(std::string(name) + ".dng");
    test::write_file(source, file.data(), file.size());
    RawFrame frame;
    frame.raw = test::bayer_frame(64, 64, BayerPhase::rggb, [](int x, int y) { return 100 + x + y; });
    frame.source_tags = capture::raw_source_tags(file, frame.warnings);
    ASSERT_TRUE(isp::write_dng(frame, copy));
    const auto before = exiftool(source), after = exiftool(copy);
    EXPECT_GE(before.size(), 12U) << name;
    EXPECT_TRUE(before.contains("[ExifIFD]LensModel")) << name;
    for (const auto& [tag, value] : before) {
      // Those of FrameInfo are the decoder's, and the maker note stays behind.
      const bool is_own = tag == "[ExifIFD]ExposureTime" || tag == "[ExifIFD]FNumber" || tag == "[ExifIFD]ISO" ||
                          tag == "[ExifIFD]DateTimeOriginal" || tag == "[ExifIFD]FocalLength" ||
                          tag.starts_with("[ExifIFD]MakerNote");
      if (is_own) continue;
      ASSERT_TRUE(after.contains(tag)) << name << tag;
      EXPECT_EQ(after.at(tag), value) << name << tag;
    }
  }
}

}  // namespace
}  // namespace lowlux::exif_blocks_test
