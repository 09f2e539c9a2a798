#include "calib/profile/json_keys.h"

#include <chrono>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace lowlux::calib {
namespace {

using Kind = JsonFault::Kind;

TEST(JsonKeys, AcceptsWhatIsWithinTheLimits) {
  const JsonLimits limits{.max_depth = 2, .max_keys = 2};
  for (const char* text : {"1", "{}", "[]", R"({"a":{"a":1},"b":[{"a":[]}]})", R"([{"a":1},{"a":1}])"}) {
    EXPECT_EQ(find_json_fault(text, {}), std::nullopt) << text;
  }
  for (const char* text : {"[[1]]", R"({"a":{"b":1,"c":{}}})"}) {
    EXPECT_EQ(find_json_fault(text, limits), std::nullopt) << text;
  }
}

TEST(JsonKeys, NamesTheFirstFault) {
  const JsonLimits limits{.max_depth = 2, .max_keys = 2};
  struct Case {
    std::string text;
    Kind kind;
    std::vector<std::string> keys;
  };
  const Case cases[] = {
      {"[[[1]]]", Kind::too_deep, {}},
      {R"({"a":[[{}]]})", Kind::too_deep, {}},
      {R"({"a":1,"b":1,"c":1})", Kind::too_many_keys, {}},
      {R"({"a":1,"a":1})", Kind::duplicate_key, {"a"}},
      {R"({"b":1,"a":{"c":1,"c":[[[1]]]}})", Kind::duplicate_key, {"a", "c"}},
      {R"([{"a":1},{"a":[],"a":1}])", Kind::duplicate_key, {"a"}},
      {R"({"a":1,"a":1)", Kind::not_json, {}},  // text that is not JSON has no keys
      {"[[[1]]] 2", Kind::not_json, {}},
      {"[1e999]", Kind::number_too_large, {}},
  };
  for (const Case& c : cases) {
    const auto fault = find_json_fault(c.text, limits);
    ASSERT_TRUE(fault) << c.text;
    EXPECT_EQ(fault->kind, c.kind) << c.text;
    EXPECT_EQ(fault->keys, c.keys) << c.text;
  }
}

TEST(JsonKeys, TheByteOfAFaultLiesInTheText) {
  const std::string whole = R"({"a":[1,"b",{"c":true}]})";
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto fault = find_json_fault(std::string_view(whole).substr(0, size), {});
    ASSERT_TRUE(fault) << size;
    EXPECT_EQ(fault->kind, Kind::not_json) << size;
    EXPECT_EQ(fault->byte, size);
  }
}

TEST(JsonKeys, ListsOfManyObjectsTakeLinearTime) {
  // Callbacks of the JSON library took 0.07 s for 10,000 objects and 7 s for 100,000.
  std::string text = "[{}";
  for (int i = 1; i < 200'000; ++i) text += ",{}";
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(find_json_fault(text + "]", {}), std::nullopt);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2));
}

}  // namespace
}  // namespace lowlux::calib
