#include "isp/codec/noise_ratio_bytes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace lowlux::isp::noise_ratio_bytes_test {
namespace {

using Bytes = std::vector<std::byte>;

NoiseRatio ratio_of(int columns, int rows, int block_px) {
  NoiseRatio out{.block_px = block_px, .ratio = Plane<float>(columns, rows)};
  std::fill_n(out.ratio.data(), out.ratio.size(), 1.0f);
  return out;
}

Bytes bytes_of(std::initializer_list<int> numbers) {
  Bytes out;
  for (const int number : numbers) out.push_back(static_cast<std::byte>(number));
  return out;
}

TEST(NoiseRatioBytes, HaveTheStatedLayout) {
  NoiseRatio ratio = ratio_of(3, 2, 300);
  const std::array values{1.0f, 0.125f, 2.0f, 0.001f, 1e6f, 0.51f};
  std::copy(values.begin(), values.end(), ratio.ratio.data());
  EXPECT_EQ(encode_noise_ratio(ratio), bytes_of({'l', 'o', 'w', 'l', 'u', 'x', 0, 1,  3,  0,   0, 0,   2,
                                                 0,   0,   0,   44,  1,   0,   0, 96, 48, 112, 0, 255, 80}));
}

// 2^(1/32) is half a step.
TEST(NoiseRatioBytes, ComeBackWithinHalfAStep) {
  const unsigned seed = 4711;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> octave(-6, 9.9);
  const auto draw = [&](int from, int to) { return std::uniform_int_distribution<int>(from, to)(random); };
  for (int round = 0; round < 100; ++round) {
    const int width = draw(1, 900), height = draw(1, 700), block_px = draw(1, 70);
    NoiseRatio ratio = ratio_of(ratio_blocks(width, block_px), ratio_blocks(height, block_px), block_px);
    for (std::size_t i = 0; i < ratio.ratio.size(); ++i) {
      ratio.ratio.data()[i] = static_cast<float>(std::exp2(octave(random)));
    }
    const auto read = decode_noise_ratio(encode_noise_ratio(ratio), width, height);
    ASSERT_TRUE(read && *read) << "seed " << seed << ", round " << round;
    ASSERT_EQ((*read)->block_px, block_px);
    for (std::size_t i = 0; i < ratio.ratio.size(); ++i) {
      const double octaves = std::log2(static_cast<double>((*read)->ratio.data()[i] / ratio.ratio.data()[i]));
      ASSERT_LE(std::abs(octaves), 1.0 / 32 + 1e-6) << "seed " << seed << ", round " << round;
    }
    // Once rounded, ratios keep their bits.
    const auto again = decode_noise_ratio(encode_noise_ratio(**read), width, height);
    ASSERT_TRUE(std::equal((*read)->ratio.data(), (*read)->ratio.data() + ratio.ratio.size(), (*again)->ratio.data()));
  }
}

TEST(NoiseRatioBytes, OfOtherMakersAreNone) {
  const Bytes own = encode_noise_ratio(ratio_of(3, 2, 8));
  for (std::size_t i = 0; i < 7; ++i) {
    Bytes other = own;
    other[i] ^= std::byte{1};
    const auto read = decode_noise_ratio(other, 24, 16);
    EXPECT_TRUE(read && !*read) << i;
  }
  for (std::size_t size = 0; size < 7; ++size) {
    const auto read = decode_noise_ratio(std::span(own).first(size), 24, 16);
    EXPECT_TRUE(read && !*read) << size;
  }
}

TEST(NoiseRatioBytes, ThatAreDamagedAreRefusedByName) {
  const Bytes own = encode_noise_ratio(ratio_of(30, 20, 8));
  const auto refused = [](std::span<const std::byte> bytes, int width = 240, int height = 160) {
    const auto read = decode_noise_ratio(bytes, width, height);
    if (read) return false;
    EXPECT_EQ(read.error().code, ErrorCode::malformed);
    EXPECT_NE(read.error().message.find("DNGPrivateData"), std::string::npos);
    EXPECT_EQ(read.error().message.find('\n'), std::string::npos);
    return true;
  };
  EXPECT_FALSE(refused(own));
  for (std::size_t size = 7; size < own.size(); ++size) EXPECT_TRUE(refused(std::span(own).first(size))) << size;
  Bytes longer = own;
  longer.push_back({});
  EXPECT_TRUE(refused(longer));
  for (std::size_t at = 7; at < 18; ++at) {
    for (const int damage : {1, 2, 16, 128, 255}) {
      Bytes damaged = own;
      damaged[at] ^= static_cast<std::byte>(damage);
      EXPECT_TRUE(refused(damaged)) << at << " by " << damage;
    }
  }
  // The same blocks for a frame of other sizes.
  for (const int width : {232, 241, 1'000'000'000}) EXPECT_TRUE(refused(own, width, 160)) << width;
  for (const int height : {152, 161}) EXPECT_TRUE(refused(own, 240, height)) << height;
  EXPECT_FALSE(refused(own, 233, 153));
}

TEST(NoiseRatioBytes, ThatClaimMoreThanThereIsTakeNoMemory) {
  // 2^31 x 2^31 blocks of one pixel, as a frame of that size would have.
  const Bytes huge =
      bytes_of({'l', 'o', 'w', 'l', 'u', 'x', 0, 1, 255, 255, 255, 127, 255, 255, 255, 127, 1, 0, 0, 0, 5});
  EXPECT_FALSE(decode_noise_ratio(huge, 2147483647, 2147483647));
}

}  // namespace
}  // namespace lowlux::isp::noise_ratio_bytes_test
