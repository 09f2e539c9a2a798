#include <gtest/gtest.h>

#include "isp/raw/kernel/raw_to_rgb.h"
#include "tests/raw/raw_to_rgb_support.h"
#include "tests/support/count_allocations.h"

namespace lowlux {
namespace {

using namespace raw_to_rgb_testing;

TEST(RawToRgbAllocation, CountsItsOwnAllocations) {
  const long before = test::allocations;
  const isp::RawToRgb kernel(64, 1);
  EXPECT_GT(test::allocations, before);
}

TEST(RawToRgbAllocation, IsZeroForTenFramesAfterTheFirst) {
  constexpr int w = 333, h = 50;
  const auto dn = random_dn(w, h, 10);
  const auto value = random_signed(w, h, 11);
  const ToneTable tone = reference::srgb_tone_table();
  PoolExecutor two(2);
  isp::RawToRgb kernel(w, 2);
  Strided<std::uint8_t> codes8(3 * w, h, 0, 0);
  Strided<std::uint16_t> codes16(3 * w, h, 0, 0);
  Strided<float> r(w, h, 0, 0), g = r, b = r;
  const isp::DnMosaic from_dn{dn.view(), BayerPhase::rggb, uneven_levels()};
  const isp::SignedMosaic from_float{value.view()};
  const isp::CameraPlanes from_planes{{value.view(), value.view(), value.view()}};
  const auto frame = [&] {
    kernel.rgb8(from_dn, typical_transform(), tone, codes8.view(), two);
    kernel.rgb16(from_float, typical_transform(), tone, codes16.view(), two);
    kernel.linear(from_planes, typical_transform(), {r.view(), g.view(), b.view()}, two);
    kernel.bin2x2(
        from_dn,
        {r.view().crop(0, 0, w / 2, h / 2), g.view().crop(0, 0, w / 2, h / 2), b.view().crop(0, 0, w / 2, h / 2)}, two);
  };
  frame();
  const long before = test::allocations;
  for (int i = 0; i < 10; ++i) frame();
  EXPECT_EQ(test::allocations, before);
}

}  // namespace
}  // namespace lowlux
