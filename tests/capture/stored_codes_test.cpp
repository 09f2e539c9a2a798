// DNGs of integers in strips and tiles, deflated, colour after colour, and in BigTIFFs: each is read as the same
// samples in one strip. Broken ones are one clear line and take no memory.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "isp/base/source_tags.h"
#include "isp/codec/lossless_jpeg.h"
#include "tests/capture/read_built.h"
#include "tests/support/dng/code_dng.h"
#include "tests/support/dng/float_dng.h"
#include "tests/support/peak_memory.h"

namespace lowlux::capture {
namespace {

using test::code_dng;
using test::CodeStore;
using test::DngBuilder;
using test::DngStorage;
using test::has;
using test::Tag;
using test::TagType;

constexpr unsigned seed = 20261;

class Draw {
 public:
  explicit Draw(unsigned index) : random_(seed + index) {}
  int below(int end) { return static_cast<int>(random_() % static_cast<unsigned>(end)); }
  bool coin() { return below(2) == 1; }
  int log_uniform(int least, int most) {
    const double unit = (static_cast<double>(random_()) + 0.5) / 4294967296.0;
    return std::clamp(static_cast<int>(least * std::pow((most + 1.0) / least, unit)), least, most);
  }
  Plane<std::uint16_t> codes(int width, int height, int bits) {
    Plane<std::uint16_t> out(width, height);
    for (std::size_t i = 0; i < out.size(); ++i) out.data()[i] = static_cast<std::uint16_t>(random_() >> (32 - bits));
    return out;
  }

