#include "capture/synthetic/readout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "tests/reference/readout_ref.h"
#include "tests/support/draw_bits.h"
#include "tests/support/only_target.h"

namespace lowlux::capture {
namespace {

constexpr DrawStream stream{.seed = 31, .frame = 2, .purpose = draw_purpose::electrons};

struct Rows {
  std::vector<float> mean, steady, offset;

  RowCharge spans() const { return {mean, steady, offset}; }
  reference::PixelCharge at(std::size_t i) const {
    return {mean[i], steady.empty() ? 0 : steady[i], offset.empty() ? 0 : offset[i]};
  }
};

Rows rows(bool with_steady, bool with_offset) {
  constexpr std::size_t width = 2003;
  Rows out{test::scattered_means(7, width), {}, {}};
  for (std::size_t i = 0; with_steady && i < width; ++i) out.steady.push_back(0.37f * static_cast<float>(i % 997));
  for (std::size_t i = 0; with_offset && i < width; ++i) out.offset.push_back(0.11f * static_cast<float>(i % 101) - 5);
  return out;
}

/// Holds the codes against the reference; where float may round to the other side, either code is right.
void expect_reference(const Rows& in, const ReadoutParameters& p) {
  std::vector<float> dn(in.mean.size());
  read_out_row(stream, 21, 3, in.spans(), p, std::span(dn));
  std::size_t on_the_edge = 0;
  for (std::size_t i = 0; i < dn.size(); ++i) {
    const PhiloxWords words = words_at(stream, static_cast<std::uint32_t>(21 + i), 3);
    const reference::PixelReadout expected = reference::read_out(words, in.at(i), p);
    const double difference = std::abs(dn[i] - expected.result_dn);
    const double edge = p.quantisation == Quantisation::round ? 0.5 : 0;
    const double from_edge = std::abs(std::remainder(expected.dn - edge, 1));
    if (p.quantise && from_edge <= expected.float_dn) {
      ++on_the_edge;
      ASSERT_LE(difference, 1) << i;
    } else {
      ASSERT_LE(difference, p.quantise ? 0 : expected.float_dn) << i << " mean " << in.mean[i];
    }
  }
  EXPECT_LT(on_the_edge, dn.size() / 50) << "so that nearly all are held to equality";
}

TEST(Readout, EqualsTheReferenceWithEveryEffectOnAndOff) {
  for (int effects = 0; effects < 64; ++effects) {
    const auto on = [effects](int bit) { return ((effects >> bit) & 1) != 0; };
    ReadoutParameters p{.gain_dn_per_e = 0.43f, .black_dn = 63.7f, .max_dn = 4095};
    p.photon_noise = on(0);
    p.read_noise_e = on(1) ? 4.25f : 0;
    p.quantise = on(2);
    p.clip = on(3);
    if (on(1)) p.full_well_e = 5000;
    p.quantisation = on(0) == on(1) ? Quantisation::round : Quantisation::floor;
    SCOPED_TRACE(effects);
    expect_reference(rows(on(4), on(5)), p);
  }
}

TEST(Readout, HalvesGoToTheEvenCode) {
  const std::vector<float> mean{0.5f, 1.5f, 2.5f, 3.5f, 4.5f, -0.5f, 5.0f};
  std::vector<std::uint16_t> dn(mean.size());
  read_out_row(stream, 0, 0, {mean, {}, {}}, {.photon_noise = false}, std::span(dn));
  EXPECT_EQ(dn, (std::vector<std::uint16_t>{0, 2, 2, 4, 4, 0, 5}));
}

TEST(Readout, WellFillsBeforeNoiseIsAdded) {
  const std::vector<float> mean(4000, 2000), offset(4000, 10);
  std::vector<float> dn(mean.size());
  const ReadoutParameters p{.full_well_e = 1000, .read_noise_e = 5, .quantise = false, .clip = false};
  read_out_row(stream, 0, 0, {mean, {}, offset}, p, std::span(dn));
  double sum = 0, squares = 0;
  for (const float v : dn) sum += v - 1010, squares += (v - 1010) * (v - 1010);
  EXPECT_LT(std::abs(sum / 4000), 5 * 5 / std::sqrt(4000.0)) << "5 standard errors";
  EXPECT_LT(std::abs(squares / 4000 / 25 - 1), 5 * std::sqrt(2 / 4000.0)) << "5 standard errors";
}

TEST(Readout, ValuesBelowBlackStayWhereNothingIsClipped) {
  const std::vector<float> mean(1000, 0);
  std::vector<float> dn(1000);
  read_out_row(stream, 0, 0, {mean, {}, {}}, {.read_noise_e = 4, .clip = false}, std::span(dn));
  EXPECT_LT(*std::min_element(dn.begin(), dn.end()), -4);
  read_out_row(stream, 0, 0, {mean, {}, {}}, {.read_noise_e = 4}, std::span(dn));
  EXPECT_EQ(*std::min_element(dn.begin(), dn.end()), 0);
}

TEST(Readout, LargestCodeOfSixteenBitsIsReached) {
  const std::vector<float> mean(40, 1e6f);
  std::vector<std::uint16_t> dn(40);
  read_out_row(stream, 0, 0, {mean, {}, {}}, {}, std::span(dn));
  EXPECT_EQ(dn, std::vector<std::uint16_t>(40, 65535));
}

TEST(Readout, IsTheSameBitsOnAllTargets) {
  const Rows in = rows(true, true);
  const ReadoutParameters p{.full_well_e = 9000, .read_noise_e = 3, .gain_dn_per_e = 1.7f, .clip = false};
  const auto read = [&] {
    std::vector<float> dn(in.mean.size());
    read_out_row(stream, 0, 0, in.spans(), p, std::span(dn));
    return test::hash_of<float>(dn);
  };
  const std::uint64_t best = read();
  ASSERT_FALSE(test::kernel_targets().empty());
  for (const std::int64_t target : test::kernel_targets()) {
    const test::OnlyTarget only(target);
    EXPECT_EQ(read(), best) << hwy::TargetName(target);
  }
}

}  // namespace
}  // namespace lowlux::capture
