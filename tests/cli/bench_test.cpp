#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "isp/bench/bench_stages.h"
#include "tests/cli/command.h"
#include "tests/support/process.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using Json = nlohmann::json;

test::ProcessResult bench(std::vector<std::string> args) {
  args.insert(args.begin(), {test::tested_command(), "bench"});
  return test::run_process(args);
}

std::size_t count(const std::string& text, std::string_view what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + what.size())) ++n;
  return n;
}

const std::string pictures = LOWLUX_TESTDATA "/pictures";

TEST(Bench, ListNamesTheStagesAndMeasuresNone) {
  const auto list = bench({"--list"});
  EXPECT_EQ(list.exit_code, 0);
  EXPECT_TRUE(list.out.starts_with("denoise "));
  EXPECT_EQ(std::count(list.out.begin(), list.out.end(), '\n'), std::ssize(isp::bench_stages()));
  for (const char* stage : {"chroma-start", "demosaic", "mesopic", "retarget", "develop", "error-sources", "scaling"}) {
    EXPECT_NE(list.out.find(std::string("\n") + stage + " "), std::string::npos) << stage;
  }
}

TEST(Bench, HelpNamesTheOptions) {
  const auto help = bench({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  for (const char* option : {"--stage", "--quick", "--json", "--pictures", "--threads", "--force", "--output"}) {
    EXPECT_NE(help.out.find(option), std::string::npos) << option;
  }
  for (const char* made_for : {"less than 15 minutes on two cores", "less than a minute on two cores"}) {
    EXPECT_NE(help.out.find(made_for), std::string::npos) << made_for;
  }
}

TEST(Bench, MeasuresEveryMethodInEveryLightAndWritesAllFiles) {
  const test::ScratchDirectory scratch;
  const std::string folder = scratch.file("a/b");
  const auto result = bench({"--stage", "denoise", "--quick", "--json", "--pictures-folder", pictures, "-o", folder});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  const Json stage = Json::parse(result.out).at(0);
  EXPECT_EQ(stage["stage"], "denoise");
  EXPECT_GT(stage["took_s"].get<double>(), 0);
  std::set<std::string> methods;
  for (const Json& row : stage["rows"]) {
    methods.insert(row["method"].get<std::string>());
    EXPECT_GT(row["psnr_db"].get<double>(), 0);
    EXPECT_EQ(row["s_per_mp"].is_null(), row["method"] == "noise-free");
    EXPECT_EQ(row["spread_percent"].is_null(), row["method"] == "noise-free");
  }
  for (const char* method :
       {"noise-free", "none", "dark-left-in", "chromatic", "opencv-nlm", "gat-standard", "draft", "standard", "high"}) {
    EXPECT_EQ(methods.count(method), 1u) << method;
  }
  EXPECT_EQ(stage["rows"].size(), 2 * methods.size());
  EXPECT_TRUE(std::any_of(stage["findings"].begin(), stage["findings"].end(),
                          [](const Json& f) { return f["id"] == "denoise/nlm-psnr-20/2" && f["holds"].is_boolean(); }));
  EXPECT_EQ(Json::parse(scratch.read("a/b/denoise.json")), stage);
  EXPECT_TRUE(scratch.read("a/b/denoise.csv").starts_with("mean_e,dark_e,read_noise_e,method,psnr_db,"));
  EXPECT_NE(scratch.read("a/b/denoise.csv").find(",threads,instruction set\n"), std::string::npos);
  const Json& machine = stage["machine"];
  const std::string timing = stage["remarks"].at(1).get<std::string>();
  EXPECT_NE(timing.find("one thread"), std::string::npos) << timing;
  EXPECT_TRUE(timing.ends_with(machine["kernels"].get<std::string>())) << timing;
  EXPECT_GE(machine["processors"].get<int>(), 1);
  EXPECT_TRUE(machine["kernels"].is_string() && machine["compiler"].is_string());
  const std::string page = scratch.read("a/b/bench.html");
  for (const char* twice : {"<canvas", R"(<input type="range")"}) EXPECT_EQ(count(page, twice), 2u) << twice;
  for (const auto& light : {"20-2", "4-200"}) {
    for (const char* which : {"", "-none", "-standard"}) {
      EXPECT_EQ(scratch.read(std::string("a/b/denoise-") + light + which + ".png").substr(1, 3), "PNG");
    }
  }
  const auto entries = std::filesystem::directory_iterator(folder);
  EXPECT_EQ(std::distance(begin(entries), end(entries)), 1 + 2 + 6);
}

TEST(Bench, AFileInTheWayStopsItBeforeTheWork) {
  const test::ScratchDirectory scratch;
  for (const char* name : {"bench.html", "denoise.json"}) {
    scratch.write(name, "mine");
    const auto result =
        bench({"--pictures-folder", pictures, "-o", scratch.path()});  // not quick: it would take minutes
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.err.find("--force"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(name), std::string::npos) << result.err;
    EXPECT_EQ(scratch.read(name), "mine");
    EXPECT_EQ(scratch.names().size(), 1u);
    std::filesystem::remove(scratch.file(name));
  }
}

TEST(Bench, WithoutImagesTheErrorNamesTheirFolder) {
  const test::ScratchDirectory scratch;
  const auto missing = bench({"--pictures-folder", scratch.file("none")});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_NE(missing.err.find("--pictures-folder"), std::string::npos) << missing.err;
  EXPECT_EQ(std::count(missing.err.begin(), missing.err.end(), '\n'), 1);
  const auto empty = bench({"--stage", "denoise", "--quick", "--pictures-folder", scratch.path()});
  EXPECT_EQ(empty.exit_code, 1);
  EXPECT_NE(empty.err.find(".png"), std::string::npos) << empty.err;
}

TEST(Bench, ProgramsAreScoredNextToOurLevels) {
  const test::ScratchDirectory scratch;
  const std::vector<std::string> words{
      "--quick",           "--seed", "7", "--method", "copy=cp {in} {out}", "--method", "mute=: {in} {out.png}",
      "--pictures-folder", pictures};
  std::vector<std::string> with_output = words;
  with_output.insert(with_output.end(), {"-o", scratch.file("board")});
  const auto result = bench(with_output);
  EXPECT_EQ(result.exit_code, 1);  // because one failed
  EXPECT_NE(result.err.find("method mute: it wrote no clean.png"), std::string::npos) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  const auto json = nlohmann::json::parse(scratch.read("board/methods.json"));
  std::map<std::string, double> psnr;
  for (const auto& row : json["rows"]) psnr[row["method"]] = row["PSNR [dB]"].get<double>();
  for (const char* level : {"lowlux-draft", "lowlux-standard", "lowlux-high", "lowlux-best"}) {
    EXPECT_GT(psnr.at(level), psnr.at("copy") + 5) << level;  // dB; at 20 e-
  }
  EXPECT_EQ(psnr.size(), 7u);
  EXPECT_EQ(json["settings"]["seed"], "7");
  EXPECT_EQ(json["settings"]["method copy"], "cp {in} {out}");
  EXPECT_NE(json["settings"]["command"].get<std::string>().find("'copy=cp {in} {out}'"), std::string::npos);
  EXPECT_EQ(json["failures"].size(), 1u);
  EXPECT_NE(scratch.read("board/bench.html").find("To repeat it"), std::string::npos);
  EXPECT_NE(scratch.read("board/methods.csv").find("lowlux-best"), std::string::npos);
}

TEST(Bench, AShardRunsItsStages) {
  const auto ran = [](const std::string& shard) {
    const auto result = bench({"--stage", "scene-light,photon-sampling", "--quick", "--json", "--shard", shard,
                               "--pictures-folder", pictures});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<std::string> ids;
    for (const Json& stage : Json::parse(result.out)) ids.push_back(stage["stage"]);
    return ids;
  };
  EXPECT_EQ(ran("1/2"), std::vector<std::string>{"scene-light"});
  EXPECT_EQ(ran("2/2"), std::vector<std::string>{"photon-sampling"});
  const auto beyond =
      bench({"--stage", "scene-light,photon-sampling", "--quick", "--shard", "3/3", "--pictures-folder", pictures});
  EXPECT_EQ(beyond.exit_code, 2);
  EXPECT_NE(beyond.err.find("shard 3 of 3 is empty: 2 stages are requested"), std::string::npos) << beyond.err;
}

TEST(Bench, WrongCommandLinesExitWithTwo) {
  const std::vector<std::vector<std::string>> wrong{{"--stage", "zzz"},
                                                    {"--method", "dcrow"},
                                                    {"--method", "a=p {in}"},
                                                    {"--method", "a=p {in} {out}", "--method", "a=q {in} {out}"},
                                                    {"--seed", "x"},
                                                    {"--time-limit", "0"},
                                                    {"--time-limit", "nan"},
                                                    {"--time-limit", "inf"},
                                                    {"--stage"},
                                                    {"--pictures", "none"},
                                                    {"--threads", "0"},
                                                    {"--threads", "x"},
                                                    {"denoise"},
                                                    {"-o"}};
  for (const auto& args : wrong) {
    const auto result = bench(args);
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(args);
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(result.out, "");
  }
}

}  // namespace
}  // namespace lowlux
