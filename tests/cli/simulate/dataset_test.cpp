#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <map>
#include <random>
#include <thread>

#include <nlohmann/json.hpp>

#include "capture/file/dng_source.h"
#include "isp/cli/dataset/dataset_draw.h"
#include "isp/cli/dataset/dataset_spec.h"
#include "isp/cli/dataset/sha256.h"
#include "tests/cli/command.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using test::holds;
using test::lowlux;

const Json small{{"seed", 3},
                 {"count", 7},
                 {"scenes", {"chart", "flat"}},
                 {"sensors", {"ELD_SonyA7S2", {{"name", "ELD_NikonD850"}, {"gain", {{"choice", {"ISO 400", 1600}}}}}}},
                 {"size", {{"choice", {"64x48", "96x64"}}}},
                 {"luminance_cd_m2", {{"log_uniform", {0.01, 10}}}},
                 {"exposure_s", {{"uniform", {0.01, 0.5}}}}};

class Dataset : public testing::Test {
 protected:
  std::string spec(const Json& json, const std::string& name = "spec.json") {
    scratch_.write(name, json.dump());
    return file(name);
  }
  std::string file(const std::string& name) const { return scratch_.file(name); }

  test::ProcessResult run(const std::string& spec, const std::string& folder, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"dataset", spec, "-o", file(folder)});
    return lowlux(more);
  }
  void made(const std::string& spec, const std::string& folder, const std::vector<std::string>& more = {}) {
    const auto result = run(spec, folder, more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
  }
  /// Returns the contents of the files of a folder, without the manifests.
  std::map<std::string, std::string> contents(const std::string& folder) const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::directory_iterator(file(folder))) {
      const std::string name = entry.path().filename();
      if (!name.starts_with("manifest")) all[name] = scratch_.read((fs::path(folder) / name).string());
    }
    return all;
  }
  Json json_of(const std::string& name) const { return Json::parse(scratch_.read(name)); }

  test::ScratchDirectory scratch_;
};

/// The parameter is the format of samples; empty: the spec does not state one.
class DatasetFormats : public Dataset, public testing::WithParamInterface<std::string> {
 protected:
  static Json of_format(Json json) {
    if (!GetParam().empty()) json["format"] = GetParam();
    return json;
  }
  static std::size_t files_per_sample() {  // raw, truth, mask and parameters; one file and parameters
    return GetParam() == "safetensors" ? 2 : 4;
  }
};
INSTANTIATE_TEST_SUITE_P(Formats, DatasetFormats, testing::Values("", "npy", "safetensors"));

