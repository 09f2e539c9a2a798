#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "isp/cli/dataset/dataset_draw.h"
#include "isp/cli/dataset/dataset_spec.h"
#include "isp/cli/develop/cost_file.h"
#include "tests/cli/command.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using test::holds;
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
  /// Expects one line that begins with the spec's file, and no folder.
  void refused(const std::string& message) {
    const auto result = run("refused");
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_TRUE(result.err.starts_with("lowlux: " + file("spec.json") + ": ")) << result.err.substr(0, 300);
    EXPECT_TRUE(holds(result.err, message)) << message << '\n' << result.err.substr(0, 300);
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err.substr(0, 300);
    EXPECT_FALSE(scratch_.holds("refused"));
  }
  std::map<std::string, std::string> contents(const std::string& folder) const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::directory_iterator(file(folder))) {
      const std::string name = entry.path().filename();
      if (!name.starts_with("manifest")) all[name] = scratch_.read((fs::path(folder) / name).string());
    }
    return all;
  }

  test::ScratchDirectory scratch_;
};

std::string brackets(std::size_t levels) { return std::string(levels, '[') + std::string(levels, ']'); }

TEST_F(DatasetFaults, MemoryDoesNotGrowWithTheFramesOfASample) {
  Json json = plain;
  json["count"] = 1, json["size"] = "800x600";
  for (const std::string format : {"dng", "npy", "safetensors"}) {
    json["format"] = format;
    double peak_bytes[2] = {};
    for (const int many : {0, 1}) {
      json["frames"] = many == 1 ? 64 : 4;
      spec(json);
      const auto result = run(format + (many == 1 ? "/many" : "/few"), {"--quiet"});
      EXPECT_EQ(result.exit_code, 0) << result.err;
      peak_bytes[many] = result.peak_bytes;
    }
    // 60 frames of 800 x 600 codes have 58 MB.
    EXPECT_LT(peak_bytes[1], peak_bytes[0] + 20e6) << format;
  }
  for (const char* last : {"dng/many/000000000000_0063.mask.npy", "npy/many/000000000000_0063.raw.npy"}) {
    EXPECT_TRUE(scratch_.holds(last)) << last;
  }
}

TEST_F(DatasetFaults, DeepNestingIsOneLine) {
  constexpr std::size_t deep = 200000;
  const std::string rest = R"(,"count":1,"sensors":["ELD_NikonD850"])";
  for (const std::string& keys :
       {R"("scenes":[)" + brackets(deep) + "]", R"("scenes":["flat"],"gain":{"choice":)" + brackets(deep) + "}"}) {
    scratch_.write("spec.json", std::string("{").append(keys).append(rest).append("}"));
    refused("levels of brackets");
  }
  // Brackets within texts are not levels, and 64 levels are read.
  scratch_.write("spec.json", R"({"scenes":["flat\"\\)" + std::string(deep, '[') + "\"]" + rest + "}");
  refused("there is no such file");
  scratch_.write("spec.json", R"({"scenes":[)" + brackets(62) + "]" + rest + "}");
  refused("is not a string");
}

TEST_F(DatasetFaults, ADamagedSampleThatIsNestedDeeplyIsMadeAgain) {
  made(plain, "all");
  const auto all = contents("all");
  Json sample = Json::parse(all.at("000000000001.json"));
  std::string text = sample.dump();
  const std::size_t at = text.find(R"("name")");
  ASSERT_NE(at, std::string::npos);
  scratch_.write("all/000000000001.json", text.insert(at, R"("more":)" + brackets(200000) + ","));
  made(plain, "all");
  EXPECT_EQ(contents("all"), all);
}

TEST(CostFile, DeepNestingIsAnError) {
  const auto cost = cli::parse_cost(R"({"lowlux_cost_model":7,"machine":)" + brackets(200000) + "}");
  ASSERT_FALSE(cost);
  EXPECT_EQ(cost.error().code, ErrorCode::malformed);
}

TEST_F(DatasetFaults, MaskedColumnsAreDrawnEven) {
  Json json = plain;
  json["masked_columns"] = {{"uniform", {0, 64}}};
  const auto read = cli::read_dataset_spec(spec(json));
  ASSERT_TRUE(read) << read.error().message;
  std::set<int> drawn;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    drawn.insert(std::stoi(cli::draw_sample(*read, i).settings.at("masked_columns")));
  }
  std::set<int> even;
  for (int columns = 0; columns <= 64; columns += 2) even.insert(columns);
  EXPECT_EQ(drawn, even);
  json["count"] = 12;
  made(json, "all", {"--quiet"});
  json["masked_columns"] = {{"uniform", {0, 63}}};
  spec(json);
  refused("masked_columns: the limits of the range [0,63] are not even");
}

