#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/support/process.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using Json = nlohmann::json;

test::ProcessResult reproduce(std::vector<std::string> args) {
  args.insert(args.begin(), {test::tested_command(), "reproduce"});
  return test::run_process(args);
}

TEST(Reproduce, ListNamesTheExperimentsAndRunsNone) {
  const auto list = reproduce({"--list"});
  EXPECT_EQ(list.exit_code, 0);
  EXPECT_EQ(std::count(list.out.begin(), list.out.end(), '\n'), 11);
  for (const char* id :
       {"few-photons", "chromaticity-clouds", "frequency-of-seeing", "retina", "sensor-scenarios", "dark-desaturation",
        "snr-sensitivity", "mesopic-photometry", "mesopic-tracks", "mesopic-fixed-gamma", "retargeting"}) {
    EXPECT_NE(list.out.find(id), std::string::npos);
  }
}

TEST(Reproduce, PrintsFindingPublishedOursAndVerdict) {
  const auto result = reproduce({"snr-sensitivity", "--quick"});
  EXPECT_EQ(result.exit_code, 0) << result.err;  // also though a finding does not hold
  for (const char* word : {"finding", "published", "ours", "verdict", "snr-sensitivity/dark", "1 to 9 %", "0.9 to 9 %",
                           "does not hold", "volts squared", "published findings: ", "within a tenth"}) {
    EXPECT_NE(result.out.find(word), std::string::npos) << word;
  }
  EXPECT_EQ(result.err, "");
}

TEST(Reproduce, JsonHasTheFindingsOfTheChosenExperimentsInTheirOrder) {
  const auto result = reproduce({"frequency-of-seeing", "few-photons", "--quick", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json findings = Json::parse(result.out);
  ASSERT_GT(findings.size(), 5u);
  EXPECT_TRUE(findings.front()["id"].get<std::string>().starts_with("frequency-of-seeing/"));
  EXPECT_TRUE(findings.back()["id"].get<std::string>().starts_with("few-photons/"));
  EXPECT_TRUE(findings.front()["holds"].is_boolean());
  for (const Json& finding : findings) {
    const std::string id = finding["id"];
    if (id == "frequency-of-seeing/shape") {
      EXPECT_EQ(finding["kind"], "published");
    }
    if (id == "frequency-of-seeing/tail") {
      EXPECT_EQ(finding["kind"], "check");
    }
  }
}

TEST(Reproduce, CountsPublishedFindingsAndChecksApart) {
  const auto result = reproduce({"frequency-of-seeing", "--quick"});
  EXPECT_NE(result.out.find("\npublished findings: 1 agree, 0 have the same direction, 0 do not hold\n"
                            "additional checks: 1 agree, 0 have the same direction, 1 do not hold\n"),
            std::string::npos)
      << result.out;
  EXPECT_FALSE(result.out.ends_with("\n\n"));
  EXPECT_EQ(result.out.find("not reproduced:"),
            std::string::npos);  // of the entire thesis: not with chosen experiments
}

TEST(Reproduce, AnOrderWhoseFiguresAreOthersHasTheSameDirectionOnly) {
  const auto result = reproduce({"mesopic-tracks", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json findings = Json::parse(result.out);
  const auto verdict = [&](const std::string& what) {
    const auto found = std::find_if(findings.begin(), findings.end(),
                                    [&](const Json& f) { return f["id"] == "mesopic-tracks/" + what; });
    return found == findings.end() ? "" : (*found)["verdict"].get<std::string>();
  };
  EXPECT_EQ(verdict("cao-from-shin"), "same direction");  // published 10.4 times as far, here 1.2 to 1.3
  EXPECT_EQ(verdict("shin-spectral"), "same direction");  // published 9.14, here 12.88, within the readings' range
  EXPECT_EQ(verdict("blue"), "agrees");
  EXPECT_EQ(verdict("shin-cao"), "does not hold");
}

TEST(Reproduce, SeedsGiveSamplesThatDifferAndRepeat) {
  const auto run = [](const char* seed) { return reproduce({"few-photons", "--quick", "--json", "--seed", seed}).out; };
  const std::string seven = run("7");
  EXPECT_EQ(seven, run("7"));
  EXPECT_NE(seven, run("8"));
}

TEST(Reproduce, WritesTableDataAndReportAndOverwritesNothing) {
  const test::ScratchDirectory scratch;
  const std::string folder = scratch.file("a/b");
  const std::vector<std::string> args{"dark-desaturation", "--quick", "-o", folder};
  ASSERT_EQ(reproduce(args).exit_code, 0);
  for (const char* name :
       {"/findings.csv", "/dark-desaturation-paths.csv", "/dark-desaturation-gamut.csv", "/report.html"}) {
    EXPECT_FALSE(scratch.read(std::string("a/b") + name).empty()) << name;
  }
  const std::string before = scratch.read("a/b/findings.csv");
  EXPECT_TRUE(before.starts_with("finding,kind,claim,published,ours,verdict,note\n"));

  const auto again = reproduce({"dark-desaturation", "--quick", "-o", folder, "--seed", "2"});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_NE(again.err.find("--force"), std::string::npos) << again.err;
  EXPECT_EQ(std::count(again.err.begin(), again.err.end(), '\n'), 1);
  EXPECT_EQ(scratch.read("a/b/findings.csv"), before);

  EXPECT_EQ(reproduce({"dark-desaturation", "--quick", "-o", folder, "--seed", "2", "--force"}).exit_code, 0);
  EXPECT_NE(scratch.read("a/b/findings.csv"), before);
}

TEST(Reproduce, APlotsFileInTheWayStopsAllWriting) {
  const test::ScratchDirectory scratch;
  scratch.write("snr-sensitivity.csv", "mine");
  const auto result = reproduce({"snr-sensitivity", "--quick", "-o", scratch.path()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(scratch.names().size(), 1u);
  EXPECT_EQ(scratch.read("snr-sensitivity.csv"), "mine");
}

TEST(Reproduce, AFolderThatCannotBeMadeIsAFailureInOneLine) {
  const test::ScratchDirectory scratch;
  scratch.write("file", "x");
  const auto result = reproduce({"snr-sensitivity", "--quick", "-o", scratch.file("file/sub")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

TEST(Reproduce, PicturesThatAreNotThereAreAFailureInOneLineAndTheOthersRun) {
  const test::ScratchDirectory scratch;
  const std::string none = scratch.file("none");
  const auto result = reproduce({"retargeting", "mesopic-fixed-gamma", "--quick", "--pictures-folder", none});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find(none), std::string::npos) << result.err;
  EXPECT_NE(result.out.find("mesopic-fixed-gamma/less-icam06"), std::string::npos) << result.out;
}

TEST(Reproduce, WrongCommandLinesExitWithTwoAndOfferNearNames) {
  const auto near = reproduce({"few-photon"});
  EXPECT_EQ(near.exit_code, 2);
  EXPECT_NE(near.err.find("did you mean few-photons?"), std::string::npos) << near.err;
  const std::vector<std::vector<std::string>> wrong{{"zzz"}, {"--seed", "x"}, {"--seed", "-1"}, {"--fast"}, {"-o"}};
  for (const auto& args : wrong) {
    const auto result = reproduce(args);
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(args);
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(result.out, "");
  }
}

}  // namespace
}  // namespace lowlux
