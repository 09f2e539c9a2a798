#include <gtest/gtest.h>

#include <cstring>

#include "isp/base/packed/raw_format.h"
#include "isp/render/pixel_rows.h"
#include "tests/adapter/stage_frames.h"
#include "tests/support/guarded_memory.h"

namespace lowlux::stage_formats_test {
namespace {

using namespace stage_testing;

constexpr int width = 37, height = 22;  // no whole groups, an odd last column
constexpr std::uint32_t pictures[] = {LOWLUX_STAGE_XBGR8888, LOWLUX_STAGE_XRGB8888, LOWLUX_STAGE_BGR888,
                                      LOWLUX_STAGE_RGB888,   LOWLUX_STAGE_NV12,     LOWLUX_STAGE_RGB48,
                                      LOWLUX_STAGE_BAYER16};

bool makes(const RawFormatNames& names, std::uint32_t fourcc) {
  return names.format.layout == SensorLayout::bayer || fourcc != LOWLUX_STAGE_BAYER16;
}

/// The picture that plain 16-bit samples of the same layout give.
std::vector<std::vector<std::uint8_t>> planes_from_words(const RawFormat& format, const Codes& codes,
                                                         std::uint32_t fourcc) {
  const RawFormat words{format.bits, format.bits == 8 ? RawPacking::byte : RawPacking::little16, format.layout,
                        format.phase};
  const RawFormatNames* const names = names_of(words);
  if (names == nullptr) return {};
  Rig rig(plain_settings(), *names, width, height, fourcc);
  EXPECT_EQ(rig.process(codes, fixed_params(format)), LOWLUX_STAGE_OK) << rig.error();
  return rig.planes;
}

TEST(StageFormats, PackedSamplesGiveThePictureOfPlainOnesInEveryOutput) {
  for (const RawFormatNames& names : raw_formats()) {
    const Codes codes = scene(names.format, width, height);
    for (const std::uint32_t fourcc : pictures) {
      Rig rig(plain_settings(), names, width, height, fourcc);
      if (!makes(names, fourcc)) {
        EXPECT_EQ(rig.configured, LOWLUX_STAGE_UNSUPPORTED);
        continue;
      }
      ASSERT_EQ(rig.configured, LOWLUX_STAGE_OK) << names.libcamera;
      ASSERT_EQ(rig.process(codes, fixed_params(names.format)), LOWLUX_STAGE_OK) << names.libcamera << rig.error();
      const auto expected = planes_from_words(names.format, codes, fourcc);
      ASSERT_FALSE(expected.empty()) << names.libcamera;
      EXPECT_EQ(rig.planes, expected) << names.libcamera << ' ' << fourcc;
    }
  }
}

TEST(StageFormats, StridesOfInputAndOutputDoNotChangeThePictureAndWhatLiesBetweenRowsIsLeft) {
  const RawFormatNames& names = names_of_bayer(10, BayerPhase::grbg, RawPacking::csi2);
  const Codes codes = scene(names.format, width, height);
  for (const std::uint32_t fourcc : pictures) {
    Rig tight(plain_settings(3), names, width, height, fourcc);
    ASSERT_EQ(tight.process(codes, fixed_params(names.format)), LOWLUX_STAGE_OK);
    for (const std::size_t more : {std::size_t{2}, std::size_t{64}, std::size_t{1000}}) {
      Rig wide(plain_settings(3), names, input_of(names, width, height), fourcc, more);
      const std::size_t stride = row_bytes(names.format, width) + more + 1;
      ASSERT_EQ(wide.process(packed_frame(names.format, codes, width, stride), stride, fixed_params(names.format)),
                LOWLUX_STAGE_OK);
      for (std::size_t p = 0; p < wide.planes.size(); ++p) {
        const std::size_t row = tight.out.stride[p], step = wide.picture.plane[p].stride;
        for (std::size_t y = 0; y * step < wide.planes[p].size(); ++y) {
          const std::uint8_t* const at = &wide.planes[p][y * step];
          EXPECT_EQ(std::memcmp(at, &tight.planes[p][y * row], row), 0) << fourcc << ' ' << y;
          for (std::size_t i = row; i < step; ++i) ASSERT_EQ(at[i], 0xC3) << fourcc << ' ' << y;
        }
      }
    }
  }
}

TEST(StageFormats, OutputsAgreeWithOneAnother) {
  const RawFormatNames& names = names_of_bayer(12, BayerPhase::bggr);
  const Codes codes = scene(names.format, width, height);
  const auto planes = [&](std::uint32_t fourcc) {
    Rig rig(plain_settings(2), names, width, height, fourcc);
    EXPECT_EQ(rig.process(codes, fixed_params(names.format)), LOWLUX_STAGE_OK);
    return rig.planes;
  };
  const auto rgb = planes(LOWLUX_STAGE_BGR888)[0];  // R G B in memory
  const auto bgr = planes(LOWLUX_STAGE_RGB888)[0], rgbx = planes(LOWLUX_STAGE_XBGR8888)[0],
             bgrx = planes(LOWLUX_STAGE_XRGB8888)[0], deep = planes(LOWLUX_STAGE_RGB48)[0];
  for (std::size_t i = 0; i < std::size_t{width} * height; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      ASSERT_EQ(bgr[3 * i + c], rgb[3 * i + 2 - c]);
      ASSERT_EQ(rgbx[4 * i + c], rgb[3 * i + c]);
      ASSERT_EQ(bgrx[4 * i + c], rgb[3 * i + 2 - c]);
      // 257 codes of 16 bits for each of 8. The 8-bit kernel is within one of its own (docs/kernels.md), because its
      // table has the code of the middle of each bin.
      const int of16 = deep[6 * i + 2 * c] | deep[6 * i + 2 * c + 1] << 8;
      ASSERT_NEAR(of16, 257 * rgb[3 * i + c], 257);
    }
    ASSERT_EQ(rgbx[4 * i + 3], 255);
    ASSERT_EQ(bgrx[4 * i + 3], 255);
  }
}

TEST(StageFormats, Nv12IsThatOfTheRgbCodesWithTheMatrixAskedFor) {
  const RawFormatNames& names = names_of_bayer(8);
  constexpr int tall = 721, narrow = 7;  // a last odd row; the matrix of high definition is the usual one
  for (const auto& [rows, asked, standard] : {std::tuple{height, 0, isp::YuvStandard::bt601},
                                              {height, 709, isp::YuvStandard::bt709},
                                              {tall, 0, isp::YuvStandard::bt709},
                                              {tall, 601, isp::YuvStandard::bt601}}) {
    const Codes codes = scene(names.format, narrow, rows);
    Rig rgb(plain_settings(), names, narrow, rows, LOWLUX_STAGE_BGR888);
    ASSERT_EQ(rgb.process(codes, fixed_params(names.format)), LOWLUX_STAGE_OK);
    Rig yuv(plain_settings(2), names, narrow, rows, LOWLUX_STAGE_NV12);
    yuv.out.yuv_matrix = asked;
    ASSERT_EQ(lowlux_stage_configure(yuv.stage.get(), &yuv.in, &yuv.out), LOWLUX_STAGE_OK);
    ASSERT_EQ(yuv.process(codes, fixed_params(names.format)), LOWLUX_STAGE_OK);
    const isp::YuvMatrix matrix = isp::yuv_matrix(standard);
    std::vector<std::uint8_t> luma(narrow), chroma(narrow + 1);
    for (int y = 0; y < rows; ++y) {
      const std::uint8_t* const row = &rgb.planes[0][static_cast<std::size_t>(y) * 3 * narrow];
      isp::luma_row(matrix, row, narrow, luma.data());
      EXPECT_EQ(std::memcmp(luma.data(), &yuv.planes[0][static_cast<std::size_t>(y) * narrow], narrow), 0) << y;
      if (y % 2 != 0) continue;
      isp::chroma_row(matrix, row, y + 1 < rows ? row + 3 * narrow : row, narrow, chroma.data());
      EXPECT_EQ(std::memcmp(chroma.data(), &yuv.planes[1][static_cast<std::size_t>(y / 2) * (narrow + 1)], narrow + 1),
                0)
          << y;
    }
  }
}

TEST(StageFormats, MosaicsWithoutDenoisingAreTheCodesAtTheHighEndOf16Bits) {
  for (const int bits : {8, 10, 12, 14, 16}) {
    const RawFormatNames& names = names_of_bayer(bits, BayerPhase::gbrg);
    const Codes codes = scene(names.format, width, height);
    Rig rig(plain_settings(2), names, width, height, LOWLUX_STAGE_BAYER16);
    ASSERT_EQ(rig.process(codes, fixed_params(names.format)), LOWLUX_STAGE_OK);
    for (std::size_t i = 0; i < codes.size(); ++i) ASSERT_EQ(rig.wide(i), codes[i] << (16 - bits)) << bits;
  }
}

TEST(StageFormats, CodesBeyondTheBitsOfAFormatAreTheLargestOfAMosaicAndNotDark) {
  const RawFormatNames& names = names_of_bayer(10);
  Codes codes = scene(names.format, width, height);
  codes[5] = 1024;  // in words of 16 bits a driver may leave what it likes above
  codes[6] = 65535;
  Rig rig(plain_settings(), names, width, height, LOWLUX_STAGE_BAYER16);
  std::vector<std::byte> bytes(2 * codes.size());
  std::memcpy(bytes.data(), codes.data(), bytes.size());
  ASSERT_EQ(rig.process(bytes, std::size_t{2} * width, fixed_params(names.format)), LOWLUX_STAGE_OK);
  EXPECT_EQ(rig.wide(5), 1023 << 6);
  EXPECT_EQ(rig.wide(6), 1023 << 6);
}

TEST(StageFormats, ACropIsThatPartOfTheCodesAndAnOddOneBeginsWithAnotherColour) {
  const RawFormatNames& names = names_of_bayer(12);
  const Codes codes = scene(names.format, width, height);
  for (const auto& [x, y, phase] : {std::tuple{0, 0, BayerPhase::rggb},
                                    {1, 0, BayerPhase::grbg},
                                    {4, 3, BayerPhase::gbrg},
                                    {3, 5, BayerPhase::bggr}}) {
    auto in = input_of(names, width, height);
    in.crop = {x, y, 20, 14};
    Codes inside;
    for (int row = y; row < y + 14; ++row)
      inside.insert(inside.end(), &codes[row * width + x], &codes[row * width + x + 20]);
    for (const std::uint32_t fourcc : {LOWLUX_STAGE_BGR888, LOWLUX_STAGE_BAYER16}) {
      Rig rig(plain_settings(2), names, in, fourcc),
          alone(plain_settings(2), names_of_bayer(12, phase), 20, 14, fourcc);
      ASSERT_EQ(rig.process(codes, fixed_params(names.format)), LOWLUX_STAGE_OK);
      ASSERT_EQ(alone.process(inside, fixed_params(names.format)), LOWLUX_STAGE_OK);
      EXPECT_EQ(rig.planes, alone.planes) << x << ' ' << y;
    }
  }
}

TEST(StageFormats, NothingBeyondTheRowsOfInputAndOutputIsTouched) {
  for (const RawFormatNames& names : raw_formats()) {
    const std::size_t stride = row_bytes(names.format, width) + 3;
    const std::size_t length = stride * (height - 1) + row_bytes(names.format, width);
    const auto frame = packed_frame(names.format, scene(names.format, width, height), width, stride);
    const test::GuardedMemory in_memory(length);
    const auto in = in_memory.last(length);
    std::memcpy(in.data(), frame.data(), length);
    for (const std::uint32_t fourcc : pictures) {
      if (!makes(names, fourcc)) continue;
      Rig rig(plain_settings(2), names, width, height, fourcc);
      for (const bool at_end : {false, true}) {
        const test::GuardedMemory first(rig.out.bytes[0]), second(rig.out.bytes[1]);
        const test::GuardedMemory* const memory[] = {&first, &second};
        for (int p = 0; p < rig.out.planes; ++p) {
          const auto plane = at_end ? memory[p]->last(rig.out.bytes[p]) : memory[p]->first(rig.out.bytes[p]);
          rig.picture.plane[p] = {plane.data(), plane.size(), rig.out.stride[p]};
        }
        const lowlux_stage_source source{in.data(), in.size(), stride, -1};
        const auto params = fixed_params(names.format);
        ASSERT_EQ(lowlux_stage_process(rig.stage.get(), &source, &rig.picture, &params, nullptr, nullptr),
                  LOWLUX_STAGE_OK);
      }
    }
  }
}

TEST(StageFormats, AreDescribedAsTheyAre) {
  for (const RawFormatNames& names : raw_formats()) {
    lowlux_stage_format_info info{};
    info.size = sizeof info;
    for (const bool v4l2 : {false, true}) {
      if ((v4l2 ? names.v4l2_fourcc : names.drm_fourcc) == 0) continue;
      ASSERT_EQ(v4l2 ? lowlux_stage_query(LOWLUX_STAGE_V4L2, names.v4l2_fourcc, 0, &info)
                     : lowlux_stage_query(LOWLUX_STAGE_DRM, names.drm_fourcc, names.drm_modifier, &info),
                LOWLUX_STAGE_OK);
      const bool bayer = names.format.layout == SensorLayout::bayer;
      EXPECT_EQ(info.size, sizeof info);
      EXPECT_EQ(info.bits, names.format.bits);
      EXPECT_EQ(info.packed != 0, group_of(names.format).pixels > 1);
      EXPECT_EQ(info.mosaic, bayer ? static_cast<int>(names.format.phase) : -1);
      EXPECT_EQ(info.group_pixels, group_of(names.format).pixels);
      EXPECT_EQ(info.group_bytes, group_of(names.format).bytes);
      EXPECT_EQ(info.alignment, 1);
      EXPECT_EQ(info.margin, 0);
      EXPECT_EQ(info.outputs, bayer ? 7 : 6);
      EXPECT_EQ(info.output[6], bayer ? LOWLUX_STAGE_BAYER16 : 0);
    }
  }
}

}  // namespace
}  // namespace lowlux::stage_formats_test
