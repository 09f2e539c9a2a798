#include "isp/codec/lossless_jpeg.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <random>
#include <utility>

namespace lowlux::isp {
namespace {

/// Decodes lossless JPEG bit by bit, as ITU-T T.81 states it in annexes C, F.2.2 and H.
class Decoder {
 public:
  explicit Decoder(const std::vector<std::byte>& bytes) : bytes_(bytes) {}

  std::vector<std::uint16_t> decode() {
    EXPECT_EQ(u16(), 0xFFD8);
    read_table();
    EXPECT_EQ(u16(), 0xFFC3);
    u16();
    const int precision = u8();
    rows = u16(), columns = u16(), components = u8();
    at_ += 3 * static_cast<std::size_t>(components);
    EXPECT_EQ(u16(), 0xFFDA);
    at_ += 3 + 2 * static_cast<std::size_t>(components);
    EXPECT_EQ(u8(), 1);  // predictor
    u16();
    std::vector<std::uint16_t> samples;
    const std::size_t stride = static_cast<std::size_t>(columns) * components, n = components;
    for (std::size_t i = 0; i < stride * rows; ++i) {
      const bool first_row = i < stride, first_column = i % stride < n;
      const int prediction = !first_column ? samples[i - n] : first_row ? 1 << (precision - 1) : samples[i - stride];
      samples.push_back(static_cast<std::uint16_t>(prediction + difference()));
    }
    while (used_ != 0) EXPECT_EQ(bit(), 1);
    EXPECT_EQ(u16(), 0xFFD9);
    EXPECT_EQ(at_, bytes_.size());
    return samples;
  }

  int rows = 0, columns = 0, components = 0;

 private:
  int u8() { return std::to_integer<int>(bytes_.at(at_++)); }
  int u16() {
    const int high = u8();
    return high << 8 | u8();
  }
  void read_table() {
    EXPECT_EQ(u16(), 0xFFC4);
    const std::size_t end = at_ + u16();
    EXPECT_EQ(u8(), 0);
    std::array<int, 16> counts{};
    for (int& count : counts) count = u8();
    int code = 0;
    for (int length = 1; length <= 16; ++length, code <<= 1) {
      for (int i = 0; i < counts[length - 1]; ++i) {
        EXPECT_NE(code, (1 << length) - 1) << "the code of ones alone is reserved";
        table_[{length, code++}] = u8();
      }
    }
    EXPECT_EQ(at_, end);
  }
  int bit() {
    if (used_ == 0) {
      current_ = u8();
      const int next = current_ == 0xFF ? u8() : 0;
      EXPECT_EQ(next, 0);
    }
    const int value = current_ >> (7 - used_) & 1;
    used_ = (used_ + 1) % 8;
    return value;
  }
  int difference() {
    int code = 0, category = -1;
    for (int length = 1; category < 0 && length <= 16; ++length) {
      code = code << 1 | bit();
      if (const auto found = table_.find({length, code}); found != table_.end()) category = found->second;
    }
    if (category == 16) return 32768;
    int value = 0;
    for (int i = 0; i < category; ++i) value = value << 1 | bit();
    return category > 0 && value < 1 << (category - 1) ? value - (1 << category) + 1 : value;
  }