TEST_F(DatasetFaults, SettingsThatDoNotGoTogetherAreFoundBeforeAnySample) {
  Json json = plain;
  json["size"] = {{"choice", {"64x48", "60000x60000"}}};
  spec(json);
  refused("size: ");
  json = plain;
  json["black_level_dn"] = {{"choice", {0, 2000}}};
  json["white_level_dn"] = {{"choice", {16383, 1000}}};
  spec(json);
  refused("black_level_dn");
}

TEST_F(DatasetFaults, FailuresOfSamplesNameTheSpec) {
  scratch_.write("broken.png", "this is no image");
  Json json = plain;
  json["scenes"] = {"broken.png"};
  spec(json);
  const auto result = run("all", {"--quiet"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(result.err.starts_with("lowlux: " + file("spec.json") + ": sample 0, scene broken.png: ")) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

TEST_F(DatasetFaults, ForceRemovesTheFilesOfTheSamplesItReplaces) {
  Json bursts = plain;
  bursts["frames"] = 3, bursts["truth_electrons"] = true;
  made(bursts, "all", {"--quiet"});
  ASSERT_TRUE(scratch_.holds("all/000000000000_0002.dng"));
  for (const char* format : {"npy", "safetensors", "dng"}) {
    Json other = plain;
    other["format"] = format;
    made(other, "all", {"--force", "--quiet"});
    made(other, format, {"--quiet"});
    EXPECT_EQ(contents("all"), contents(format)) << format;
  }
}

TEST_F(DatasetFaults, ForceRemovesNoFileOfAnother) {
  made(plain, "all", {"--quiet"});
  Json sample = Json::parse(scratch_.read("all/000000000000.json"));
  const std::vector<std::string> others{"all/0000000000001.dng", "all/notes.txt", "outside.txt",
                                        "all/000000000002.dng"};
  for (const std::string& other : others) scratch_.write(other, "kept");
  for (const char* name :
       {"0000000000001.dng", "notes.txt", "../outside.txt", "000000000002.dng", "000000000000./../../outside.txt"}) {
    sample["files"].push_back({{"name", name}, {"bytes", 4}, {"sha256", ""}});
  }
  scratch_.write("all/000000000000.json", sample.dump());
  Json other = plain;
  other["count"] = 1, other["seed"] = 9;
  made(other, "all", {"--force", "--quiet"});
  for (const std::string& name : others) EXPECT_EQ(scratch_.read(name), "kept") << name;
}

TEST_F(DatasetFaults, AFolderThatCannotBeUsedIsOneLine) {
  spec(plain);
  fs::create_symlink("loop", file("loop"));
  scratch_.write("file", "");
  for (const std::string& folder : {std::string(300, 'x'), std::string("loop"), std::string("file")}) {
    const auto result = run(folder);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_TRUE(holds(result.err, "is not a folder, and cannot be made one")) << result.err;
    EXPECT_FALSE(holds(result.err, "filesystem error")) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
}

TEST_F(DatasetFaults, ASignalRemovesTheFolderOfADryRun) {
  Json json = plain;
  json["size"] = "2000x1500", json["count"] = 8;
  spec(json);
  fs::create_directory(file("temporary"));
  const auto holds_file = [&] {
    std::error_code gone;
    for (fs::recursive_directory_iterator at(file("temporary"), gone), end; !gone && at != end; at.increment(gone)) {
      if (at->path().extension() == ".dng") return true;
    }
    return false;
  };
  for (const int signal : {SIGINT, SIGTERM}) {
    test::RunningProcess process({"env", "TMPDIR=" + file("temporary"), test::tested_command(), "dataset",
                                  file("spec.json"), "-o", file("none"), "--dry-run", "--quiet"});
    int tries = 0;
    while (tries < 60000 && !holds_file()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      ++tries;
    }
    process.send(signal);
    EXPECT_EQ(process.wait().exit_code, 128 + signal);
    EXPECT_TRUE(fs::is_empty(file("temporary"))) << signal;
  }
}

}  // namespace
}  // namespace lowlux
