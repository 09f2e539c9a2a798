#include "isp/base/text.h"

#include <gtest/gtest.h>

#include <array>
#include <string>

namespace lowlux {
namespace {

using Names = std::vector<std::string_view>;

constexpr std::array<std::string_view, 6> verbs{"develop", "denoise", "info", "reproduce", "D65", "retarget"};

TEST(NearMatches, EachKindOfSlipIsOneEdit) {
  for (const char* slip : {"devellop", "devlop", "devalop", "devleop", "DEVELOP"}) {
    EXPECT_EQ(near_matches(slip, verbs), Names{"develop"}) << slip;
  }
}

TEST(NearMatches, AThirdOfTheLettersMayDifferAndNoMore) {
  EXPECT_EQ(near_matches("dxvxlop", verbs), Names{"develop"});  // 7 letters, 2 edits
  EXPECT_EQ(near_matches("dxvxlxp", verbs), Names{});           // 3 edits
  EXPECT_EQ(near_matches("d55", verbs), Names{"D65"});          // 3 letters, 1 edit
  EXPECT_EQ(near_matches("e55", verbs), Names{});
  EXPECT_EQ(near_matches("D6", verbs), Names{"D65"});
}

TEST(NearMatches, ABeginningFindsItsContinuations) {
  EXPECT_EQ(near_matches("re", verbs), (Names{"reproduce", "retarget"}));
  EXPECT_EQ(near_matches("repro", verbs), Names{"reproduce"});
  EXPECT_EQ(near_matches("produce", verbs), (Names{"reproduce"}));  // two letters missing in front
}

TEST(NearMatches, NearestComeFirstThenLongerBeginningsThenTheGivenOrder) {
  constexpr std::array<std::string_view, 5> lamps{"FL2x", "FL13", "FL12", "xL1", "FL1"};
  EXPECT_EQ(near_matches("FL1", lamps), (Names{"FL1", "FL13", "FL12"}));  // three, though "xL1" is one edit away too
  EXPECT_EQ(near_matches("xL13", lamps), (Names{"xL1", "FL13"}));
}

TEST(NearMatches, NothingIsNearToNothingOrToTooMuch) {
  EXPECT_TRUE(near_matches("", verbs).empty());
  EXPECT_TRUE(near_matches("develop", {}).empty());
  const std::string longest(64, 'a'), too_long(65, 'a');
  const std::array<std::string_view, 3> names{longest, too_long, ""};
  EXPECT_EQ(near_matches(longest, names), (Names{longest, too_long}));
  EXPECT_TRUE(near_matches(too_long, names).empty());
}

}  // namespace
}  // namespace lowlux
