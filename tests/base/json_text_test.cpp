#include "isp/base/json_text.h"

#include <algorithm>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace lowlux {
namespace {

TEST(JsonDepth, LevelsAreThoseOfArraysAndObjects) {
  EXPECT_FALSE(nests_deeper("", 0));
  EXPECT_FALSE(nests_deeper("1", 0));
  EXPECT_TRUE(nests_deeper("[]", 0));
  EXPECT_FALSE(nests_deeper(R"([{"a":1},{"b":[]}])", 3));
  EXPECT_TRUE(nests_deeper(R"([{"a":1},{"b":[]}])", 2));
}

TEST(JsonDepth, BracketsInTextsAreNotLevels) {
  EXPECT_FALSE(nests_deeper(R"(["[[[[", "{{{{"])", 1));
  EXPECT_FALSE(nests_deeper(R"(["\"[[[["])", 1));
  EXPECT_TRUE(nests_deeper(R"(["\\",[[]]])", 2));
  EXPECT_FALSE(nests_deeper("\"\\", 0));  // ends after the backslash
}

TEST(JsonDepth, RandomTreesHaveTheirDepth) {
  std::mt19937 random(17);
  for (int round = 0; round < 200; ++round) {
    std::string text;
    int depth = 0, deepest = 0;
    for (int step = 0; step < 60; ++step) {
      if (random() % 2 == 0) {
        text += "[";
        deepest = std::max(deepest, ++depth);
      } else if (depth > 1) {
        text += "],";
        --depth;
      } else {
        text += R"("[{",)";
      }
    }
    EXPECT_FALSE(nests_deeper(text, deepest)) << text;
    EXPECT_EQ(nests_deeper(text, deepest - 1), deepest > 0) << text;
  }
}

}  // namespace
}  // namespace lowlux
