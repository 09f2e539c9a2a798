#include "isp/base/packed/raw_format.h"

#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace lowlux {
namespace {

std::uint32_t code(const std::string& four) {
  return four == "-" ? 0 : fourcc(four.at(0), four.at(1), four.at(2), four.at(3));
}

constexpr std::uint64_t mipi = 0x0b00000000000001;
constexpr std::uint64_t ipu3 = 0x010000000000000d;

/// One line of a table: four Bayer orders, BGGR GBRG GRBG RGGB.
struct BayerLine {
  int bits;
  RawPacking packing;
  const char* v4l2;
  const char* drm;
  std::uint64_t modifier;
  const char* suffix;  // of libcamera's name
};

const std::vector<BayerLine> bayer_lines{
    {8, RawPacking::byte, "BA81 GBRG GRBG RGGB", "BA81 GBRG GRBG RGGB", 0, "8"},
    {10, RawPacking::little16, "BG10 GB10 BA10 RG10", "BG10 GB10 BA10 RG10", 0, "10"},
    {10, RawPacking::csi2, "pBAA pGAA pgAA pRAA", "BG10 GB10 BA10 RG10", mipi, "10_CSI2P"},
    {12, RawPacking::little16, "BG12 GB12 BA12 RG12", "BG12 GB12 BA12 RG12", 0, "12"},
    {12, RawPacking::csi2, "pBCC pGCC pgCC pRCC", "BG12 GB12 BA12 RG12", mipi, "12_CSI2P"},
    {14, RawPacking::little16, "BG14 GB14 GR14 RG14", "BG14 GB14 BA14 RG14", 0, "14"},
    {14, RawPacking::csi2, "pBEE pGEE pgEE pREE", "BG14 GB14 BA14 RG14", mipi, "14_CSI2P"},
    {16, RawPacking::little16, "BYR2 GB16 GR16 RG16", "BYR2 GB16 GR16 RGB6", 0, "16"},
    {10, RawPacking::ipu3, "ip3b ip3g ip3G ip3r", "BG10 GB10 BA10 RG10", ipu3, "10_IPU3"},
};

struct MonoLine {
  int bits;
  RawPacking packing;
  const char* v4l2;
  const char* drm;
  std::uint64_t modifier;
  const char* libcamera;
};

const std::vector<MonoLine> mono_lines{
    {8, RawPacking::byte, "GREY", "R8  ", 0, "R8"},
    {10, RawPacking::little16, "Y10 ", "R10 ", 0, "R10"},
    {10, RawPacking::csi2, "Y10P", "R10 ", mipi, "R10_CSI2P"},
    {10, RawPacking::bits_msb_first, "Y10B", "-", 0, ""},
    {12, RawPacking::little16, "Y12 ", "R12 ", 0, "R12"},
    {12, RawPacking::csi2, "Y12P", "R12 ", mipi, "R12_CSI2P"},
    {14, RawPacking::little16, "Y14 ", "-", 0, ""},
    {14, RawPacking::csi2, "Y14P", "-", 0, ""},
    {16, RawPacking::little16, "Y16 ", "R16 ", 0, "R16"},
};

void expect_names(const RawFormat& format, const RawFormatNames& expected) {
  const RawFormatNames* const names = names_of(format);
  ASSERT_NE(names, nullptr) << expected.libcamera;
  EXPECT_EQ(names->v4l2_fourcc, expected.v4l2_fourcc) << expected.libcamera;
  EXPECT_EQ(names->drm_fourcc, expected.drm_fourcc) << expected.libcamera;
  EXPECT_EQ(names->drm_modifier, expected.drm_modifier) << expected.libcamera;
  EXPECT_EQ(names->libcamera, expected.libcamera);
}

TEST(RawFormat, HasTheFourCharactersOfV4l2AndLibcamera) {
  const std::vector<std::pair<std::string, BayerPhase>> orders{
      {"BGGR", BayerPhase::bggr}, {"GBRG", BayerPhase::gbrg}, {"GRBG", BayerPhase::grbg}, {"RGGB", BayerPhase::rggb}};
  for (const BayerLine& line : bayer_lines) {
    std::istringstream v4l2(line.v4l2), drm(line.drm);
    for (const auto& [order, phase] : orders) {
      std::string v4l2_code, drm_code;
      ASSERT_TRUE(v4l2 >> v4l2_code && drm >> drm_code);
      const RawFormat format{line.bits, line.packing, SensorLayout::bayer, phase};
      const std::string name = "S" + order + line.suffix;
      expect_names(format, {format, code(v4l2_code), code(drm_code), line.modifier, name});
    }
  }
  for (const MonoLine& line : mono_lines) {
    const RawFormat format{line.bits, line.packing, SensorLayout::monochrome, BayerPhase::rggb};
    expect_names(format, {format, code(line.v4l2), code(line.drm), line.modifier, line.libcamera});
  }
  const RawFormat big{16, RawPacking::big16, SensorLayout::monochrome, BayerPhase::rggb};
  expect_names(big, {big, code("Y16 ") | 0x80000000U, 0, 0, ""});
  EXPECT_EQ(raw_formats().size(), 4 * bayer_lines.size() + mono_lines.size() + 1);
}

TEST(RawFormat, IsFoundByEachOfItsNamesAndByNoOther) {
  std::set<std::uint32_t> v4l2;
  std::set<std::pair<std::uint32_t, std::uint64_t>> drm;
  std::set<std::string_view> libcamera;
  for (const RawFormatNames& names : raw_formats()) {
    EXPECT_EQ(names_of(names.format), &names);
    EXPECT_TRUE(v4l2.insert(names.v4l2_fourcc).second) << names.libcamera;
    EXPECT_EQ(raw_format_of_v4l2(names.v4l2_fourcc), names.format) << names.libcamera;
    EXPECT_EQ(names.drm_fourcc == 0, names.libcamera.empty());
    if (names.drm_fourcc == 0) continue;
    EXPECT_TRUE(drm.insert({names.drm_fourcc, names.drm_modifier}).second) << names.libcamera;
    EXPECT_TRUE(libcamera.insert(names.libcamera).second) << names.libcamera;
    EXPECT_EQ(raw_format_of_drm(names.drm_fourcc, names.drm_modifier), names.format) << names.libcamera;
  }
}

// Processed pictures, formats that lose (DPCM, A-law) and compressed ones (PiSP's modifier, vendor 12, number 1).
TEST(RawFormat, IsNoneForWhatLowluxDoesNotUnpack) {
  for (const char* four : {"YUYV", "NV12", "RGB3", "MJPG", "bBA8", "bGA8", "BD10", "bRA8", "aBA8", "aGA8", "agA8",
                           "aRA8", "PC1R", "PC1M", "Y8I ", "Y12I", "Z16 ", "R10 ", "RGB6"}) {
    EXPECT_FALSE(raw_format_of_v4l2(code(four)).has_value()) << four;
  }
  EXPECT_FALSE(raw_format_of_v4l2(0).has_value());
  EXPECT_FALSE(raw_format_of_v4l2(code("GREY") | 0x80000000U).has_value());
  EXPECT_FALSE(raw_format_of_drm(0, 0).has_value());
  EXPECT_FALSE(raw_format_of_drm(code("YUYV"), 0).has_value());
  EXPECT_FALSE(raw_format_of_drm(code("RG16"), 0).has_value()) << "RGB565 in DRM, raw in V4L2";
  EXPECT_FALSE(raw_format_of_drm(code("pRAA"), 0).has_value());
  constexpr std::uint64_t pisp = 0x0c00000000000001;
  for (const char* four : {"BYR2", "GB16", "GR16", "RGB6", "R16 "}) {
    EXPECT_TRUE(raw_format_of_drm(code(four), 0).has_value()) << four;
    EXPECT_FALSE(raw_format_of_drm(code(four), pisp).has_value()) << four;
    EXPECT_FALSE(raw_format_of_drm(code(four), mipi).has_value()) << four;
  }
  EXPECT_EQ(names_of({10, RawPacking::csi2, SensorLayout::monochrome, BayerPhase::bggr}), nullptr);
  EXPECT_EQ(names_of({10, RawPacking::csi2, SensorLayout::linear_rgb, BayerPhase::rggb}), nullptr);
  EXPECT_EQ(names_of({12, RawPacking::ipu3, SensorLayout::bayer, BayerPhase::rggb}), nullptr);
}

struct GroupLine {
  int bits;
  RawPacking packing;
  int pixels;
  int bytes;
  std::size_t bytes_of_26;  // a row of 26, no multiple of 4 or 25
};

TEST(RawFormat, FillsRowsWithWholeGroups) {
  const std::vector<GroupLine> lines{{8, RawPacking::byte, 1, 1, 26},           {10, RawPacking::little16, 1, 2, 52},
                                     {10, RawPacking::csi2, 4, 5, 35},          {12, RawPacking::little16, 1, 2, 52},
                                     {12, RawPacking::csi2, 2, 3, 39},          {14, RawPacking::little16, 1, 2, 52},
                                     {14, RawPacking::csi2, 4, 7, 49},          {16, RawPacking::little16, 1, 2, 52},
                                     {16, RawPacking::big16, 1, 2, 52},         {10, RawPacking::ipu3, 25, 32, 64},
                                     {10, RawPacking::bits_msb_first, 4, 5, 35}};
  for (const GroupLine& line : lines) {
    const RawFormat format{line.bits, line.packing, SensorLayout::monochrome, BayerPhase::rggb};
    const RawGroup group = group_of(format);
    EXPECT_EQ(group.pixels, line.pixels) << line.bits;
    EXPECT_EQ(group.bytes, line.bytes) << line.bits;
    EXPECT_EQ(row_bytes(format, 26), line.bytes_of_26) << line.bits;
    EXPECT_EQ(row_bytes(format, 1), static_cast<std::size_t>(line.bytes)) << line.bits;
    EXPECT_EQ(row_bytes(format, line.pixels), static_cast<std::size_t>(line.bytes)) << line.bits;
    EXPECT_EQ(row_bytes(format, line.pixels + 1), 2 * static_cast<std::size_t>(line.bytes)) << line.bits;
    EXPECT_EQ(row_bytes(format, 0), 0U);
    EXPECT_EQ(row_bytes(format, -1), 0U);
    EXPECT_EQ(row_bytes(format, std::numeric_limits<int>::min()), 0U);
  }
  EXPECT_EQ(row_bytes({12, RawPacking::csi2}, 65536), 98304U);
  EXPECT_EQ(row_bytes({12, RawPacking::csi2}, std::numeric_limits<int>::max()), 3221225472U) << "2^30 groups of 3";
}

static_assert(largest_code({8}) == 255 && largest_code({14}) == 16383 && largest_code({16}) == 65535);

TEST(RawFormat, IsWrittenAsTheApisWriteIt) {
  EXPECT_EQ(v4l2_text(fourcc('Y', '1', '0', ' ')), "Y10");
  EXPECT_EQ(v4l2_text(fourcc('Y', '1', '6', ' ') | std::uint32_t{1} << 31), "Y16-BE");
  EXPECT_EQ(v4l2_text(0x01020304), "????");
  EXPECT_EQ(text_of({.bits = 10, .packing = RawPacking::csi2}), "SRGGB10_CSI2P");
  EXPECT_EQ(text_of({.bits = 14, .layout = SensorLayout::monochrome}), "Y14");
  EXPECT_EQ(text_of({.bits = 9}), "");
}

}  // namespace
}  // namespace lowlux