TEST(Sha256, HashesAreThoseOfFips180) {
  EXPECT_EQ(cli::sha256_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(cli::sha256_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(cli::sha256_of(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PartsOfAnyLengthGiveOneHash) {
  std::mt19937 random(5);
  const std::string text(777, 'x');
  for (int repeat = 0; repeat < 20; ++repeat) {
    cli::Sha256 parts;
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t count = std::min<std::size_t>(random() % 150, text.size() - at);
      parts.add({reinterpret_cast<const unsigned char*>(text.data()) + at, count});
      at += count;
    }
    const auto hash = parts.finish();
    std::string hex;
    for (const unsigned char byte : hash) hex += {"0123456789abcdef"[byte / 16], "0123456789abcdef"[byte % 16]};
    EXPECT_EQ(hex, cli::sha256_of(text));
  }
}

TEST_P(DatasetFormats, ShardsHaveTheBytesOfTheWholeAndManifestsTheirHashes) {
  const std::string name = spec(of_format(small));
  made(name, "all");
  std::size_t listed = 0;
  for (const char* shard : {"1/3", "2/3", "3/3"}) {
    made(name, "shards", {"--shard", shard});
    const Json manifest = json_of("shards/manifest-" + std::string(1, shard[0]) + "-of-3.json");
    for (const Json& sample : manifest["samples"]) {
      for (const Json& part : sample["files"]) {
        const auto hash = cli::sha256_of_file(file("shards/" + part["name"].get<std::string>()));
        ASSERT_TRUE(hash);
        EXPECT_EQ(part["sha256"], hash->sha256);
        EXPECT_EQ(hash->bytes, part["bytes"]);
        ++listed;
      }
    }
  }
  EXPECT_EQ(contents("all"), contents("shards"));
  EXPECT_EQ(contents("all").size(), 7 * files_per_sample() + 1);  // dataset.json
  EXPECT_EQ(listed, 7 * files_per_sample());
  made(name, "none", {"--shard", "9/9"});
  EXPECT_TRUE(json_of("none/manifest-9-of-9.json")["samples"].empty());
}

TEST_P(DatasetFormats, OneThreadAnotherFolderAndMoreSamplesChangeNoByte) {
  made(spec(of_format(small)), "all");
  Json part = of_format(small);
  part["first_index"] = 2, part["count"] = 1;
  fs::create_directory(file("elsewhere"));
  spec(part, "elsewhere/one.json");
  const auto result = test::run_process(
      {"bash", "-c",
       "cd " + file("elsewhere") + " && taskset -c 0 " + test::tested_command() + " dataset one.json -o out --quiet"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const auto all = contents("all");
  for (const auto& [name, text] : contents("elsewhere/out")) EXPECT_EQ(all.at(name), text) << name;
  EXPECT_EQ(contents("elsewhere/out").size(), files_per_sample() + 1);
  made(file("elsewhere/one.json"), "all");  // samples are added to a folder, and kept
  EXPECT_EQ(contents("all"), all);
}

TEST_P(DatasetFormats, ADeletedOrCutHalfIsMadeAgain) {
  const std::string name = spec(of_format(small));
  made(name, "all");
  const auto all = contents("all");
  const std::string manifest = scratch_.read("all/manifest-1-of-1.json");
  std::mt19937 random(11);
  for (const auto& [part, text] : all) {
    if (part == "dataset.json") continue;
    if (random() % 4 == 0) fs::resize_file(file("all/" + part), text.size() / 2);
    if (random() % 2 == 0) fs::remove(file("all/" + part));
  }
  made(name, "all");
  EXPECT_EQ(contents("all"), all);
  EXPECT_EQ(scratch_.read("all/manifest-1-of-1.json"), manifest);
  const Json again = Json::parse(run(name, "all", {"--json"}).out);
  EXPECT_EQ(again["made"], 0);
  EXPECT_EQ(again["samples"], 7);
}

TEST_P(DatasetFormats, AKilledRunContinues) {
  Json many = of_format(small);
  many["count"] = 60;
  const std::string name = spec(many);
  {
    test::RunningProcess process({test::tested_command(), "dataset", name, "-o", file("killed"), "--quiet"});
    while (!scratch_.holds("killed/000000000003.json")) std::this_thread::yield();
    process.send(SIGKILL);
    EXPECT_EQ(process.wait().exit_code, 128 + SIGKILL);
  }
  EXPECT_FALSE(scratch_.holds("killed/manifest-1-of-1.json"));
  made(name, "killed", {"--quiet"});
  made(name, "whole", {"--quiet"});
  EXPECT_EQ(contents("killed"), contents("whole"));
}

TEST_P(DatasetFormats, AFullDiskLeavesNoHalfSample) {
  Json large = of_format(small);
  large["size"] = "400x300";  // 240 kB of raw, more than a file may have
  const auto result = test::run_process({"bash", "-c",
                                         "ulimit -f 100; exec " + test::tested_command() + " dataset " + spec(large) +
                                             " -o " + file("full") + " --quiet"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_TRUE(holds(result.err, "000000000000")) << result.err;
  EXPECT_EQ(contents("full").size(), 1u);  // dataset.json
}

// What Slurm does with scripts/cluster/dataset.sbatch: it runs it once for each task, and says which one in variables.
TEST_F(Dataset, TheTasksOfAJobArrayMakeTheWhole) {
  const std::string json = spec(small);
  made(json, "whole");
  const std::string script = LOWLUX_TESTDATA "/../scripts/cluster/dataset.sbatch";
  const auto task = [&](int id, int least, int most, int count, const std::vector<std::string>& more) {
    std::vector<std::string> words{"env",
                                   "LOWLUX=" + test::tested_command(),
                                   "SLURM_ARRAY_TASK_ID=" + std::to_string(id),
                                   "SLURM_ARRAY_TASK_MIN=" + std::to_string(least),
                                   "SLURM_ARRAY_TASK_MAX=" + std::to_string(most),
                                   "SLURM_ARRAY_TASK_COUNT=" + std::to_string(count),
                                   "bash",
                                   script};
    words.insert(words.end(), more.begin(), more.end());
    return test::run_process(words);
  };
  for (const int id : {3, 1}) EXPECT_EQ(task(id, 1, 3, 3, {json, file("tasks")}).exit_code, 0);
  EXPECT_EQ(task(2, 2, 2, 1, {json, file("tasks"), "3"}).exit_code, 0);  // submitted again, alone
  EXPECT_EQ(contents("tasks"), contents("whole"));

  EXPECT_EQ(task(2, 2, 2, 1, {json, file("none")}).exit_code, 2);  // of how many is not known
  EXPECT_EQ(task(1, 1, 1, 1, {json}).exit_code, 2);
  EXPECT_EQ(task(4, 4, 4, 1, {json, file("none"), "3"}).exit_code, 2);
  EXPECT_FALSE(fs::exists(file("none")));
}

TEST_F(Dataset, IndicesReachTwoToThe63) {
  Json last = small;
  last["first_index"] = 9223372036854775806U, last["count"] = 2;
  made(spec(last), "last");
  EXPECT_TRUE(scratch_.holds("last/9223372036854775807.json"));
  last["first_index"] = 0, last["count"] = 9223372036854775807U;
  made(spec(last), "huge", {"--shard", "9223372036854775807/9223372036854775807"});
  EXPECT_EQ(scratch_.read("huge/9223372036854775806.dng"), scratch_.read("last/9223372036854775806.dng"));
}

TEST_F(Dataset, MasksStateTheHotPixelsAndTheSaturatedOnes) {
  const Json dark{{"count", 1},
                  {"scenes", {"dark"}},
                  {"sensors", {"ELD_NikonD850"}},
                  {"size", "64x48"},
                  {"masked_columns", 4},
                  {"hot_pixel_fraction", 0.05},
                  {"exposure_s", 1},
                  {"hot_pixel_current_e_per_s", 1e5}};
  made(spec(dark), "dark");
  const auto frame = capture::read_raw(file("dark/000000000000.dng"));
  ASSERT_TRUE(frame);
  const std::string npy = scratch_.read("dark/000000000000.mask.npy");
  const RawDn& raw = frame->raw;
  const std::size_t pixels = raw.dn.size();
  ASSERT_TRUE(holds(npy, "'shape': (48, 68)"));
  ASSERT_EQ(npy.size(), 128 + pixels);
  const double black = 64;  // all noise without hot pixels stays within it
  std::size_t hot = 0, bright = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const unsigned mask = static_cast<unsigned char>(npy[128 + i]);
    const double code = raw.dn.data()[i];
    EXPECT_EQ(mask & 4, i % 68 < 4 ? 4u : 0u);
    EXPECT_EQ(mask & 1, code >= raw.white_dn[0] ? 1u : 0u);
    const bool is_bright = code > 400 + 10 * black;
    EXPECT_TRUE(!is_bright || (mask & 2) != 0) << i << ": " << code;
    hot += (mask & 2) != 0, bright += is_bright;
  }
  const double sigma = std::sqrt(0.05 * 0.95 * static_cast<double>(pixels));
  EXPECT_NEAR(static_cast<double>(hot), 0.05 * static_cast<double>(pixels), 5 * sigma);
  EXPECT_GT(bright, hot / 2);
}

TEST_F(Dataset, DrawsFollowTheirDistributions) {
  Json json = small;
  json["stars"] = {{"uniform", {0, 3}}};
  const auto read = cli::read_dataset_spec(spec(json));
  ASSERT_TRUE(read) << read.error().message;
  constexpr int n = 20000;
  double log_sum = 0, log_squares = 0, sum = 0, product = 0;
  std::map<std::string, int> counts;
  for (int i = 0; i < n; ++i) {
    const cli::DatasetDraw draw = cli::draw_sample(*read, static_cast<std::uint64_t>(i));
    const double luminance = std::stod(draw.settings.at("luminance_cd_m2"));
    const double exposure = std::stod(draw.settings.at("exposure_s"));
    ASSERT_TRUE(luminance >= 0.01 && luminance <= 10 && exposure >= 0.01 && exposure <= 0.5);
    const double u = std::log(luminance / 0.01) / std::log(1000.0), v = (exposure - 0.01) / 0.49;
    log_sum += u, log_squares += u * u, sum += v, product += (u - 0.5) * (v - 0.5);
    ++counts[draw.scene], ++counts[draw.sensor->name], ++counts[draw.settings.at("stars")];
  }
  // Of a uniform variable on 0..1: variance 1/12, that of its square 4/45, that of the product 1/144.
  EXPECT_NEAR(log_sum / n, 0.5, 5 / std::sqrt(12.0 * n));
  EXPECT_NEAR(sum / n, 0.5, 5 / std::sqrt(12.0 * n));
  EXPECT_NEAR(log_squares / n, 1 / 3.0, 5 * std::sqrt(4 / 45.0 / n));
  EXPECT_NEAR(product / n, 0, 5 / std::sqrt(144.0 * n));
  for (const char* half : {"chart", "flat", "ELD_SonyA7S2", "ELD_NikonD850"}) {
    EXPECT_NEAR(counts[half], n / 2.0, 5 * std::sqrt(n / 4.0)) << half;
  }
  for (const char* quarter : {"0", "1", "2", "3"}) EXPECT_NEAR(counts[quarter], n / 4.0, 5 * std::sqrt(n * 3 / 16.0));
}

TEST_F(Dataset, BadSpecsAreOneLineWithFileAndKey) {
  const auto text = [](const std::string& key) {
    return R"({"count":1,"scenes":["flat"],"sensors":["ELD_NikonD850"],)" + key + "}";
  };
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "not JSON"},
      {"{}", "count: the key is missing"},
      {"[]", "not a JSON object"},
      {text(R"("exposure_s":NaN)"), "not JSON"},
      {text(R"("exposure_s":1e999)"), "not JSON"},
      {text(R"("exposur_s":1)"), "exposur_s: unknown key; similar keys: exposure_s"},
      {text(R"("count":2)"), "count: the key is given twice"},
      {text(R"("gain":{"uniform":[1,2],"uniform":[1,2]})"), "uniform: the key is given twice"},
      {text(R"("exposure_s":{"uniform":[2,1]})"), "exposure_s: the range [2,1] is reversed"},
      {text(R"("exposure_s":{"uniform":[1,1]})"), "exposure_s: the range [1,1] is empty"},
      {text(R"("exposure_s":{"uniform":[]})"), "exposure_s: uniform is not [LOW, HIGH]"},
      {text(R"("exposure_s":{"normal":[1,2]})"), "exposure_s: unknown distribution 'normal'"},
      {text(R"("exposure_s":{"uniform":[-1,1]})"), "exposure_s: "},
      {text(R"("gain":{"choice":[]})"), "gain: choice is not a list"},
      {text(R"("gain":"ISO 123")"), "gain: "},
      {text(R"("luminance_cd_m2":{"log_uniform":[0,1]})"), "luminance_cd_m2: the range [0,1]"},
      {text(R"("luminance_cd_m2":{"uniform":[1,1e13]})"), "luminance_cd_m2: "},
      {text(R"("light":"D66")"), "light: "},
      {text(R"("size":"6x4")"), "size: "},
      {text(R"("format":"tiff")"), "format: is not one of dng, npy, safetensors"},
      {text(R"("format":"NPY")"), "format: is not one of"},
      {text(R"("format":"../npy")"), "format: is not one of"},
      {text(R"("format":"npy\u0000\n")"), "format: is not one of"},
      {text(R"("format":")" + std::string(1 << 20, 'x') + '"'), "format: is not one of"},
      {text(R"("format":"")"), "format: is not one of"},
      {text(R"("format":null)"), "format: is not one of"},
      {text(R"("format":{"choice":["npy"]})"), "format: is not one of"},
      {text(R"("formt":"npy")"), "formt: unknown key; similar keys: format"},
      {text(R"("bits":1.5)"), "bits: "},
      {R"({"count":0,"scenes":["flat"],"sensors":["x"]})", "count: must be at least 1"},
      {R"({"count":1,"scenes":[],"sensors":["x"]})", "scenes: is not a list of at least one"},
      {R"({"count":1,"scenes":["flt"],"sensors":["ELD_NikonD850"]})", "scenes: flt: there is no such file"},
      {R"({"count":1,"scenes":["chart:x"],"sensors":["ELD_NikonD850"]})", "scenes: unknown chart 'x'"},
      {R"({"count":1,"scenes":["flat"],"sensors":["ELD_NikonD85"]})", "sensors: ELD_NikonD85: unknown sensor"},
      {R"({"count":1,"scenes":["flat"],"sensors":["QHY600"]})", "system_gain_dn_per_e"},
      {R"({"first_index":9223372036854775807,"count":2,"scenes":["flat"],"sensors":["x"]})", "count: "},
  };
  for (const auto& [words, message] : cases) {
    scratch_.write("bad.json", words);
    const auto result = run(file("bad.json"), "bad");
    EXPECT_EQ(result.exit_code, 1) << words;
    EXPECT_EQ(result.out, "") << words;
    EXPECT_TRUE(result.err.starts_with("lowlux: " + file("bad.json") + ": ")) << result.err;
    EXPECT_TRUE(holds(result.err, message)) << message << '\n' << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(scratch_.holds("bad")) << words;
  }
}

TEST_F(Dataset, ADryRunNeedsAFolderForTemporaryFiles) {
  const auto result = test::run_process({"env", "TMPDIR=" + file("none"), test::tested_command(), "dataset",
                                         spec(small), "-o", file("none"), "--dry-run"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(holds(result.err, "TMPDIR")) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

TEST_P(DatasetFormats, AnotherSpecNeedsForceAndADryRunWritesNothing) {
  made(spec(small), "all");
  Json other = of_format(small);
  other["seed"] = 4;
  const auto refused = run(spec(other), "all");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(holds(refused.err, "--force")) << refused.err;
  made(spec(other), "all", {"--force", "--quiet"});
  made(spec(other), "other");
  EXPECT_EQ(contents("all"), contents("other"));
  const auto dry = run(spec(other), "dry", {"--dry-run", "--json"});
  EXPECT_FALSE(scratch_.holds("dry"));
  double bytes = 0;
  for (const auto& [name, text] : contents("other"))
    bytes += name == "dataset.json" ? 0 : static_cast<double>(text.size());
  EXPECT_EQ(Json::parse(dry.out)["predicted_bytes"], bytes);  // of 7 samples all 7 are measured
}

}  // namespace
}  // namespace lowlux
