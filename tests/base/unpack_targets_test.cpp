#include <gtest/gtest.h>

#include "tests/base/unpack_check.h"
#include "tests/support/only_target.h"

namespace lowlux {
namespace {

TEST(UnpackTargets, AllGiveTheReferencesCodes) {
  ASSERT_FALSE(test::kernel_targets().empty());
  for (const std::int64_t target : test::kernel_targets()) {
    const test::OnlyTarget only(target);
    ASSERT_STREQ(unpack_target(), hwy::TargetName(target));
    for (const RawFormat& format : unpack_testing::layouts()) {
      unpack_testing::expect_reference_between_guards(format, unpack_testing::widths());
    }
  }
}

TEST(UnpackTargets, ChooseTheBestTheProcessorHas) {
  EXPECT_STREQ(unpack_target(), hwy::TargetName(test::kernel_targets().front()));
}

}  // namespace
}  // namespace lowlux