 private:
  std::mt19937 random_;
};

std::vector<std::uint16_t> all_of(const Plane<std::uint16_t>& codes) {
  return {codes.data(), codes.data() + codes.size()};
}

struct Drawn {
  Plane<std::uint16_t> codes;
  CodeStore how;
  DngBuilder dng;
  std::string text;
};

/// Draws sides log-uniformly from 1 to 5000 for up to 200,000 pixels, and up to about 1000 strips or tiles.
Drawn drawn(unsigned index) {
  Draw draw(index);
  CodeStore how;
  how.samples = draw.coin() ? 1 : 3;
  how.deflate = draw.coin();
  how.bits = how.deflate ? 8 + 8 * draw.below(2) : std::array{8, 10, 12, 14, 16, 9, 15}[draw.below(7)];
  how.predictor = how.deflate ? std::array{1, 2, 34892, 34893}[draw.below(4)] : 1;
  how.planar = how.samples == 3 && draw.coin();
  how.big_endian = draw.coin();
  const int longer = draw.log_uniform(1, 5000), other = draw.log_uniform(1, std::min(5000, 200'000 / longer));
  const int width = index % 2 == 0 ? longer : other, height = index % 2 == 0 ? other : longer;
  if (draw.coin()) how.tile_width = draw.log_uniform(1 + width / 32, std::min(4096, 2 * width + 16));
  how.rows = draw.log_uniform(1 + height / 32, std::min(4096, 2 * height));
  Drawn out{draw.codes(width * how.samples, height, how.bits), how, {}, {}};
  out.dng = code_dng(out.codes, how);
  out.dng.part_gap = draw.below(3);
  out.dng.parts_reversed = draw.coin();
  out.dng.big_tiff = draw.below(4) == 0;
  out.text = std::to_string(width) + " x " + std::to_string(height) + " x " + std::to_string(how.samples) + ", " +
             std::to_string(how.bits) + " bits, predictor " + std::to_string(how.predictor) +
             (how.deflate ? ", deflated" : "") + (how.planar ? ", planar" : "") +
             (how.big_endian ? ", big endian" : "") + ", tiles of " + std::to_string(how.tile_width) + ", rows " +
             std::to_string(how.rows) + ", seed " + std::to_string(seed + index);
  return out;
}

TEST(StoredCodes, EveryStorageIsReadAsTheSameSamplesInOneStrip) {
  int strips_compared = 0;
  for (unsigned i = 0; i < 120; ++i) {
    const Drawn now = drawn(i);
    const RawFrame frame = test::read_built(now.dng);
    ASSERT_EQ(frame.raw.dn.width(), now.codes.width()) << now.text;
    ASSERT_EQ(test::samples_of(frame), all_of(now.codes)) << now.text;
    EXPECT_TRUE(frame.warnings.empty()) << now.text;
    const CodeStore one{.bits = now.how.bits, .samples = now.how.samples, .big_endian = now.how.big_endian};
    const RawFrame strip = test::read_built(code_dng(now.codes, one));
    ASSERT_EQ(test::samples_of(strip), test::samples_of(frame)) << now.text;
    EXPECT_EQ(strip.raw.white_dn, frame.raw.white_dn);
    EXPECT_EQ(strip.raw.layout, frame.raw.layout);
    ++strips_compared;
  }
  EXPECT_EQ(strips_compared, 120);
}

TEST(StoredCodes, LosslessJpegInAnyStripsOrTilesIsReadAsStored) {
  for (unsigned i = 0; i < 160; ++i) {
    Draw draw(1000 + i);
    DngBuilder dng;
    dng.samples = draw.coin() ? 1 : 3;
    dng.monochrome = dng.samples == 1 && draw.coin();
    dng.bits = 8 + draw.below(9);
    dng.big_endian = draw.coin();
    dng.big_tiff = draw.below(4) == 0;
    dng.width = draw.log_uniform(1, 1500);
    dng.height = draw.log_uniform(1, std::max(1, std::min(1500, 60'000 / dng.width)));
    dng.storage = draw.coin() ? DngStorage::lossless_jpeg : DngStorage::tiled_lossless_jpeg;
    dng.tile_width = 2 * draw.log_uniform(1 + dng.width / 64, dng.width + 8);
    dng.tile_height = draw.log_uniform(1 + dng.height / 32, 2 * dng.height);
    dng.rows_per_strip = i % 5 == 0 ? (dng.height + 3) / 4 : draw.log_uniform(1, dng.height);
    const bool is_tiled = dng.storage == DngStorage::tiled_lossless_jpeg;
    dng.jpeg_components = (is_tiled || dng.width % 2 == 0) && draw.coin() ? 2 : 1;
    dng.raw_in_sub_ifd = draw.coin();
    dng.part_gap = 2 * draw.below(3);
    dng.parts_reversed = draw.coin();
    ASSERT_EQ(test::samples_of(test::read_built(dng)), test::ramp(dng))
        << dng.width << " x " << dng.height << " x " << dng.samples << (dng.monochrome ? " monochrome, " : ", ")
        << dng.bits << " bits, " << (is_tiled ? "tiles of " : "strips, ") << dng.tile_width << " x " << dng.tile_height
        << ", rows " << dng.rows_per_strip << ", " << dng.jpeg_components << " components, seed " << seed + 1000 + i;
  }
}

/// Returns a lossless JPEG in which every difference is 32768, with a code of one bit, which 16 bits follow in DNG 1.0.
std::vector<std::byte> jpeg_of_32768(int columns, int lines, bool is_dng_1_0) {
  std::vector<int> bytes{0xFF, 0xD8, 0xFF, 0xC4, 0, 20, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 16};
  for (const int byte : {0xFF, 0xC3, 0, 11, 16, 0, lines, 0, columns, 1, 1, 0x11, 0}) bytes.push_back(byte);
  for (const int byte : {0xFF, 0xDA, 0, 8, 1, 1, 0, 1, 0, 0}) bytes.push_back(byte);
  std::string bits;
  for (int i = 0; i < columns * lines; ++i) bits += is_dng_1_0 ? "01000000000000000" : "0";
  bits.resize((bits.size() + 7) / 8 * 8, '1');
  for (std::size_t i = 0; i < bits.size(); i += 8) bytes.push_back(std::stoi(bits.substr(i, 8), nullptr, 2));
  std::vector<std::byte> out;
  for (const int byte : bytes) out.push_back(static_cast<std::byte>(byte));
  return out;
}

/// LibRaw reads one strip, and lowlux two.
TEST(StoredCodes, TheDifferenceOf32768IsReadAsTheVersionOfTheDngWritesIt) {
  for (const int version : {0, 1, 4}) {
    for (const int strips : {1, 2}) {
      DngBuilder dng;
      dng.set(50706, Tag::numbers(TagType::byte, {1.0, static_cast<double>(version), 0, 0}));
      dng.storage = DngStorage::lossless_jpeg;
      dng.rows_per_strip = 24 / strips;
      dng.stored_parts.assign(strips, jpeg_of_32768(24, 24 / strips, version == 0));
      const std::vector<std::uint16_t> samples = test::samples_of(test::read_built(dng));
      ASSERT_EQ(samples.size(), std::size_t{24} * 24);
      for (int i = 0; i < 24 * 24; ++i) {
        ASSERT_EQ(samples[i], (i / 24 + i % 24) % 2 == 0 ? 0 : 32768) << "1." << version << ", " << strips << " strips";
      }
    }
  }
}

/// LibRaw 0.20 shifts the rows of a tile that is wider than the image, and leaves half of a monochrome tile black.
TEST(StoredCodes, LosslessJpegThatLibRawMisplacesIsReadAsStored) {
  for (const bool monochrome : {false, true}) {
    for (const int samples : {1, monochrome ? 1 : 3}) {
      DngBuilder dng;
      dng.width = 75, dng.height = 50, dng.bits = 12;
      dng.samples = samples;
      dng.monochrome = monochrome;
      dng.storage = DngStorage::tiled_lossless_jpeg;
      for (const int tile : {16, 48, 80, 96}) {
        dng.tile_width = dng.tile_height = tile;
        EXPECT_EQ(test::samples_of(test::read_built(dng)), test::ramp(dng))
            << tile << ", " << samples << ", " << monochrome;
      }
    }
  }
}

TEST(StoredCodes, LosslessJpegColourAfterColourIsReadAsStored) {
  const auto codes = Draw(6).codes(90, 30, 14);
  DngBuilder dng = code_dng(codes, {.bits = 14, .samples = 3, .rows = 11, .planar = true});
  dng.storage = DngStorage::lossless_jpeg;
  dng.stored_parts.clear();
  for (int c = 0; c < 3; ++c) {
    for (int top = 0; top < 30; top += 11) {
      Plane<std::uint16_t> part(30, std::min(11, 30 - top));
      for (std::size_t i = 0; i < part.size(); ++i) part.data()[i] = codes.data()[90 * top + 3 * i + c];
      dng.stored_parts.push_back(isp::encode_lossless_jpeg(part.view(), 1, 14));
    }
  }
  EXPECT_EQ(test::samples_of(test::read_built(dng)), all_of(codes));
}

TEST(StoredCodes, ALinearizationTableIsAppliedAsToOneStrip) {
  std::vector<double> table(200);
  for (std::size_t i = 0; i < table.size(); ++i) table[i] = static_cast<double>(i * i);
  for (const int samples : {1, 3}) {
    const auto codes = Draw(7).codes(40 * samples, 30, 8);
    const auto with_table = [&](const CodeStore& how) {
      DngBuilder dng = code_dng(codes, how);
      dng.set(50712, Tag::numbers(TagType::u16, table));
      dng.set(50717, Tag::numbers(TagType::u32, std::vector<double>(samples, 39601)));
      return test::samples_of(test::read_built(dng));
    };
    const auto strip = with_table({.bits = 8, .samples = samples});
    EXPECT_EQ(strip[5], table[std::min<std::size_t>(codes.data()[5], 199)]);
    EXPECT_EQ(with_table({.bits = 8, .samples = samples, .tile_width = 16, .rows = 16}), strip);
    EXPECT_EQ(with_table({.bits = 8, .samples = samples, .deflate = true, .predictor = 2}), strip);
  }
}

TEST(StoredCodes, ABigTiffHasNoMoreTagsThanAClassicOne) {
  constexpr std::size_t tags = 65536;
  std::vector<std::byte> file(16 + 8 + 20 * tags + 8);
  const auto put = [&](std::size_t at, const std::vector<int>& bytes) {
    for (const int byte : bytes) file[at++] = static_cast<std::byte>(byte);
  };
  put(0, {'I', 'I', 43, 0, 8, 0, 0, 0, 16});
  put(16, {0, 0, 1});
  EXPECT_TRUE(has(test::refused(file), "has 65536 tags"));
}

TEST(StoredCodes, StripsWithBytesAfterTheirRowsAreNotShifted) {
  const auto codes = Draw(8).codes(30, 24, 12);
  DngBuilder dng = code_dng(codes, {.bits = 12, .rows = 7});
  for (auto& part : dng.stored_parts) part.resize(part.size() + 3);
  EXPECT_EQ(test::samples_of(test::read_built(dng)), all_of(codes));
}

TEST(StoredCodes, BigTiffIsReadWithItsTags) {
  const auto codes = Draw(9).codes(40, 30, 14);
  for (const bool big_endian : {false, true}) {
    DngBuilder dng = code_dng(codes, {.bits = 14, .rows = 11, .big_endian = big_endian});
    dng.set(33434, Tag::rationals(TagType::rational, {{1, 30}}));
    dng.set(42036, Tag::text("A lens of 50 mm"));
    dng.set(33432, Tag::text("Photographer"));
    dng.set(50714, Tag::rationals(TagType::rational, {{129, 2}}));
    const RawFrame classic = test::read_built(dng);
    dng.big_tiff = true;
    dng.raw_in_sub_ifd = true;
    const RawFrame frame = test::read_built(dng);
    EXPECT_EQ(test::samples_of(frame), all_of(codes));
    EXPECT_EQ(frame.raw.info.exposure_s, 1.0 / 30);
    EXPECT_EQ(frame.raw.black_tag->pattern_dn, std::vector<double>{64.5});
    EXPECT_EQ(frame.colour.calibrations.size(), 1u);
    ASSERT_TRUE(frame.source_tags && classic.source_tags);
    EXPECT_EQ(text_of(frame.source_tags->exif, 42036), "A lens of 50 mm");
    EXPECT_EQ(text_of(frame.source_tags->main, 33432), "Photographer");
    EXPECT_EQ(bytes_of(*frame.source_tags), bytes_of(*classic.source_tags));
  }
  Plane<std::uint32_t> ones(30, 20);
  std::fill_n(ones.data(), ones.size(), 0x3F800000U);
  DngBuilder floats = test::float_dng(ones, {.deflate = true, .predictor = 3});
  floats.big_tiff = true;
  EXPECT_EQ(test::read_built(floats).raw.dn_float.at(29, 19), 1.0F);
}

TEST(StoredCodes, WhatIsNotSupportedIsNamed) {
  const auto codes = Draw(10).codes(32, 30, 12);
  const auto predicted = [&](int bits, double predictor) {
    DngBuilder dng = code_dng(codes, {.bits = bits, .deflate = true});
    return test::refused(dng.set(317, Tag::numbers(TagType::u16, {predictor})));
  };
  EXPECT_TRUE(has(predicted(16, 3), "predictor 3 of integers is not supported"));
  EXPECT_TRUE(has(predicted(12, 2), "integers of 12 bits are not supported"));
  for (const auto& [compression, samples] : {std::pair{34892, 3}, {52546, 3}}) {
    DngBuilder dng = code_dng(Draw(11).codes(90, 30, 8), {.bits = 8, .samples = samples, .planar = true});
    dng.set(259, Tag::numbers(TagType::u16, {static_cast<double>(compression)}));
    EXPECT_TRUE(
        has(test::refused(dng), "colour after colour are supported without compression, in lossless JPEG or with"));
  }
}

TEST(StoredCodes, DamagedStorageIsOneClearLine) {
  const auto codes = Draw(12).codes(40, 40, 16);
  const CodeStore tiles{.tile_width = 16, .rows = 16}, deflated{.deflate = true, .predictor = 2, .rows = 9};
  const auto numbers = [](const std::vector<double>& values) { return Tag::numbers(TagType::u32, values); };
  DngBuilder fewer = code_dng(codes, tiles);
  fewer.stored_parts.pop_back();
  EXPECT_TRUE(has(test::refused(fewer), "needs 9 strips or tiles, the file has 8"));
  DngBuilder brief = code_dng(codes, tiles);
  brief.stored_parts[4].resize(511);
  EXPECT_TRUE(has(test::refused(brief), "511 bytes, too few for 512"));
  DngBuilder beyond = code_dng(codes, tiles);
  EXPECT_TRUE(has(test::refused(beyond.set(324, numbers(std::vector<double>(9, 1e6)))), "reaches to byte"));
  for (const std::uint16_t id : {322, 323}) {
    for (const double side : {0.0, 1e9}) {
      DngBuilder dng = code_dng(codes, tiles);
      EXPECT_EQ(test::refused(dng.set(id, numbers({side}))).code, ErrorCode::malformed);
    }
  }
  DngBuilder no_rows = code_dng(codes, deflated);
  EXPECT_TRUE(has(test::refused(no_rows.set(278, numbers({0}))), "have no pixels"));
  DngBuilder overlap = code_dng(codes, tiles);
  overlap.set(324, numbers({100, 200, 300, 400, 500, 600, 700, 800, 900}));
  EXPECT_TRUE(has(test::refused(overlap), "overlap"));
  DngBuilder planes = code_dng(Draw(13).codes(90, 30, 16), {.samples = 3, .planar = true});
  planes.stored_parts.pop_back();
  EXPECT_TRUE(has(test::refused(planes), "needs 3 strips or tiles, the file has 2"));
  DngBuilder cut = code_dng(codes, deflated);
  cut.stored_parts[1].resize(cut.stored_parts[1].size() / 2);
  EXPECT_TRUE(has(test::refused(cut), "from column 0, row 9 on do not decode"));
  DngBuilder flipped = code_dng(codes, deflated);
  flipped.stored_parts[4][flipped.stored_parts[4].size() / 2] ^= std::byte{1};
  EXPECT_TRUE(has(test::refused(flipped), "row 36 on do not decode"));
  DngBuilder strips;
  strips.storage = DngStorage::lossless_jpeg;
  strips.rows_per_strip = 8;
  EXPECT_TRUE(has(test::refused(strips.remove(278)), "from column 0, row 0 on do not decode"));
  DngBuilder other;  // one strip, which is for LibRaw
  other.storage = DngStorage::lossless_jpeg;
  other.stored_parts = {std::vector<std::byte>(2000, std::byte{0x12})};
  EXPECT_TRUE(has(test::refused(other), "from column 0, row 0 on do not decode"));
  for (const DngStorage storage : {DngStorage::lossless_jpeg, DngStorage::tiled_lossless_jpeg}) {
    for (const double missing : {1, 12}) {  // rows that the parts of the last rows do not have
      DngBuilder low;
      low.storage = storage;
      low.width = low.height = 32;
      low.rows_per_strip = storage == DngStorage::lossless_jpeg && missing > 1 ? 16 : 0;
      low.set(257, Tag::numbers(TagType::u32, {32 + missing}));
      low.set(278, Tag::numbers(TagType::u32, {missing > 1 ? 16 + missing / 2 : 32 + missing}));
      low.set(323, Tag::numbers(TagType::u32, {16 + std::ceil(missing / 2)}));
      EXPECT_TRUE(has(test::refused(low), "on do not decode")) << missing;
    }
  }
}

/// Returns the file with the count of values of a tag of its first directory replaced.
std::vector<std::byte> with_count(const DngBuilder& dng, std::uint16_t id, std::uint64_t count) {
  std::vector<std::byte> file = dng.build();
  const std::size_t step = dng.big_tiff ? 20 : 12;
  for (std::size_t at = dng.big_tiff ? 24 : 10; at + step < file.size(); at += step) {
    if (std::to_integer<int>(file[at]) + 256 * std::to_integer<int>(file[at + 1]) != id) continue;
    for (std::size_t i = 0; i < (dng.big_tiff ? 8 : 4); ++i)
      file[at + 4 + i] = static_cast<std::byte>(count >> 8 * i & 255);
    return file;
  }
  ADD_FAILURE() << "no tag " << id;
  return file;
}

TEST(StoredCodes, CountsAndSizesBeyondTheFileTakeNoMemory) {
  const std::int64_t idle = test::peak_bytes([] {});
  const auto refused_in_little = [&](const std::vector<std::byte>& file) {
    const std::int64_t peak = test::peak_bytes([&] { EXPECT_FALSE(test::refused(file).message.empty()); });
    EXPECT_LT(peak, idle + (std::int64_t{24} << 20));
  };
  const auto codes = Draw(14).codes(40, 40, 16);
  for (const bool big_tiff : {false, true}) {
    DngBuilder dng = code_dng(codes, {.tile_width = 16, .rows = 16});
    dng.big_tiff = big_tiff;
    for (const std::uint16_t id : {324, 325}) {
      refused_in_little(with_count(dng, id, 1'000'000'000));
      refused_in_little(with_count(dng, id, 4'000'000));
      if (big_tiff) refused_in_little(with_count(dng, id, 0x2000000000000001U));
    }
    for (const bool deflate : {false, true}) {
      DngBuilder vast = code_dng(codes, {.deflate = deflate});
      vast.big_tiff = big_tiff;
      for (const std::uint16_t id : {256, 257, 278}) vast.set(id, Tag::numbers(TagType::u32, {19000}));
      refused_in_little(vast.build());
    }
  }
}

TEST(StoredCodes, EveryTruncationIsAnError) {
  for (const bool big_tiff : {false, true}) {
    DngBuilder dng = code_dng(Draw(15).codes(30, 24, 12), {.bits = 12, .tile_width = 16, .rows = 16});
    dng.big_tiff = big_tiff;
    const auto bytes = dng.build();
    for (std::size_t size = 0; size < bytes.size(); size += 3) {
      EXPECT_FALSE(test::read_bytes({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)})) << size;
    }
  }
}

}  // namespace
}  // namespace lowlux::capture
