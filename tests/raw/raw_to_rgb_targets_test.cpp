#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "isp/raw/kernel/raw_to_rgb.h"
#include "tests/raw/raw_to_rgb_support.h"
#include "tests/support/only_target.h"

namespace lowlux {
namespace {

using namespace raw_to_rgb_testing;

struct Pictures {
  std::vector<std::uint8_t> codes8;
  std::vector<std::uint16_t> codes16;
  std::vector<float> linear;
  std::vector<float> half;
};

Pictures pictures_of(const isp::DnMosaic& in) {
  const int w = in.dn.width, h = in.dn.height;
  InlineExecutor one;
  isp::RawToRgb kernel(w, 1);
  Strided<std::uint8_t> codes8(3 * w, h, 0, 0);
  Strided<std::uint16_t> codes16(3 * w, h, 0, 0);
  Strided<float> linear(w, 3 * h, 0, 0), half(w / 2, 3 * (h / 2), 0, 0);
  const ToneTable tone = reference::srgb_tone_table();
  const auto third = [](Strided<float>& all, int c) {
    return all.view().crop(0, c * (all.height / 3), all.width, all.height / 3);
  };
  kernel.rgb8(in, typical_transform(), tone, codes8.view(), one);
  kernel.rgb16(in, typical_transform(), tone, codes16.view(), one);
  kernel.linear(in, typical_transform(), {third(linear, 0), third(linear, 1), third(linear, 2)}, one);
  kernel.bin2x2(in, {third(half, 0), third(half, 1), third(half, 2)}, one);
  return {codes8.memory, codes16.memory, linear.memory, half.memory};
}

template <class T>
double largest_difference(const std::vector<T>& a, const std::vector<T>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    worst = std::max(worst, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
  }
  return worst;
}

TEST(RawToRgbTargets, AgreeWithinOneCode) {
  const auto dn = random_dn(203, 61, 9);
  const isp::DnMosaic in{dn.view(), BayerPhase::bggr, uneven_levels()};
  const Pictures best = pictures_of(in);
  ASSERT_FALSE(test::kernel_targets().empty());
  for (const std::int64_t target : test::kernel_targets()) {
    const test::OnlyTarget only(target);
    ASSERT_STREQ(isp::raw_to_rgb_target(), hwy::TargetName(target));
    const Pictures pictures = pictures_of(in);
    EXPECT_LE(largest_difference(pictures.codes8, best.codes8), 1) << hwy::TargetName(target);
    EXPECT_LE(largest_difference(pictures.codes16, best.codes16), 4) << hwy::TargetName(target);
    EXPECT_LE(largest_difference(pictures.linear, best.linear), 3e-6) << hwy::TargetName(target);
    EXPECT_EQ(pictures.half, best.half) << hwy::TargetName(target);
  }
}

TEST(RawToRgbTargets, ChooseTheBestTheProcessorHas) {
  EXPECT_STREQ(isp::raw_to_rgb_target(), hwy::TargetName(test::kernel_targets().front()));
  EXPECT_TRUE(isp::cpu_runs_raw_to_rgb());
}

}  // namespace
}  // namespace lowlux
