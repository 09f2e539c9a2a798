// Small files that state much: a reader takes memory for what a file holds, not for what it states. The README of
// capture lists every count and its limit; opcodes are in dng_opcodes_test.cpp, profiles in calib's
// profile_io_test.cpp.
#include <gtest/gtest.h>

#include <span>
#include <string>
#include <string_view>

#include "capture/dng/tiff_directory.h"
#include "capture/file/picture_source.h"
#include "capture/file/spectra_file.h"
#include "tests/capture/built_pictures.h"
#include "tests/codec/pictures.h"
#include "tests/support/peak_memory.h"

namespace lowlux::capture {
namespace {

constexpr std::uint32_t side = 16000;  // as RGB of 8 bits 768 MB

void put(Bytes& file, std::size_t at, std::uint32_t value, int bytes, bool big_endian) {
  for (int i = 0; i < bytes; ++i) {
    file[at + i] = static_cast<std::byte>(value >> 8 * (big_endian ? bytes - 1 - i : i) & 255);
  }
}

std::size_t end_of(const Bytes& file, const std::string& words) {
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  return text.find(words) + words.size();
}

Bytes vast_jpeg() {
  Bytes file = jpeg_of(test::noisy_codes<std::uint8_t>(9, 7));
  const std::size_t at = end_of(file, "\xFF\xC0") + 3;
  put(file, at, side, 2, true);
  put(file, at + 2, side, 2, true);
  return file;
}

Bytes vast_exr() {
  Bytes file = exr_of(linear_row({{1, 2, 3}}));
  const std::size_t at = end_of(file, std::string("dataWindow\0box2i\0", 17)) + 4;
  put(file, at + 8, side - 1, 4, false);
  put(file, at + 12, side - 1, 4, false);
  return file;
}

Bytes vast_tiff() {
  Bytes file = tiff_of(test::noisy_codes<std::uint16_t>(9, 7));
  const auto directory = TiffFile::open(file)->directory(TiffFile::open(file)->first_directory());
  for (const TagName name : {TagName{256, ""}, {257, ""}}) {
    const std::size_t place = directory->find(name)->place;
    put(file, place + 2, 4, 2, false);  // a number of 32 bits
    put(file, place + 8, side, 4, false);
  }
  return file;
}

Bytes vast_pfm() {
  const std::string text = "PF\n16000 16000\n-1.0\nabc";
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

TEST(HostileCounts, PicturesThatStateMoreThanTheyHoldTakeNoMemoryForIt) {
  const std::int64_t before = test::peak_bytes([] {});
  for (const auto& [name, file] :
       {std::pair{"JPEG", vast_jpeg()}, {"OpenEXR", vast_exr()}, {"TIFF", vast_tiff()}, {"PFM", vast_pfm()}}) {
    const std::int64_t peak = test::peak_bytes([&, &bytes = file, &kind = name] { EXPECT_FALSE(read(bytes)) << kind; });
    EXPECT_LT(peak - before, std::int64_t{48} << 20) << name << ": what is stated takes 732 MiB and more";
  }
}

TEST(HostileCounts, ATableOfSpectraIsBoundedInEachDirection) {
  std::string columns = "nm";
  for (int i = 0; i < 4096; ++i) columns += ",a";
  EXPECT_FALSE(parse_spectra(columns + "\n", "t"));
  EXPECT_FALSE(parse_spectra(std::string((std::size_t{16} << 20) + 1, '\n'), "t"));
  std::string rows = "nm,a\n";
  for (int i = 1; i <= 100'001; ++i) rows += std::to_string(i) + ",1\n";
  EXPECT_FALSE(parse_spectra(rows, "t"));
}

}  // namespace
}  // namespace lowlux::capture
