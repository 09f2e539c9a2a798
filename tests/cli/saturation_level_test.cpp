#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "isp/output/dng/dng_writer.h"
#include "tests/cli/command.h"
#include "tests/pipeline/saturated_night.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::lowlux;
using Json = nlohmann::json;

/// Two frames of a night on a sensor that saturates at 14000 +- 8 of 16383 DN.
class SaturationLevelOption : public testing::Test {
 protected:
  void SetUp() override {
    const test::Burst night = test::saturated_night({14000, 8}, {40000, 80000, 50000});
    for (int i = 0; i < 2; ++i) {
      const auto written = isp::write_dng(night.frame(i), frame(i), {});
      ASSERT_TRUE(written) << written.error().message;
    }
  }
  std::string frame(int index) const { return scratch_.file("night_" + std::to_string(index) + ".dng"); }

  std::string printed(std::vector<std::string> words, const std::string& output) {
    words.insert(words.end(), {"-o", scratch_.file(output), "--force"});
    const auto result = lowlux(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  }

  test::ScratchDirectory scratch_;
};

TEST_F(SaturationLevelOption, IsStatedByExplainAndJson) {
  const std::vector<std::vector<std::string>> runs{
      {"develop", frame(0)}, {"denoise", frame(0)}, {"merge", frame(0), frame(1)}};
  for (const auto& run : runs) {
    SCOPED_TRACE(run[0]);
    const std::string output = run[0] == "develop" ? "out.png" : "out.dng";
    const auto with = [&](std::vector<std::string> more) {
      more.insert(more.begin(), run.begin(), run.end());
      return printed(more, output);
    };
    EXPECT_NE(with({"--explain"}).find("saturation"), std::string::npos);
    EXPECT_EQ(with({"--explain", "--saturation-level", "white"}).find("below the stated white"), std::string::npos);
    const auto report = [&](const std::vector<std::string>& more) {
      const Json json = Json::parse(with(more));
      return json.is_array() ? json[0] : json;
    };
    const Json found = report({"--json"})["saturation"];
    EXPECT_NEAR(found["mean_dn"].get<double>(), 14000, 4);
    EXPECT_NEAR(found["std_dn"].get<double>(), 8, 2);
    EXPECT_TRUE(report({"--json", "--saturation-level", "white"})["saturation"].is_null());
  }
}

}  // namespace
}  // namespace lowlux
