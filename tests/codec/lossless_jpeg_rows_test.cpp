// Lossless JPEG is read in every form that DNG allows: all predictors, components, tables and restart intervals, in
// rows of other lengths than the lines of the JPEG. Damaged ones are refused.
#include "isp/codec/lossless_jpeg_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <random>

#include "isp/codec/lossless_jpeg.h"

namespace lowlux::isp {
namespace {

constexpr unsigned seed = 20261129;

struct Form {
  int columns = 1, lines = 1, components = 1, precision = 16, predictor = 1, tables = 1;
  int restart_lines = 0;    // 0: none
  bool is_dng_1_0 = false;  // 16 bits follow the code of category 16
};

/// Writes lossless JPEG as ITU-T T.81 states it in annexes B, C, F.1.2 and H, bit by bit.
class PlainEncoder {
 public:
  PlainEncoder(const Form& form, const std::vector<std::uint16_t>& samples) : form_(form), samples_(samples) {}

  std::vector<std::byte> encode() {
    put({0xFF, 0xD8, 0xFF, 0xFE, 0, 4, 'l', 'x'});  // a comment
    for (int t = 0; t < form_.tables; ++t) put_table(t);
    if (form_.restart_lines > 0) put({0xFF, 0xDD, 0, 4}), put_u16(form_.restart_lines * form_.columns);
    put({0xFF, 0xC3, 0, 8 + 3 * form_.components, form_.precision});
    put_u16(form_.lines), put_u16(form_.columns), put({form_.components});
    for (int i = 0; i < form_.components; ++i) put({i + 1, 0x11, 0});
    put({0xFF, 0xDA, 0, 6 + 2 * form_.components, form_.components});
    for (int i = 0; i < form_.components; ++i) put({i + 1, i % form_.tables << 4});
    put({form_.predictor, 0, 0});
    for (int y = 0; y < form_.lines; ++y) {
      const bool restarts = form_.restart_lines > 0 && y > 0 && y % form_.restart_lines == 0;
      if (restarts) finish(), put({0xFF, 0xD0 + (y / form_.restart_lines - 1) % 8});
      for (int i = 0; i < stride(); ++i) put_sample(y, i, y == 0 || restarts);
    }
    finish();
    put({0xFF, 0xD9});
    return out_;
  }

 private:
  int stride() const { return form_.columns * form_.components; }
  int at(int y, int i) const { return samples_[static_cast<std::size_t>(y) * stride() + i]; }
  void put(std::initializer_list<int> bytes) {
    for (const int byte : bytes) out_.push_back(static_cast<std::byte>(byte));
  }
  void put_u16(int value) { put({value >> 8, value & 255}); }
  /// Category c has the code c of 5 bits in even tables, and one of 2 to 16 bits in odd ones.
  void put_table(int t) {
    const bool is_even = t % 2 == 0;
    put({0xFF, 0xC4, 0, 2 + 17 + 17, t});
    for (int length = 1; length <= 16; ++length)
      put({is_even ? (length == 5 ? 17 : 0) : length == 16 ? 3 : length > 1});
    for (int category = 0; category <= 16; ++category) put({category});
  }
  void put_bits(int value, int count) {
    for (int i = count - 1; i >= 0; --i) {
      byte_ = byte_ << 1 | (value >> i & 1);
      if (++used_ == 8) flush();
    }
  }
  void flush() {
    put({byte_});
    if (byte_ == 0xFF) put({0});
    byte_ = used_ = 0;
  }
  void finish() {
    while (used_ != 0) put_bits(1, 1);
  }
  int prediction(int y, int i, bool is_first) const {
    const int n = form_.components;
    if (is_first) return i < n ? 1 << (form_.precision - 1) : at(y, i - n);
    const int above = at(y - 1, i);
    if (i < n) return above;
    const int left = at(y, i - n), corner = at(y - 1, i - n);
    const std::array<int, 8> of_predictor = {0,
                                             left,
                                             above,
                                             corner,
                                             left + above - corner,
                                             left + ((above - corner) >> 1),
                                             above + ((left - corner) >> 1),
                                             (left + above) >> 1};
    return of_predictor[form_.predictor];
  }
  void put_sample(int y, int i, bool is_first) {
    const int difference = static_cast<std::int16_t>(at(y, i) - prediction(y, i, is_first));
    const int category = std::bit_width(static_cast<unsigned>(std::abs(difference)));
    if (i % form_.components % form_.tables % 2 == 0) {
      put_bits(category, 5);
    } else if (category < 15) {
      put_bits(((1 << category) - 1) << 1, category + 2);  // a 0, `category` ones, a 0
    } else {
      put_bits(category == 15 ? 0x7FFF : 0x8000, 16);
    }
    if (category < 16 || form_.is_dng_1_0)
      put_bits(difference > 0 ? difference : difference + (1 << category) - 1, category);
  }

