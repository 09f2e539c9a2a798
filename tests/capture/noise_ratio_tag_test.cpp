// The noise ratio of a DNG: DNGPrivateData that lowlux wrote.
#include "isp/codec/noise_ratio_bytes.h"
#include "tests/capture/read_built.h"

namespace lowlux::test {
namespace {

constexpr std::uint16_t dng_private_data = 50740;

std::vector<std::byte> ratio_bytes(int width, int height, int block_px) {
  NoiseRatio ratio{.block_px = block_px,
                   .ratio = Plane<float>(ratio_blocks(width, block_px), ratio_blocks(height, block_px))};
  for (std::size_t i = 0; i < ratio.ratio.size(); ++i) ratio.ratio.data()[i] = i % 2 == 0 ? 1 : 0.25f;
  return isp::encode_noise_ratio(ratio);
}

std::vector<std::byte> text_bytes(const std::string& text) {
  std::vector<std::byte> out;
  for (const char letter : text) out.push_back(static_cast<std::byte>(letter));
  return out;
}

DngBuilder with(const std::vector<std::byte>& bytes) {
  DngBuilder dng;
  dng.set(dng_private_data, Tag::opaque(bytes));
  return dng;
}

TEST(NoiseRatioTag, IsReadForTheActiveArea) {
  const RawFrame plain = read_built(DngBuilder{});
  EXPECT_EQ(plain.noise_ratio, nullptr);
  const Rect& active = plain.raw.active;
  const RawFrame frame = read_built(with(ratio_bytes(active.width, active.height, 8)));
  EXPECT_TRUE(frame.warnings.empty());
  ASSERT_NE(frame.noise_ratio, nullptr);
  EXPECT_EQ(frame.noise_ratio->block_px, 8);
  EXPECT_EQ(frame.noise_ratio->ratio.width(), ratio_blocks(active.width, 8));
  EXPECT_EQ(frame.noise_ratio->ratio.at(0, 0), 1);
  EXPECT_EQ(frame.noise_ratio->ratio.at(1, 0), 0.25f);
}

TEST(NoiseRatioTag, OfAnotherMakerIsIgnoredWithoutAWarning) {
  for (const std::string& text : {std::string("Adobe\0MakN 0123456789", 21), std::string("PENTAX \0II", 10),
                                  std::string(), std::string("lowlu"), std::string("lowluxX\0\0", 9)}) {
    const RawFrame frame = read_built(with(text_bytes(text)));
    EXPECT_TRUE(frame.warnings.empty()) << text;
    EXPECT_EQ(frame.noise_ratio, nullptr) << text;
  }
}

TEST(NoiseRatioTag, ThatIsDamagedIsIgnoredWithOneWarning) {
  const Rect active = read_built(DngBuilder{}).raw.active;
  const auto sound = ratio_bytes(active.width, active.height, 8);
  std::vector<std::vector<std::byte>> damaged{ratio_bytes(active.width + 8, active.height, 8),
                                              ratio_bytes(active.width, active.height + 8, 8),
                                              {sound.begin(), sound.end() - 1},
                                              {sound.begin(), sound.begin() + 12},
                                              text_bytes(std::string("lowlux\0", 7))};
  damaged.push_back(sound);
  damaged.back()[7] = std::byte{2};  // a later layout
  for (const auto& bytes : damaged) {
    const std::string warning = warned(with(bytes));
    EXPECT_NE(warning.find("DNGPrivateData"), std::string::npos) << warning;
    EXPECT_EQ(read_built(with(bytes)).noise_ratio, nullptr);
  }
}

}  // namespace
}  // namespace lowlux::test
