#include <gtest/gtest.h>

#include <vector>

#include "isp/base/random/random.h"
#include "isp/base/random/random_rows.h"
#include "tests/support/draw_bits.h"
#include "tests/support/only_target.h"

namespace lowlux {
namespace {

struct Hashes {
  std::uint64_t words = test::hash_of<float>({});
  std::uint64_t poisson = words;
  std::uint64_t normal = words;

  bool operator==(const Hashes&) const = default;
};

Hashes hashes() {
  constexpr std::size_t width = 517;
  const DrawStream stream{.seed = 42, .frame = 1};
  std::vector<float> row(width);
  std::vector<std::uint32_t> words(width);
  Hashes out;
  for (std::uint32_t y = 0; y < 400; ++y) {
    words_row(stream, 3, y, 2, words);
    out.words = test::hash_of<std::uint32_t>(words, out.words);
    poisson_row(stream, 3, y, test::scattered_means(y, width), row);
    out.poisson = test::hash_of<float>(row, out.poisson);
    normal_row(stream, 3, y, 3, row);
    out.normal = test::hash_of<float>(row, out.normal);
  }
  return out;
}

TEST(RandomTargets, AllGiveTheSameBits) {
  const Hashes best = hashes();
  ASSERT_FALSE(test::kernel_targets().empty());
  for (const std::int64_t target : test::kernel_targets()) {
    const test::OnlyTarget only(target);
    EXPECT_STREQ(draws::target_name(), hwy::TargetName(target));
    EXPECT_TRUE(hashes() == best) << hwy::TargetName(target);
    EXPECT_TRUE(draws::products_are_rounded()) << hwy::TargetName(target);
  }
}

}  // namespace
}  // namespace lowlux
