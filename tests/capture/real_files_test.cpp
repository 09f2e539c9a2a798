#include <gtest/gtest.h>

#include <string>

#include "capture/file/dng_source.h"

namespace lowlux::capture {
namespace {

/// What the README of testdata/raws says of each file.
struct RealFile {
  const char* name;
  int width, height;
  Rect active;
  BayerPhase phase;
  double black_dn, white_dn;
};

void PrintTo(const RealFile& file, std::ostream* out) { *out << file.name; }

class RealFiles : public testing::TestWithParam<RealFile> {};

TEST_P(RealFiles, AreReadAsTheirReadmeSays) {
  const RealFile& expected = GetParam();
  const auto frame = read_raw(std::filesystem::path(LOWLUX_TESTDATA "/raws") / expected.name);
  ASSERT_TRUE(frame) << frame.error().message;
  const RawDn& raw = frame->raw;
  EXPECT_EQ(raw.layout, SensorLayout::bayer);
  EXPECT_EQ(raw.dn.width(), expected.width);
  EXPECT_EQ(raw.dn.height(), expected.height);
  EXPECT_EQ(raw.active, expected.active);
  EXPECT_EQ(raw.phase, expected.phase);
  ASSERT_TRUE(raw.black_tag);
  EXPECT_EQ(raw.black_tag->at(1, 1), expected.black_dn);
  EXPECT_EQ(raw.white_dn[0], expected.white_dn);
  EXPECT_FALSE(raw.info.iso);
  EXPECT_FALSE(raw.info.exposure_s);
  EXPECT_EQ(frame->colour.calibrations.size(), 1u);
  EXPECT_TRUE(frame->warnings.empty());
}

INSTANTIATE_TEST_SUITE_P(
    Raws, RealFiles,
    testing::Values(
        RealFile{"canon_kissx4_ml_colorchart.dng", 1888, 1182, {152, 26, 1734, 1156}, BayerPhase::rggb, 2056, 15000},
        RealFile{"nikon_dsc1339_crop_rggb14.dng", 768, 512, {0, 0, 768, 512}, BayerPhase::rggb, 600, 15520},
        RealFile{"openisp_test_rggb10.dng", 1920, 1080, {0, 0, 1920, 1080}, BayerPhase::rggb, 0, 1023},
        RealFile{"infiniteisp_indoor1_grbg8.dng", 2592, 1536, {0, 0, 2592, 1536}, BayerPhase::grbg, 12.5, 255},
        RealFile{"n900_dog_small_grbg10in16.dng", 256, 344, {0, 0, 256, 344}, BayerPhase::grbg, 25, 1023}));

TEST(RealFilesKissX4, MaskedColumnsHoldTheBlackLevelTheReadmeMeasured) {
  const auto frame = read_raw(std::filesystem::path(LOWLUX_TESTDATA "/raws/canon_kissx4_ml_colorchart.dng"));
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_FALSE(frame->raw.masked_is_stated);
  ASSERT_FALSE(frame->raw.masked.empty());
  EXPECT_EQ(frame->raw.masked.front(), (Rect{0, 0, 152, 1182}));
  double sum[2] = {0, 0};
  int count[2] = {0, 0};
  for (int y = 30; y < 1180; ++y) {
    for (int x = 4; x < 140; ++x) {
      sum[y % 2] += frame->raw.dn.at(x, y);
      ++count[y % 2];
    }
  }
  EXPECT_NEAR(sum[0] / count[0], 2047.4, 0.1);
  EXPECT_NEAR(sum[1] / count[1], 2050.4, 0.1);
  EXPECT_EQ(frame->raw.info.model, "Canon EOS Kiss X4");
  EXPECT_FALSE(frame->raw.info.f_number) << "the decoder would invent f/1 from an empty APEX tag";
}

TEST(RealFilesGoPro, TheVc5CompressionIsNamedTogetherWithWhatHelps) {
  const auto frame = read_raw(std::filesystem::path(LOWLUX_TESTDATA "/raws/gopro_hero6_GOPR0024.gpr"));
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::unsupported);
  EXPECT_NE(frame.error().message.find("VC-5"), std::string::npos);
  EXPECT_NE(frame.error().message.find("DNG converter"), std::string::npos);
}

}  // namespace
}  // namespace lowlux::capture
