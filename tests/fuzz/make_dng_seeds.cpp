// Writes small files that together use every part of the reader: the corpus its fuzzers start from.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "tests/support/dng/code_dng.h"
#include "tests/support/dng/dng_builder.h"
#include "tests/support/dng/drawn_opcodes.h"
#include "tests/support/dng/float_dng.h"

namespace lowlux::test {
namespace {

Tag opcodes() {
  std::mt19937 draw(1);
  std::vector<Opcode> out{words(5, {0, 1, 1, 3, 4, 5, 6, 7, 8}), words(4, {0, 0})};  // defects
  for (const std::uint32_t id : {3U, 8U, 9U, 10U, 11U, 12U, 13U}) {
    out.push_back(draw_opcode(id, {.width = 28, .height = 25}, draw).encoded);
  }
  out.push_back(words(7, {0, 0, 24, 24, 0, 1, 1, 1, 2, 0x00008000}));  // MapTable of two entries
  out.push_back(words(6, {1, 2, 20, 24}));                             // TrimBounds
  return opcode_list(out);
}

DngBuilder plain(int bits) {
  DngBuilder dng;
  dng.bits = bits;
  return dng;
}

DngBuilder everything() {
  DngBuilder dng = plain(12);
  dng.width = 32, dng.height = 28;
  dng.raw_in_sub_ifd = true;
  dng.set(50829, Tag::numbers(TagType::u32, {2, 3, 27, 31}));
  dng.set(50830, Tag::numbers(TagType::u32, {2, 0, 27, 3}));
  dng.set(50719, Tag::numbers(TagType::u32, {1, 1}));
  dng.set(50720, Tag::numbers(TagType::u32, {26, 22}));
  dng.set(50713, Tag::numbers(TagType::u16, {2, 2}));
  dng.set(50714, Tag::numbers(TagType::rational, {64, 65.5, 66, 67}));
  dng.set(50715, Tag::numbers(TagType::srational, std::vector<double>(28, 0.5)));
  dng.set(50716, Tag::numbers(TagType::srational, std::vector<double>(25, -0.5)));
  dng.set(50722, Tag::numbers(TagType::srational, {0.9, -0.3, -0.1, -0.5, 1.3, 0.2, -0.1, 0.2, 0.6}));
  dng.set(50723, Tag::numbers(TagType::srational, {1, 0, 0, 0, 1, 0, 0, 0, 1}));
  dng.set(50727, Tag::numbers(TagType::rational, {1, 1, 1}));
  dng.set(50729, Tag::numbers(TagType::rational, {0.31, 0.33}));
  dng.set(50779, Tag::numbers(TagType::u16, {17}));
  dng.set(50964, Tag::numbers(TagType::srational, {0.6, 0.2, 0.16, 0.25, 0.7, 0.05, 0.01, 0.1, 0.71}));
  dng.set(51041, Tag::numbers(TagType::f64, {1e-4, 1e-7}));
  for (const std::uint16_t list : {51008, 51009, 51022}) dng.set(list, opcodes());
  dng.set(33434, Tag::rationals(TagType::rational, {{1, 30}}));
  dng.set(34855, Tag::numbers(TagType::u16, {3200}));
  dng.set(36867, Tag::text("2024:12:24 23:59:01"));
  return dng;
}

/// Adds integers in strips and tiles, deflated, colour after colour, and in BigTIFFs.
void add_stored_codes(std::vector<std::pair<std::string, DngBuilder>>& all) {
  const CodeStore stores[] = {{.bits = 10, .rows = 7},
                              {.bits = 12, .samples = 3, .tile_width = 16, .rows = 16},
                              {.bits = 8, .deflate = true, .predictor = 2, .rows = 9},
                              {.deflate = true, .predictor = 34893, .tile_width = 16, .rows = 16, .big_endian = true},
                              {.bits = 14, .samples = 3, .rows = 11, .planar = true}};
  for (const CodeStore& how : stores) {
    Plane<std::uint16_t> codes(26 * how.samples, 24);
    for (std::size_t i = 0; i < codes.size(); ++i) codes.data()[i] = static_cast<std::uint16_t>(i * 37 % 251);
    DngBuilder dng = code_dng(codes, how);
    dng.part_gap = 1;
    all.emplace_back("codes" + std::to_string(all.size()), dng);
    dng.big_tiff = true;
    all.emplace_back("big_codes" + std::to_string(all.size()), dng);
  }
}

std::vector<std::pair<std::string, DngBuilder>> seeds() {
  std::vector<std::pair<std::string, DngBuilder>> all;
  for (const int bits : {8, 10, 16}) all.emplace_back("plain" + std::to_string(bits), plain(bits));
  all.emplace_back("everything", everything());
  DngBuilder jpeg = plain(14);
  jpeg.storage = DngStorage::lossless_jpeg;
  all.emplace_back("jpeg", jpeg);
  DngBuilder jpeg_strips = jpeg;
  jpeg_strips.rows_per_strip = 7;
  all.emplace_back("jpeg_strips", jpeg_strips);
  add_stored_codes(all);
  DngBuilder tiles = jpeg;
  tiles.storage = DngStorage::tiled_lossless_jpeg;
  all.emplace_back("tiles", tiles);
  DngBuilder rgb = plain(8);
  rgb.samples = 3;
  all.emplace_back("rgb", rgb);
  DngBuilder mono = plain(12);
  mono.monochrome = mono.big_endian = true;
  all.emplace_back("mono", mono);
  DngBuilder table = plain(8);
  std::vector<double> values(256);
  for (int i = 0; i < 256; ++i) values[i] = i * 200;
  table.set(50712, Tag::numbers(TagType::u16, values));
  table.set(50717, Tag::numbers(TagType::u16, {51000}));
  all.emplace_back("table", table);
  for (const int bits : {16, 24, 32}) {
    Plane<std::uint32_t> patterns(bits == 24 ? 30 : 20, 12);
    for (std::size_t i = 0; i < patterns.size(); ++i) {  // values of 1 to 2, both signs
      const std::uint32_t one = bits == 16 ? 0x3C00U : bits == 24 ? 0x3F0000U : 0x3F800000U;
      patterns.data()[i] = one | (i % 5 == 0 ? 1U << (bits - 1) : 0U) | static_cast<std::uint32_t>(37 * i & 1023);
    }
    all.emplace_back("float" + std::to_string(bits), float_dng(patterns, {bits, bits == 24 ? 3 : 1, false, 1, 0, 5}));
    const int predictor = bits == 16 ? 34894 : bits == 24 ? 3 : 34895;
    const FloatStore how{bits, bits == 24 ? 3 : 1, true, predictor, 16, 16, bits == 16};
    all.emplace_back("float_tiles" + std::to_string(bits), float_dng(patterns, how));
  }
  return all;
}

}  // namespace
}  // namespace lowlux::test

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: make_dng_seeds FOLDER\n", stderr);
    return 2;
  }
  for (const auto& [name, dng] : lowlux::test::seeds()) {
    const std::vector<std::byte> bytes = dng.build();
    std::ofstream file(std::filesystem::path(argv[1]) / (name + ".dng"), std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!file) return 1;
  }
  return 0;
}