  const std::vector<std::byte>& bytes_;
  std::size_t at_ = 0;
  std::map<std::pair<int, int>, int> table_;  // category of a length and code
  int current_ = 0, used_ = 0;
};

std::vector<std::uint16_t> decoded(const Plane<std::uint16_t>& samples, int components, int bits,
                                   std::size_t* size = nullptr) {
  const std::vector<std::byte> bytes = encode_lossless_jpeg(samples.view(), components, bits);
  Decoder decoder(bytes);
  std::vector<std::uint16_t> out = decoder.decode();
  EXPECT_EQ(decoder.rows, samples.height());
  EXPECT_EQ(decoder.columns * components, samples.width());
  EXPECT_EQ(decoder.components, components);
  if (size != nullptr) *size = bytes.size();
  return out;
}

std::vector<std::uint16_t> values_of(const Plane<std::uint16_t>& samples) {
  return {samples.data(), samples.data() + samples.size()};
}

TEST(LosslessJpeg, SamplesOfAnySizeRangeAndNoiseAreDecodedBitByBit) {
  const std::uint64_t seed = std::random_device{}();
  std::mt19937_64 random(seed);
  const auto log_uniform = [&](double least, double most) {
    return least * std::exp(std::uniform_real_distribution<>(0, std::log(most / least))(random));
  };
  for (int i = 0; i < 300; ++i) {
    const int components = 1 + static_cast<int>(random() % 4), bits = 2 + static_cast<int>(random() % 15);
    const int columns = static_cast<int>(log_uniform(1, 300)), rows = static_cast<int>(log_uniform(1, 100));
    const double white = std::exp2(bits) - 1, mean = log_uniform(0.01, white), noise = log_uniform(0.01, 2 * white);
    Plane<std::uint16_t> samples(columns * components, rows);
    std::normal_distribution<> values(mean, noise);
    for (std::size_t k = 0; k < samples.size(); ++k) {
      samples.data()[k] = static_cast<std::uint16_t>(std::clamp(std::round(values(random)), 0.0, white));
    }
    ASSERT_EQ(decoded(samples, components, bits), values_of(samples))
        << "seed " << seed << ", image " << i << ": " << columns << " x " << rows << " x " << components << ", "
        << bits;
  }
}

TEST(LosslessJpeg, EveryDifferenceIsDecoded) {
  constexpr int rows = 512;
  Plane<std::uint16_t> samples(2 * 128, rows);
  for (unsigned i = 0; i < 65536; ++i) {  // differences i modulo 2^16, from samples all over the range
    const auto from = static_cast<std::uint16_t>(40503U * i);
    samples.at(2 * (i % 128), i / 128) = from;
    samples.at(2 * (i % 128) + 1, i / 128) = static_cast<std::uint16_t>(from + i);
  }
  EXPECT_EQ(decoded(samples, 1, 16), values_of(samples));
}

/// Huffman's codes of counts that grow as Fibonacci's numbers do have one bit more for each symbol: 17 here, which the
/// table of a JPEG cannot state.
TEST(LosslessJpeg, CodesAreNeverLongerThan16Bits) {
  std::vector<int> differences;
  for (int category = 0, count = 1, before = 1; category < 17; ++category) {
    differences.insert(differences.end(), count, category == 0 ? 0 : 1 << (category - 1));
    count += std::exchange(before, count);
  }
  Plane<std::uint16_t> samples(static_cast<int>(differences.size()) + 1, 1);
  samples.at(0, 0) = 32768;
  for (int i = 0; i < static_cast<int>(differences.size()); ++i) {
    samples.at(i + 1, 0) = static_cast<std::uint16_t>(samples.at(i, 0) + differences[i]);
  }
  EXPECT_EQ(decoded(samples, 1, 16), values_of(samples));
}

/// A Huffman code takes at most p + 0.086 bits per symbol more than the entropy, where p is the probability of the most
/// frequent one (Gallager 1978, Variations on a theme by Huffman). The rest, below 1 %: bytes of 0 after those of ones.
TEST(LosslessJpeg, SizeIsNearTheEntropyOfTheCategories) {
  std::mt19937 random(7);
  for (const double noise : {0.3, 3.0, 30.0, 300.0}) {
    Plane<std::uint16_t> samples(512, 512);
    std::normal_distribution<> values(5000, noise);
    for (std::size_t k = 0; k < samples.size(); ++k) {
      samples.data()[k] = static_cast<std::uint16_t>(std::lround(values(random)));
    }
    std::array<double, 17> counts{};
    double bits_of_values = 0;
    for (int y = 0; y < 512; ++y) {
      for (int x = 2; x < 512; ++x) {
        const int d = std::abs(samples.at(x, y) - samples.at(x - 2, y)), category = std::bit_width(unsigned(d));
        ++counts[category];
        bits_of_values += category;
      }
    }
    double entropy = 0;
    const double all = 512.0 * 510, most = *std::max_element(counts.begin(), counts.end());
    for (const double count : counts) entropy -= count > 0 ? count * std::log2(count / all) : 0;
    std::size_t size = 0;
    EXPECT_EQ(decoded(samples, 2, 16, &size), values_of(samples));
    EXPECT_LT(8.0 * static_cast<double>(size), (bits_of_values + entropy + most + 0.086 * all) * 1.01) << noise;
  }
}

}  // namespace
}  // namespace lowlux::isp
