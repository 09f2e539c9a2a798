#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using test::lowlux;

const Json plain{
    {"count", 3}, {"scenes", {"flat"}}, {"sensors", {"ELD_NikonD850"}}, {"size", "64x48"}, {"exposure_s", 0.1}};

class DatasetFaults : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return scratch_.file(name); }
  std::string spec(const Json& json) {
    scratch_.write("spec.json", json.dump());
    return file("spec.json");
  }
  test::ProcessResult run(const std::string& folder, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{"dataset", file("spec.json"), "-o", file(folder)};
    words.insert(words.end(), more.begin(), more.end());
    return lowlux(words);
  }
  void made(const Json& json, const std::string& folder, const std::vector<std::string>& more = {}) {
    spec(json);
    const auto result = run(folder, more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
  }

  test::ScratchDirectory scratch_;
};

TEST_F(DatasetFaults, MemoryDoesNotGrowWithTheFramesOfASample) {
  Json json = plain;
  json["count"] = 1, json["size"] = "800x600";
  double peak_bytes[2] = {};
  for (const int many : {0, 1}) {
    json["frames"] = many == 1 ? 64 : 4;
    spec(json);
    const auto result = run(many == 1 ? "many" : "few", {"--quiet"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    peak_bytes[many] = result.peak_bytes;
  }
  // 60 frames of 800 x 600 codes have 58 MB.
  EXPECT_LT(peak_bytes[1], peak_bytes[0] + 20e6);
  EXPECT_TRUE(scratch_.holds("many/000000000000_0063.mask.npy"));
}

}  // namespace
}  // namespace lowlux
