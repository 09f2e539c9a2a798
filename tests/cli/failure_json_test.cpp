#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::dog;
using test::lowlux;

using Json = nlohmann::json;
using Words = std::vector<std::string>;

/// Failures before any work, whose --json has the form of other failures of the verb.
class FailureJson : public test::SimulateCommand {
 protected:
  /// Runs the command with --json and expects a failure of `where`, as a line and as JSON.
  static Json failed(Words words, const std::string& where, int exit_code = 1) {
    words.insert(words.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(words.size(), 2)), "--json");
    const auto result = lowlux(words);
    EXPECT_EQ(result.exit_code, exit_code) << testing::PrintToString(words);
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    Json json = Json::parse(result.out, nullptr, false);
    EXPECT_FALSE(json.is_discarded()) << testing::PrintToString(words) << result.out;
    if (json.is_discarded()) return json;
    const Json& failure = json.is_array() ? json.at(0) : json;
    EXPECT_EQ(failure["ok"], false) << result.out;
    EXPECT_TRUE(failure.contains("file")) << result.out;
    EXPECT_EQ(failure["where"], where) << result.out;
    EXPECT_FALSE(failure["error"].get<std::string>().empty());
    return json;
  }
};

TEST_F(FailureJson, OfDevelopAndDenoiseIsAnArray) {
  std::filesystem::create_directories(file("empty"));
  for (const char* verb : {"develop", "denoise"}) {
    const std::string out = file(std::string(verb) == "develop" ? "x.png" : "x.dng");
    EXPECT_TRUE(failed({verb, dog, "-o", out, "--profile", file("no.json")}, file("no.json")).is_array());
    EXPECT_TRUE(failed({verb, dog, "-o", out, "--dark-frame", file("no.dng")}, file("no.dng")).is_array());
    EXPECT_TRUE(failed({verb, file("empty"), "-o", out}, file("empty")).is_array());
    EXPECT_TRUE(failed({verb, file("no*.dng"), "-o", out}, file("no*.dng")).is_array());
  }
  EXPECT_TRUE(failed({"develop", "--merge", file("empty"), "-o", file("x.png")}, file("empty")).is_array());
}

TEST_F(FailureJson, OfVerbsWithOneResultIsAnObject) {
  std::filesystem::create_directories(file("empty"));
  EXPECT_TRUE(failed({"merge", file("no.dng"), dog, "-o", file("m.dng")}, file("no.dng")).is_object());
  EXPECT_TRUE(failed({"merge", file("empty"), "-o", file("m.dng")}, file("empty")).is_object());
  EXPECT_TRUE(failed({"merge", dog, "-o", file("m.dng"), "--profile", file("no.json")}, file("no.json")).is_object());
  EXPECT_TRUE(failed({"simulate", file("no.png"), "-o", file("a.dng")}, file("no.png")).is_object());
  EXPECT_TRUE(failed({"dataset", file("no.json"), "-o", file("d")}, file("no.json")).is_object());
  EXPECT_TRUE(failed({"info", file("no.dng"), "--advise"}, file("no.dng")).is_object());
  EXPECT_TRUE(failed({"compare", file("no.png"), file("no.png")}, file("no.png")).is_object());
  EXPECT_TRUE(failed({"retarget", file("no.png"), "-o", file("x.png")}, file("no.png")).is_object());
  EXPECT_TRUE(failed({"calibrate", "black", file("empty"), "-o", file("p.json")}, file("empty")).is_object());
  EXPECT_TRUE(failed({"capture", "--v4l2=" + file("no"), "-o", file("a.png")}, file("no")).is_object());
  EXPECT_EQ(scratch_.names(), Words{"empty"});
}