  Form form_;
  const std::vector<std::uint16_t>& samples_;
  std::vector<std::byte> out_;
  int byte_ = 0, used_ = 0;
};

std::vector<std::uint16_t> drawn_samples(const Form& form, std::mt19937& random) {
  std::vector<std::uint16_t> samples(static_cast<std::size_t>(form.columns) * form.lines * form.components);
  const unsigned range = 1U << (1 + random() % static_cast<unsigned>(form.precision));
  for (auto& sample : samples) sample = static_cast<std::uint16_t>(random() % range);
  return samples;
}

Form drawn_form(std::mt19937& random) {
  const auto below = [&](int end) { return static_cast<int>(random() % static_cast<unsigned>(end)); };
  return {.columns = 1 + below(60),
          .lines = 1 + below(40),
          .components = 1 + below(4),
          .precision = 2 + below(15),
          .predictor = 1 + below(7),
          .tables = 1 + below(4),
          .restart_lines = below(3) == 0 ? 1 + below(9) : 0,
          .is_dng_1_0 = below(4) == 0};
}

/// Returns the first `count` samples of a JPEG in rows of `row`; fewer if it does not decode.
std::vector<std::uint16_t> read(const std::vector<std::byte>& jpeg, std::size_t row, std::size_t count, int bits = 16,
                                bool is_dng_1_0 = false) {
  LosslessJpegRows rows({.bits = bits, .has_bits_of_category_16 = is_dng_1_0}, row);
  rows.open(jpeg);
  std::vector<std::uint16_t> out, one(row);
  while (out.size() < count && rows.next(one)) out.insert(out.end(), one.begin(), one.end());
  return out;
}

TEST(LosslessJpegRows, EveryFormGivesTheSamplesThatWereEncoded) {
  std::mt19937 random(seed);
  for (int i = 0; i < 400; ++i) {
    const Form form = drawn_form(random);
    const auto samples = drawn_samples(form, random);
    const std::size_t row =
        i % 2 == 0 ? static_cast<std::size_t>(form.columns * form.components) : 1 + random() % samples.size();
    const std::size_t count = samples.size() / row * row;
    const auto decoded = read(PlainEncoder(form, samples).encode(), row, count, 16, form.is_dng_1_0);
    ASSERT_TRUE(std::equal(decoded.begin(), decoded.end(), samples.begin()) && decoded.size() == count)
        << form.columns << " x " << form.lines << " x " << form.components << ", " << form.precision
        << " bits, predictor " << form.predictor << ", " << form.tables << " tables, restart " << form.restart_lines
        << ", rows of " << row << ", draw " << i << " of seed " << seed;
  }
}

TEST(LosslessJpegRows, TheDifferenceOf32768IsReadAsEachVersionOfDngWritesIt) {
  Form form{.columns = 9, .lines = 5};
  std::vector<std::uint16_t> samples;
  for (int i = 0; i < 45; ++i) samples.push_back(static_cast<std::uint16_t>(i % 3 == 0 ? 100 : 100 + 32768));
  for (const bool is_dng_1_0 : {false, true}) {
    form.is_dng_1_0 = is_dng_1_0;
    const auto jpeg = PlainEncoder(form, samples).encode();
    EXPECT_EQ(read(jpeg, 9, 45, 16, is_dng_1_0), samples);
    EXPECT_NE(read(jpeg, 9, 45, 16, !is_dng_1_0), samples);
  }
}

TEST(LosslessJpegRows, WhatIsWrittenIsRead) {
  std::mt19937 random(seed + 1);
  Plane<std::uint16_t> samples(90, 33);
  for (std::size_t i = 0; i < samples.size(); ++i) samples.data()[i] = static_cast<std::uint16_t>(random());
  const std::vector<std::uint16_t> expected(samples.data(), samples.data() + samples.size());
  for (const int components : {1, 2, 3}) {
    EXPECT_EQ(read(encode_lossless_jpeg(samples.view(), components), 90, expected.size()), expected);
  }
}

TEST(LosslessJpegRows, MoreSamplesOrBitsThanThereAreAreRefused) {
  const Form form{.columns = 20, .lines = 10, .precision = 12};
  std::vector<std::uint16_t> samples(200, 100);
  EXPECT_EQ(read(PlainEncoder(form, samples).encode(), 20, 220).size(), 200u);
  samples[77] = 1024;
  const auto jpeg = PlainEncoder(form, samples).encode();
  EXPECT_EQ(read(jpeg, 20, 200, 11), samples);
  EXPECT_EQ(read(jpeg, 20, 200, 10).size(), 60u) << "up to the row of the sample of 11 bits";
}

TEST(LosslessJpegRows, DamageNeverReadsBeyondTheFileOrCrashes) {
  std::mt19937 random(seed + 2);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    const Form form = drawn_form(random);
    const auto samples = drawn_samples(form, random);
    auto jpeg = PlainEncoder(form, samples).encode();
    if (i % 2 == 0) jpeg.resize(random() % jpeg.size());
    for (int flips = 0; flips < 2 && !jpeg.empty(); ++flips) {
      jpeg[random() % jpeg.size()] ^= static_cast<std::byte>(1U << random() % 8);
    }
    refused += read(jpeg, 7, samples.size()).size() < samples.size() / 7 * 7;
  }
  EXPECT_GT(refused, 1500) << "of 1500 that were cut and 1500 that were not";
}

TEST(LosslessJpegRows, FormsThatAreNotSupportedAreRefused) {
  const Form form{.columns = 8, .lines = 8, .components = 2};
  const auto jpeg = PlainEncoder(form, std::vector<std::uint16_t>(128, 9)).encode();
  const auto refuses = [&](std::size_t at, int value) {
    auto changed = jpeg;
    changed[at] = static_cast<std::byte>(value);
    return read(changed, 16, 128).empty();
  };
  constexpr std::size_t frame = 8 + 38;  // after the start, the comment and one table
  ASSERT_EQ(jpeg[frame + 1], std::byte{0xC3});
  EXPECT_FALSE(refuses(frame + 1, 0xC3));
  EXPECT_TRUE(refuses(frame + 1, 0xC0)) << "lossy";
  EXPECT_TRUE(refuses(frame + 11, 0x21)) << "subsampled";
  EXPECT_TRUE(refuses(frame + 16 + 11, 1)) << "point transform";
  EXPECT_TRUE(refuses(frame + 16 + 9, 0)) << "predictor 0";
  EXPECT_TRUE(refuses(frame + 16 + 9, 8)) << "predictor 8";
  EXPECT_TRUE(refuses(frame + 16 + 6, 0x30)) << "a table that is not there";
}

}  // namespace
}  // namespace lowlux::isp
