// Guards speed: how many lanes the float arithmetic leaves to the slow way. Compiled with the flags of a kernel, for
// the lowest instruction set; the brackets are the same bits on all.
#include <gtest/gtest.h>
#if defined(__aarch64__)
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#include <hwy/highway.h>

#include "isp/base/random/random-inl.h"
#include "isp/base/random/random.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::draws::HWY_NAMESPACE {
namespace {

double fraction_of_open_lanes(float mean) {
  constexpr std::uint32_t vectors = 500'000;
  const Row row{0, 0, 0, 0, {12, 34}};
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(Words()));
  std::size_t open = 0;
  for (std::uint32_t i = 0; i < vectors; ++i) {
    const FourWords r = words_of(row, hn::Iota(Words(), i * lanes));
    open += hn::CountTrue(Floats(), open_lanes(poisson_bracket(r.word[0], valid_mean(constant(mean)))));
  }
  return static_cast<double>(open) / (static_cast<double>(vectors) * lanes);
}

TEST(PoissonBracket, LeavesLessThanOneInTwoHundredOpenJustAboveTheChangeOfMethod) {
  for (const float mean : {12.0f, 12.5f, 13.0f, 15.0f, 17.3f, 20.0f}) {
    EXPECT_LT(fraction_of_open_lanes(mean), 0.005) << mean;
  }
}

TEST(PoissonBracket, LeavesLessThanOneInFiveHundredOpenElsewhere) {
  for (const float mean : {0.0f, 1e-6f, 0.01f, 0.5f, 3.0f, 8.0f, 11.99f, 20.5f, 100.0f, 1e3f, 1e4f, 1e5f, 1e6f}) {
    EXPECT_LT(fraction_of_open_lanes(mean), 0.002) << mean;
  }
}

}  // namespace
}  // namespace lowlux::draws::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
