#include "tests/support/dng/jpeg_xl.h"

#include <gtest/gtest.h>
#include <jxl/encode.h>

#include <cmath>
#include <memory>

namespace lowlux::test {
namespace {

struct Destroy {
  void operator()(JxlEncoder* encoder) const { JxlEncoderDestroy(encoder); }
};

}  // namespace

std::vector<std::byte> jpeg_xl_of(const Plane<std::uint16_t>& codes, int samples, int bits, float distance) {
  std::vector<std::uint16_t> scaled;  // libjxl takes samples of any depth at 16 bits
  for (std::size_t i = 0; i < codes.size(); ++i) {
    scaled.push_back(static_cast<std::uint16_t>(std::lround(codes.data()[i] * 65535.0 / ((1 << bits) - 1))));
  }
  const std::unique_ptr<JxlEncoder, Destroy> encoder(JxlEncoderCreate(nullptr));
  JxlBasicInfo info;
  JxlEncoderInitBasicInfo(&info);
  info.xsize = static_cast<std::uint32_t>(codes.width() / samples);
  info.ysize = static_cast<std::uint32_t>(codes.height());
  info.bits_per_sample = static_cast<std::uint32_t>(bits);
  info.num_color_channels = static_cast<std::uint32_t>(samples);
  info.uses_original_profile = distance > 0 ? JXL_FALSE : JXL_TRUE;
  EXPECT_EQ(JxlEncoderSetBasicInfo(encoder.get(), &info), JXL_ENC_SUCCESS);
  JxlColorEncoding linear{};
  JxlColorEncodingSetToLinearSRGB(&linear, samples == 1 ? JXL_TRUE : JXL_FALSE);
  EXPECT_EQ(JxlEncoderSetColorEncoding(encoder.get(), &linear), JXL_ENC_SUCCESS);
  JxlEncoderFrameSettings* settings = JxlEncoderFrameSettingsCreate(encoder.get(), nullptr);
  EXPECT_EQ(
      distance > 0 ? JxlEncoderSetFrameDistance(settings, distance) : JxlEncoderSetFrameLossless(settings, JXL_TRUE),
      JXL_ENC_SUCCESS);
  const JxlPixelFormat format{static_cast<std::uint32_t>(samples), JXL_TYPE_UINT16, JXL_NATIVE_ENDIAN, 0};
  EXPECT_EQ(JxlEncoderAddImageFrame(settings, &format, scaled.data(), 2 * scaled.size()), JXL_ENC_SUCCESS);
  JxlEncoderCloseInput(encoder.get());
  std::vector<std::byte> out(4 * scaled.size() + 65536);
  auto* next = reinterpret_cast<std::uint8_t*>(out.data());
  std::size_t left = out.size();
  EXPECT_EQ(JxlEncoderProcessOutput(encoder.get(), &next, &left), JXL_ENC_SUCCESS);
  out.resize(out.size() - left);
  return out;
}

}  // namespace lowlux::test
