// The table of formats in docs/formats.md is what this test reads and is refused. It fails where the page says
// otherwise; LOWLUX_WRITE_FORMATS=1 writes the page.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "capture/decoder/decoder_name.h"
#include "tests/capture/read_built.h"
#include "tests/capture/x_trans_colours.h"
#include "tests/support/dng/code_dng.h"
#include "tests/support/dng/float_dng.h"
#include "tests/support/dng/jpeg_xl.h"

namespace lowlux::capture::format_table_test {
namespace {

using test::DngBuilder;
using test::DngStorage;
using test::Tag;
using test::TagType;

struct Format {
  std::string name;
  std::function<std::vector<std::byte>()> file;
};

std::vector<std::byte> file_of(const std::string& name) {
  std::ifstream in(LOWLUX_TESTDATA "/raws/" + name, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

std::vector<std::byte> dump(std::size_t size) { return std::vector<std::byte>(size, std::byte{'a'}); }

DngBuilder plain(int samples = 1, int bits = 16, DngStorage storage = DngStorage::uncompressed) {
  DngBuilder dng;
  dng.width = dng.height = 64;
  dng.samples = samples, dng.bits = bits, dng.storage = storage;
  dng.tile_width = dng.tile_height = 32;
  return dng;
}

std::vector<std::byte> with(DngBuilder dng, std::uint16_t id, const std::vector<double>& numbers) {
  return dng.set(id, Tag::numbers(TagType::u16, numbers)).build();
}

std::vector<std::byte> floats(int bits, bool deflate, int predictor) {
  Plane<std::uint32_t> zeros(32, 32);
  std::fill_n(zeros.data(), zeros.size(), 0U);
  return test::float_dng(zeros, {.bits = bits, .deflate = deflate, .predictor = predictor}).build();
}

DngBuilder stored(const test::CodeStore& how) {
  Plane<std::uint16_t> zeros(64 * how.samples, 64);
  std::fill_n(zeros.data(), zeros.size(), std::uint16_t{0});
  return test::code_dng(zeros, how);
}

std::vector<std::byte> in_big_tiff(DngBuilder dng) {
  dng.big_tiff = true;
  return dng.build();
}

#ifdef LOWLUX_WITH_JPEG_XL
std::vector<std::byte> in_jpeg_xl(int samples) {
  DngBuilder dng = plain(samples, 12);
  Plane<std::uint16_t> zeros(64 * samples, 64);
  std::fill_n(zeros.data(), zeros.size(), std::uint16_t{0});
  dng.stored_parts = {test::jpeg_xl_of(zeros, samples, 12)};
  return with(dng, 259, {52546});
}
#endif

std::vector<Format> stored_formats() {
  std::vector<Format> out;
  for (const int bits : {8, 10, 12, 14, 16}) {
    out.push_back(
        {"DNG, Bayer, " + std::to_string(bits) + " bits, uncompressed", [bits] { return plain(1, bits).build(); }});
  }
  out.push_back({"DNG, Bayer, uncompressed, tiles", [] { return stored({.tile_width = 32, .rows = 32}).build(); }});
  out.push_back({"DNG, Bayer, uncompressed, strips apart", [] {
                   DngBuilder dng = stored({.rows = 16});
                   dng.part_gap = 2;
                   return dng.build();
                 }});
  out.push_back({"DNG, Bayer, Deflate, predictor 2", [] { return stored({.deflate = true, .predictor = 2}).build(); }});
  out.push_back({"DNG, Bayer, lossless JPEG, strips", [] {
                   DngBuilder dng = plain(1, 14, DngStorage::lossless_jpeg);
                   dng.rows_per_strip = 16;
                   return dng.build();
                 }});
  out.push_back(
      {"DNG, Bayer, lossless JPEG, one strip", [] { return plain(1, 14, DngStorage::lossless_jpeg).build(); }});
  out.push_back(
      {"DNG, Bayer, lossless JPEG, tiles", [] { return plain(1, 14, DngStorage::tiled_lossless_jpeg).build(); }});
  out.push_back({"DNG, monochrome", [] {
                   DngBuilder dng = plain();
                   dng.monochrome = true;
                   return dng.build();
                 }});
  out.push_back({"DNG, X-Trans", [] {
                   DngBuilder dng = plain();
                   dng.set(33421, Tag::numbers(TagType::u16, {6, 6}));
                   return dng.set(33422, Tag::numbers(TagType::byte, test::x_trans_colours({}))).build();
                 }});
  out.push_back({"DNG, Quad Bayer", [] {
                   DngBuilder dng = plain(1, 12);
                   dng.set(33421, Tag::numbers(TagType::u16, {4, 4}));
                   const std::vector<double> colours{0, 0, 1, 1, 0, 0, 1, 1, 1, 1, 2, 2, 1, 1, 2, 2};
                   return dng.set(33422, Tag::numbers(TagType::byte, colours)).build();
                 }});
  out.push_back({"DNG, LinearRaw, uncompressed", [] { return plain(3).build(); }});
  out.push_back({"DNG, LinearRaw, uncompressed, colour after colour",
                 [] { return stored({.samples = 3, .planar = true}).build(); }});
  out.push_back(
      {"DNG, LinearRaw, 8 bits, Deflate", [] { return stored({.bits = 8, .samples = 3, .deflate = true}).build(); }});
  out.push_back({"DNG, BigTIFF, uncompressed", [] { return in_big_tiff(plain()); }});
  out.push_back({"DNG, BigTIFF, lossless JPEG", [] { return in_big_tiff(plain(1, 14, DngStorage::lossless_jpeg)); }});
  out.push_back({"DNG, LinearRaw, lossless JPEG", [] { return plain(3, 16, DngStorage::lossless_jpeg).build(); }});
#ifdef LOWLUX_WITH_JPEG_XL
  out.push_back({"DNG, Bayer, JPEG XL", [] { return in_jpeg_xl(1); }});
  out.push_back({"DNG, LinearRaw, JPEG XL", [] { return in_jpeg_xl(3); }});
#endif
  out.push_back({"DNG, 16-bit floats, uncompressed", [] { return floats(16, false, 1); }});
  out.push_back({"DNG, 24-bit floats, Deflate, predictor 3", [] { return floats(24, true, 3); }});
  out.push_back({"DNG, 32-bit floats, Deflate, predictor 34894", [] { return floats(32, true, 34894); }});
  return out;
}

std::vector<Format> other_formats() {
  return {{"DNG, Bayer, lossy JPEG", [] { return with(plain(1, 8), 259, {34892}); }},
          {"DNG, VC-5 (GoPro GPR)", [] { return file_of("gopro_hero6_GOPR0024.gpr"); }},
          {"DNG, mosaic of 6 x 6 sites other than X-Trans",
           [] {
             DngBuilder dng = plain();
             dng.set(33421, Tag::numbers(TagType::u16, {6, 6}));
             return dng.set(33422, Tag::numbers(TagType::byte, std::vector<double>(36, 1))).build();
           }},
          {"DNG, mosaic of 4 x 4 sites other than Quad Bayer",
           [] {
             DngBuilder dng = plain();
             dng.set(33421, Tag::numbers(TagType::u16, {4, 4}));
             return dng.set(33422, Tag::numbers(TagType::byte, std::vector<double>(16, 1))).build();
           }},
          {"DNG, mosaic of cyan, magenta, yellow",
           [] {
             return plain().set(50710, Tag::numbers(TagType::byte, {3, 4, 5})).build();
           }},
          {"DNG, mosaic that is not rectangular", [] { return with(plain(), 50711, {2}); }},
          {"DNG, integers of 32 bits", [] { return with(plain(), 258, {32}); }},
          {"DNG, signed integers", [] { return with(plain(), 339, {2}); }},
          {"DNG, lowest bit of each byte first", [] { return with(plain(1, 12), 266, {2}); }},
          {"Kodak C603, YCbCr without a header", [] { return dump(9116448); }},
          {"text", [] { return dump(1000); }},
          {"TIFF image", [] { return with(plain(3).remove(50706).remove(50707), 262, {2}); }},
          {"BigTIFF image", [] { return in_big_tiff(plain(3).remove(50706).remove(50707)); }}};
}

/// Returns a row: decoded with its layout, or refused with the reason.
std::string row_of(const Format& format) {
  const auto frame = test::read_bytes(format.file());
  if (!frame) {
    std::string why = frame.error().message;
    if (const auto at = why.find(decoder_name()); at != std::string::npos) {
      why.replace(at, decoder_name().size(), "LibRaw");  // without its version
    }
    return "| " + format.name + " | refused | " + why + " |\n";
  }
  const char* const layouts[] = {"mosaic", "monochrome", "three colours"};
  const RawDn& raw = frame->raw;
  return "| " + format.name + " | decoded | " + layouts[static_cast<std::size_t>(raw.layout)] +
         (raw.is_float() ? ", floats" : "") + (raw.from_x_trans ? ", interpolated at reading" : "") + " |\n";
}

std::string page() {
  std::string out =
      "# Formats\n\nEach row is a file of `tests/capture/format_table_test.cpp`, with the result of reading it: the "
      "layout of the samples, or\nthe error message. `lowlux denoise` writes a DNG of the same layout: mosaic, "
      "monochrome, or three colours as LinearRaw.\nRaw formats other than DNG are decoded by LibRaw, so its list of "
      "cameras applies, except for Foveon, rotated and\nfour-colour mosaics and sRAW; no such file with a free licence "
      "is small enough for this test. Lossy LinearRaw is decoded\ntoo, and tested by "
      "`tests/capture/lossy_dng_test.cpp`.\n\n| format | result | layout or reason |\n|---|---|---|\n";
  for (const auto& formats : {stored_formats(), other_formats()}) {
    for (const Format& format : formats) out += row_of(format);
  }
  return out;
}

/// Returns the text of the page; without the rows of JPEG XL where this build lacks it.
std::string stated_page(const std::string& path) {
  std::ifstream in(path);
  std::string out;
  for (std::string line; std::getline(in, line);) {
#ifndef LOWLUX_WITH_JPEG_XL
    if (line.find("JPEG XL |") != std::string::npos) continue;
#endif
    out += line + '\n';
  }
  return out;
}

TEST(FormatTable, IsWhatThePageSays) {
  const std::string path = LOWLUX_TESTDATA "/../docs/formats.md", now = page();
  if (std::getenv("LOWLUX_WRITE_FORMATS") != nullptr) std::ofstream(path) << now;
  EXPECT_EQ(now, stated_page(path));
}

}  // namespace
}  // namespace lowlux::capture::format_table_test
