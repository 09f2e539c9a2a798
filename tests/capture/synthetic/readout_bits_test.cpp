// What has to hold on every processor and compiler, and so is run on Arm too (scripts/cross-aarch64).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "capture/synthetic/readout.h"
#include "tests/support/draw_bits.h"

namespace lowlux::capture::readout_bits_test {
namespace {

constexpr DrawStream stream{.seed = 0xfedcba9876543210, .frame = 9, .purpose = draw_purpose::electrons};
constexpr std::size_t width = 1003;

ReadoutParameters camera() {
  return {.full_well_e = 9000, .read_noise_e = 3.5f, .gain_dn_per_e = 0.37f, .black_dn = 64, .max_dn = 4095};
}

struct Charge {
  std::vector<float> mean, steady, offset;
  RowCharge spans() const { return {mean, steady, offset}; }
};

/// All three charges, of rows in no order; offsets are signed.
Charge charge(std::uint32_t y) {
  Charge out{test::scattered_means(y, width), std::vector<float>(width), std::vector<float>(width)};
  for (std::uint32_t i = 0; i < width; ++i) {
    const PhiloxWords w = words_at({.seed = 98}, i, y);
    out.steady[i] = static_cast<float>(w[0] % 100'000) / 64;
    out.offset[i] = static_cast<float>(w[1] % 2000) / 128 - 7;
  }
  return out;
}

template <class T>
std::vector<T> read(std::uint32_t x0, std::uint32_t y, const RowCharge& row, const ReadoutParameters& p) {
  std::vector<T> dn(row.mean_e.size());
  read_out_row(stream, x0, y, row, p, std::span<T>(dn));
  return dn;
}

TEST(ReadoutBits, CodesHaveThisHashOnEveryMachine) {
  std::uint64_t hash = test::hash_of<float>({});
  for (std::uint32_t y = 0; y < 200; ++y) {
    hash = test::hash_of<std::uint16_t>(read<std::uint16_t>(5, y, charge(y).spans(), camera()), hash);
  }
  EXPECT_EQ(hash, 17890655696477004288ULL);
}

TEST(ReadoutBits, SignedFloatsHaveThisHashOnEveryMachine) {
  ReadoutParameters p = camera();
  p.clip = false;
  std::uint64_t hash = test::hash_of<float>({});
  for (std::uint32_t y = 0; y < 200; ++y) {
    p.quantise = y % 3 != 0;
    p.quantisation = y % 3 == 1 ? Quantisation::round : Quantisation::floor;
    p.black_dn = y % 2 == 0 ? 0.0f : 64.0f;
    hash = test::hash_of<float>(read<float>(5, y, charge(y).spans(), p), hash);
  }
  EXPECT_EQ(hash, 1665581193210807202ULL);
}

TEST(ReadoutBits, ARowInPiecesIsTheRow) {
  const Charge all = charge(1);
  const auto whole = read<std::uint16_t>(11, 1, all.spans(), camera());
  for (const std::size_t piece : {1U, 7U, 16U, 64U, 333U}) {
    for (std::size_t i = 0; i < width; i += piece) {
      const std::size_t size = std::min(piece, width - i);
      const RowCharge some{std::span(all.mean).subspan(i, size), std::span(all.steady).subspan(i, size),
                           std::span(all.offset).subspan(i, size)};
      const auto dn = read<std::uint16_t>(static_cast<std::uint32_t>(11 + i), 1, some, camera());
      ASSERT_TRUE(std::equal(dn.begin(), dn.end(), whole.begin() + static_cast<std::ptrdiff_t>(i))) << piece;
    }
  }
}

TEST(ReadoutBits, CodesAreTheQuantisedFloats) {
  const Charge all = charge(2);
  for (const Quantisation quantisation : {Quantisation::round, Quantisation::floor}) {
    ReadoutParameters p = camera();
    p.quantisation = quantisation;
    const auto codes = read<std::uint16_t>(0, 2, all.spans(), p);
    const auto floats = read<float>(0, 2, all.spans(), p);
    p.quantise = p.clip = false;
    const auto fractions = read<float>(0, 2, all.spans(), p);
    for (std::size_t i = 0; i < width; ++i) {
      const bool nearest = quantisation == Quantisation::round;
      const float whole = nearest ? std::nearbyint(fractions[i]) : std::floor(fractions[i]);
      ASSERT_EQ(floats[i], std::clamp(whole, 0.0f, 4095.0f)) << i;
      ASSERT_EQ(static_cast<float>(codes[i]), floats[i]) << i;
    }
  }
}

TEST(ReadoutBits, NothingIsWrittenBesideTheRow) {
  for (std::size_t size = 0; size <= 40; ++size) {
    std::vector<std::uint16_t> codes(size + 2, 7);
    std::vector<float> floats(size + 2, -7);
    const std::vector<float> mean(size, 30);
    read_out_row(stream, 0, 0, {mean, {}, {}}, camera(), std::span(codes).subspan(1, size));
    read_out_row(stream, 0, 0, {mean, {}, {}}, camera(), std::span(floats).subspan(1, size));
    ASSERT_TRUE(codes.front() == 7 && codes.back() == 7 && floats.front() == -7 && floats.back() == -7) << size;
  }
}

TEST(ReadoutBits, ChargesThatAreNoNumberGiveTheCodeZero) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  const std::vector<float> mean(5, 100), steady{nan, 0, 0, infinite, 0}, offset{0, nan, infinite, 0, -infinite};
  const auto codes = read<std::uint16_t>(0, 0, {mean, steady, offset}, camera());
  EXPECT_EQ(codes[0], 0);
  EXPECT_EQ(codes[1], 0);
  EXPECT_EQ(codes[2], 4095);
  EXPECT_NEAR(codes[3], 64 + 0.37 * 9000, 5 * 0.37 * 3.5) << "full, and 5 standard deviations of read noise";
  EXPECT_EQ(codes[4], 0);
}

}  // namespace
}  // namespace lowlux::capture::readout_bits_test
