#include "isp/codec/float_rows.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <random>

#include "tests/support/dng/float_dng.h"

namespace lowlux::isp {
namespace {

using test::FloatStore;

std::vector<std::byte> stored(const std::vector<std::uint32_t>& patterns, std::size_t width, const FloatStore& how) {
  std::vector<std::byte> out;
  for (std::size_t i = 0; i < patterns.size(); i += width) {
    const auto first = patterns.begin() + static_cast<std::ptrdiff_t>(i);
    const auto row = test::stored_row({first, first + static_cast<std::ptrdiff_t>(width)}, how);
    out.insert(out.end(), row.begin(), row.end());
  }
  return how.deflate ? test::deflated(out) : out;
}

RowStorage storage_of(const FloatStore& how) {
  const int factor = how.predictor == 3 ? 1 : how.predictor == 34894 ? 2 : how.predictor == 34895 ? 4 : 0;
  return {how.bits, how.deflate, factor * how.samples, how.big_endian};
}

/// Compares with the oracle in double: a float holds every value of fewer bits. NaN agrees with NaN.
void expect_values(std::span<const float> row, const std::uint32_t* patterns, int bits) {
  for (std::size_t i = 0; i < row.size(); ++i) {
    const double expected = test::value_of_pattern(patterns[i], bits);
    if (std::isnan(expected)) {
      EXPECT_TRUE(std::isnan(row[i])) << std::hex << patterns[i];
    } else {
      ASSERT_EQ(static_cast<double>(row[i]), expected) << std::hex << patterns[i];
      ASSERT_EQ(std::signbit(row[i]), std::signbit(expected)) << std::hex << patterns[i];
    }
  }
}

TEST(FloatRows, EveryHalfIsItsValue) {
  std::vector<std::uint32_t> patterns(65536);
  for (std::uint32_t i = 0; i < 65536; ++i) patterns[i] = i;
  const FloatStore how{.bits = 16};
  const auto bytes = stored(patterns, 256, how);
  FloatRows rows(storage_of(how), 256);
  rows.open(bytes);
  std::vector<float> row(256);
  for (std::size_t y = 0; y < 256; ++y) {
    ASSERT_TRUE(rows.next(row));
    expect_values(row, &patterns[256 * y], 16);
  }
  EXPECT_FALSE(rows.next(row)) << "the part is used up";
}

TEST(FloatRows, EveryStorageOfEveryDepthGivesTheValues) {
  constexpr unsigned seed = 20261124;
  std::mt19937 draw(seed);
  for (const int bits : {16, 24, 32}) {
    for (const int samples : {1, 3}) {
      for (const std::size_t pixels : {1, 2, 7, 64}) {
        const std::size_t width = pixels * static_cast<std::size_t>(samples);
        std::vector<std::uint32_t> patterns(5 * width);
        for (std::uint32_t& pattern : patterns) pattern = draw() >> (32 - bits);
        patterns[0] = 0;  // zero, the smallest and the largest subnormal
        patterns[patterns.size() / 2] = 1U;
        patterns.back() = bits == 16 ? 0x83FFU : bits == 24 ? 0x80FFFFU : 0x807FFFFFU;
        for (const bool big_endian : {false, true}) {
          for (const int predictor : {0, 1, 3, 34894, 34895}) {  // 0: not deflated
            const FloatStore how{bits, samples, predictor != 0, std::max(predictor, 1), 0, 0, big_endian};
            const auto bytes = stored(patterns, width, how);
            FloatRows rows(storage_of(how), width);
            std::vector<float> row(width);
            for (int part = 0; part < 2; ++part) {  // the reader serves one part after another
              rows.open(bytes);
              for (std::size_t y = 0; y < 5; ++y) {
                ASSERT_TRUE(rows.next(row)) << bits << " bits, predictor " << predictor << ", seed " << seed;
                expect_values(row, &patterns[y * width], bits);
              }
              EXPECT_TRUE(rows.ends_within(0));
              EXPECT_FALSE(rows.next(row));
            }
          }
        }
      }
    }
  }
}

TEST(FloatRows, DamageAndTruncationAreNoticed) {
  const FloatStore how{.deflate = true, .predictor = 3};
  std::vector<std::uint32_t> patterns(40 * 30);
  for (std::size_t i = 0; i < patterns.size(); ++i)
    patterns[i] = std::bit_cast<std::uint32_t>(std::sin(0.1F * static_cast<float>(i)));
  const auto good = stored(patterns, 40, how);
  const auto is_read = [&](std::span<const std::byte> bytes) {
    FloatRows rows(storage_of(how), 40);
    rows.open(bytes);
    std::vector<float> row(40);
    for (int y = 0; y < 30; ++y) {
      if (!rows.next(row)) return false;
    }
    return rows.ends_within(0);
  };
  EXPECT_TRUE(is_read(good));
  EXPECT_FALSE(is_read({}));
  EXPECT_FALSE(is_read(std::span(good).first(good.size() / 2)));
  for (std::size_t at = 0; at < good.size(); at += 7) {
    auto bad = good;
    bad[at] ^= std::byte{0x10};
    EXPECT_FALSE(is_read(bad)) << "byte " << at << " of " << good.size();
  }
}

}  // namespace
}  // namespace lowlux::isp