// Unknown options, missing arguments, values that are not valid, and options that contradict each other.
TEST_F(FailureJson, OfUsageHasTheFormOfTheVerb) {
  std::vector<Words> verbs{{"merge"},
                           {"capture"},
                           {"retarget"},
                           {"resaturate"},
                           {"simulate"},
                           {"dataset"},
                           {"compare"},
                           {"doctor"},
                           {"calibrate", "black"},
                           {"calibrate", "noise"},
                           {"calibrate", "colour"},
                           {"calibrate", "quoted"},
                           {"calibrate", "sheet"}};
  if (test::has_measurement()) verbs.insert(verbs.end(), {{"bench"}, {"reproduce"}});
  for (Words verb : verbs) {
    verb.emplace_back("--nonsense");
    EXPECT_TRUE(failed(verb, "", 2).is_object()) << testing::PrintToString(verb);
    if (verb.front() == "doctor" || verb.front() == "bench" || verb.front() == "reproduce") continue;
    verb.pop_back();
    EXPECT_TRUE(failed(verb, "", 2).is_object()) << testing::PrintToString(verb);
  }
  for (const std::string verb : {"develop", "denoise", "info"}) {
    EXPECT_TRUE(failed({verb}, "", 2).is_array()) << verb;
    EXPECT_TRUE(failed({verb, dog, "--nonsense"}, "", 2).is_array()) << verb;
  }
  const std::string image = test::raws + "../pictures/kodim05.png";
  EXPECT_TRUE(failed({"develop", dog, "-o", file("x.png"), "--demosaic", "none"}, "", 2).is_array());
  EXPECT_TRUE(
      failed({"develop", dog, "-o", file("x.png"), "--budget-ms", "3", "--budget-mpps", "4"}, "", 2).is_array());
  EXPECT_TRUE(failed({"develop", dog, "-o", file("x.foo")}, file("x.foo"), 2).is_array());
  EXPECT_TRUE(failed({"denoise", dog, "-o", file("x.png")}, "-o", 2).is_array());
  EXPECT_TRUE(failed({"denoise", dog, "-o", file("x.dng"), "--denoise="}, "", 2).is_array());
  EXPECT_TRUE(failed({"info", "--advise", "--sensor", "none"}, "", 2).is_object());
  EXPECT_TRUE(failed({"merge", dog, "-o", file("x.dng"), "--reference", "8"}, "--reference", 2).is_object());
  EXPECT_TRUE(failed({"simulate", "flat", "-o", file("x.dng"), "--sensor", "none"}, "", 2).is_object());
  EXPECT_TRUE(failed({"simulate", "flat"}, "", 2).is_object());
  EXPECT_TRUE(failed({"retarget", image, "-o", file("x.foo")}, file("x.foo"), 2).is_object());
  EXPECT_TRUE(failed({"calibrate"}, "", 2).is_object());
  EXPECT_TRUE(failed({"fry", "x"}, "", 2).is_object());
  EXPECT_TRUE(scratch_.names().empty());
}

TEST_F(FailureJson, OfAVideoIsOnStandardError) {
  const auto result = lowlux({"capture", "--live", "--json", "--nonsense"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
  const std::size_t end = result.err.find("}\n");
  ASSERT_NE(end, std::string::npos) << result.err;
  EXPECT_EQ(Json::parse(result.err.substr(0, end + 1))["ok"], false);
}

TEST_F(FailureJson, ListsAreJsonToo) {
  const Json known = Json::parse(lowlux({"simulate", "--list", "--json"}).out);
  EXPECT_GT(known["sensors"].size(), 10U);
  EXPECT_EQ(known["sensors"][0]["name"], "thesis");
  EXPECT_EQ(known["sensors"][1]["gain_settings"][0]["options_needed"][0], "--peak-qe");
  EXPECT_NE(known["lights"].dump().find("\"D65\""), std::string::npos);
  EXPECT_GT(known["cameras"].size(), 10U);
  if (!test::has_measurement()) return;  // the command has no verbs bench and reproduce
  const Json stages = Json::parse(lowlux({"bench", "--list", "--json"}).out);
  EXPECT_FALSE(stages["stages"][0]["id"].get<std::string>().empty());
  EXPECT_FALSE(stages["stages"][0]["title"].get<std::string>().empty());
  const Json experiments = Json::parse(lowlux({"reproduce", "--list", "--json"}).out);
  EXPECT_FALSE(experiments["experiments"][0]["id"].get<std::string>().empty());
  EXPECT_EQ(lowlux({"bench", "--list"}).out.find('{'), std::string::npos);
}

}  // namespace
}  // namespace lowlux
