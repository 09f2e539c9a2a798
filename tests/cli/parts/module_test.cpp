#include "isp/cli/shared/module.h"

#include <gtest/gtest.h>

namespace lowlux::cli {
namespace {

// Modules that stand in the folder of this program, as the command's do in its own.
Result<void*> load(const std::string& name) {
  return load_module({.file = "lib" + name + ".so", .function = "answer", .purpose = "a test", .needs = "nothing"});
}

TEST(Module, OfThisBuildIsLoaded) {
  const auto found = load("module_of_this_build");
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(reinterpret_cast<int (*)()>(*found)(), 42);
}

TEST(Module, OfAnotherBuildIsRefusedByNameThoughItHasTheFunction) {
  for (const char* name : {"module_of_another_build", "module_without_a_stamp"}) {
    const auto found = load(name);
    ASSERT_FALSE(found) << name;
    EXPECT_EQ(found.error().code, ErrorCode::unreadable);
    EXPECT_NE(found.error().message.find(std::string(name) + ".so belongs to another build of lowlux"),
              std::string::npos)
        << found.error().message;
  }
}

TEST(Module, ThatIsMissingIsNamedWithWhatItNeeds) {
  const auto found = load("no_such_module");
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().message.find("a test needs libno_such_module.so and nothing: "), 0u);
}

}  // namespace
}  // namespace lowlux::cli
