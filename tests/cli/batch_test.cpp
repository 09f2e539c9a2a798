#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::lowlux;

using Json = nlohmann::json;
namespace fs = std::filesystem;

/// One raw file and names for copies of it.
class Batch : public test::SimulateCommand {
 protected:
  void raw(const std::string& name, const std::vector<std::string>& more = {}) {
    std::vector<std::string> args{"--no-truth", "--luminance", "0.1", "--exposure", "0.1"};
    args.insert(args.end(), more.begin(), more.end());
    simulated("chart:macbeth", name, args);
  }
  void copies(const std::string& name, const std::vector<std::string>& to) {
    for (const std::string& copy : to) {
      fs::create_directories(fs::path(file(copy)).parent_path());
      fs::copy_file(file(name), file(copy));
    }
  }
  std::vector<std::string> names_in(const std::string& folder) {
    std::vector<std::string> found;
    for (const auto& entry : fs::directory_iterator(file(folder))) found.push_back(entry.path().filename().string());
    std::ranges::sort(found);
    return found;
  }
  static void refused(const test::ProcessResult& result, const std::string& why, int exit_code = 2) {
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_NE(result.err.find(why), std::string::npos) << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
  }
};

TEST_F(Batch, ExistingOutputsAreSkippedAndCounted) {
  raw("a.dng");
  copies("a.dng", {"b.dng", "c.dng"});
  const std::vector<std::string> all{"develop", file("a.dng"), file("b.dng"), file("c.dng"), "-o", file("out/")};
  ASSERT_EQ(lowlux({"develop", file("b.dng"), "-o", file("out/")}).exit_code, 0);
  const std::string before = test::read_file(file("out/b.png"));
  auto args = all;
  args.insert(args.end(), {"--skip-existing", "--json"});
  const auto result = lowlux(args);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(result.err.starts_with("lowlux: 2 of 3 files written to " + file("out/") + ", ")) << result.err;
  EXPECT_TRUE(result.err.ends_with(" s\nlowlux: 1 of 3 files skipped: their outputs exist\n")) << result.err;
  const Json report = Json::parse(result.out);
  ASSERT_EQ(report.size(), 3U);
  EXPECT_FALSE(report[0].contains("skipped"));
  EXPECT_EQ(report[1], Json({{"file", file("b.dng")}, {"ok", true}, {"output", file("out/b.png")}, {"skipped", true}}));
  EXPECT_EQ(names_in("out"), (std::vector<std::string>{"a.png", "b.png", "c.png"}));
  EXPECT_EQ(test::read_file(file("out/b.png")), before);
  args.emplace_back("--force");
  refused(lowlux(args), "--force");
  const auto cleaned = [&] {
    return lowlux({"denoise", file("a.dng"), "-o", file("clean.dng"), "--skip-existing", "--sync"});
  };
  EXPECT_EQ(cleaned().err, "");
  EXPECT_EQ(cleaned().err, "lowlux: 1 of 1 files skipped: their outputs exist\n");
}

TEST_F(Batch, AFolderOfRawFilesEndsWithALineOfSummary) {
  fs::create_directories(file("in"));
  raw("a.dng");
  copies("a.dng", {"in/b.dng", "in/a.DNG"});
  scratch_.write("in/notes.txt", "not a raw file");
  for (const char* verb : {"develop", "denoise"}) {
    const std::string out = file(std::string(verb) + "/");
    const auto result = lowlux({verb, file("in"), "-o", out});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(result.err.starts_with("lowlux: 2 of 2 files written to " + out + ", ")) << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_EQ(names_in(verb).size(), 2U);
    EXPECT_EQ(lowlux({verb, file("in"), "-o", out, "--force", "--quiet"}).err, "");
  }
}

// A run that was killed between a picture and its maps has not done that file.
// A killed run leaves maps without a picture, as the picture is written last; or an empty picture, a claimed name.
TEST_F(Batch, MapsWithoutAPictureAreMadeAgainWithIt) {
  raw("a.dng");
  const std::vector<std::string> args{"develop", file("a.dng"), "-o", file("out/"), "--maps", "--skip-existing"};
  ASSERT_EQ(lowlux(args).exit_code, 0);
  const std::string map = test::read_file(file("out/a.noise.pfm")), picture = test::read_file(file("out/a.png"));
  const auto made_again = [&] {
    std::ofstream(file("out/a.noise.pfm")) << "half a map";
    EXPECT_EQ(lowlux(args).exit_code, 0);
    EXPECT_TRUE(test::read_file(file("out/a.noise.pfm")) == map);
    EXPECT_TRUE(test::read_file(file("out/a.png")) == picture);
  };
  fs::remove(file("out/a.png"));
  made_again();
  std::ofstream(file("out/a.png")).close();
  made_again();
}

TEST_F(Batch, APictureWithoutItsMapsIsNotReplaced) {
  raw("a.dng");
  fs::create_directories(file("out"));
  std::ofstream(file("out/a.png")) << "edited since";
  EXPECT_EQ(lowlux({"develop", file("a.dng"), "-o", file("out/"), "--maps", "--skip-existing"}).exit_code, 0);
  EXPECT_EQ(test::read_file(file("out/a.png")), "edited since");
}

TEST_F(Batch, AFolderStandsForTheRawFilesInIt) {
  raw("a.dng");
  copies("a.dng", {"raws/b.DNG", "raws/a.dng", "raws/deeper/d.dng", "raws/._a.dng", "raws/notes.txt"});
  const auto result = lowlux({"develop", file("raws"), "-o", file("out/"), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json report = Json::parse(result.out);
  ASSERT_EQ(report.size(), 2U);
  EXPECT_EQ(report[0]["file"], file("raws/a.dng"));
  EXPECT_EQ(names_in("out"), (std::vector<std::string>{"a.png", "b.png"}));
  EXPECT_EQ(lowlux({"denoise", file("raws/[ab].dng"), "-o", file("clean/")}).exit_code, 0);
  EXPECT_EQ(names_in("clean"), std::vector<std::string>{"a.dng"});
  fs::create_directories(file("empty"));
  refused(lowlux({"develop", file("empty"), "-o", file("out/")}), "no raw files", 1);
  refused(lowlux({"develop", file("raws"), "-o", file("x.png"), "--quiet"}), "2 raw files need a folder");
  refused(lowlux({"develop", file("raws"), "-o", "-", "--quiet"}), "2 raw files need a folder as output: 'FOLDER/'");
  refused(lowlux({"develop", file("none*.dng"), "-o", file("out/")}), "no file matches", 1);
}

TEST_F(Batch, EveryEntryOfAFolderWithTheExtensionOfARawFileIsAnInput) {
  raw("a.dng");
  copies("a.dng", {"raws/a.dng", "raws/b.mef", "raws/c.txt", "raws/g.QTK", "raws/h.ia", "raws/i.rdc"});
  scratch_.write("raws/c.x3f", "no raw file");
  scratch_.write("raws/d.GPR", "no raw file");
  fs::create_symlink("nowhere.nef", file("raws/e.nef"));
  fs::create_directories(file("raws/f.cr2"));
  const auto result = lowlux({"develop", file("raws"), "-o", file("out/"), "--json"});
  EXPECT_EQ(result.exit_code, 1);
  for (const char* name : {"c.x3f", "d.GPR", "e.nef: no such file", "f.cr2: is a directory"}) {
    EXPECT_NE(result.err.find(file("raws/") + name), std::string::npos) << name << result.err;
  }
  const Json report = Json::parse(result.out);
  ASSERT_EQ(report.size(), 9U) << result.out;
  EXPECT_EQ(report[1]["file"], file("raws/b.mef"));
  EXPECT_EQ(names_in("out"), (std::vector<std::string>{"a.png", "b.png", "g.png", "h.png", "i.png"}));
}

TEST_F(Batch, RawFilesInSubFoldersAreReportedInOneLine) {
  raw("a.dng");
  copies("a.dng", {"raws/a.dng", "raws/first/a.dng", "raws/second/a.dng", "above/second/a.dng"});
  fs::create_directories(file("raws/empty"));
  const auto developed = [&](const std::string& folder, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{"develop", file(folder), "-o", file("out/"), "--force", "--noise", "1,3"};
    words.insert(words.end(), more.begin(), more.end());
    return lowlux(words);
  };
  const auto result = developed("raws");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const std::string line = "lowlux: " + file("raws") + ": warning: raw files in sub-folders, such as " +
                           file("raws/first") + ", are left out";
  EXPECT_EQ(result.err.find(line), 0U) << result.err;
  EXPECT_EQ(result.err.find("second"), std::string::npos) << result.err;
  EXPECT_EQ(names_in("out"), std::vector<std::string>{"a.png"});
  EXPECT_EQ(developed("raws", {"--quiet"}).err, "");
  EXPECT_EQ(developed("raws/first").err.find("sub-folder"), std::string::npos);
  refused(developed("above"), "contains no raw files, but its sub-folder " + file("above/second") + " does", 1);
}

TEST_F(Batch, InfoTakesFolders) {
  raw("a.dng");
  copies("a.dng", {"raws/b.dng", "raws/a.dng"});
  const auto result = lowlux({"info", file("raws"), file("a.dng"), file("none*.dng"), "--json"});
  EXPECT_EQ(result.exit_code, 1);
  const Json report = Json::parse(result.out);
  ASSERT_EQ(report.size(), 4U);
  EXPECT_EQ(report[0]["file"], file("raws/a.dng"));
  EXPECT_EQ(report[1]["file"], file("raws/b.dng"));
  EXPECT_EQ(report[2]["ok"], true);
  EXPECT_EQ(report[3]["ok"], false);
}

TEST_F(Batch, ShardsMakeEachFileOnceAsOneRunDoes) {
  raw("a.dng", {"--size", "48x32"});
  std::mt19937 random(20261126);
  for (int draw = 0; draw < 4; ++draw) {
    const unsigned files = 1 + random() % 7, shards = 1 + random() % 5;
    const std::string in = fmt::format("in{}", draw), whole = fmt::format("whole{}", draw),
                      parts = fmt::format("parts{}", draw);
    std::vector<std::string> names;
    for (unsigned i = 0; i < files; ++i) names.push_back(fmt::format("{}/{}.dng", in, i));
    copies("a.dng", names);
    const std::string verb = draw % 2 == 0 ? "develop" : "denoise";
    ASSERT_EQ(lowlux({verb, file(in), "-o", file(whole + "/")}).exit_code, 0);
    std::size_t made = 0;
    for (unsigned i = 1; i <= shards; ++i) {
      const auto result =
          lowlux({verb, file(in), "-o", file(parts + "/"), "--json", "--shard", fmt::format("{}/{}", i, shards)});
      EXPECT_EQ(result.exit_code, 0) << result.err;
      const Json report = Json::parse(result.out);
      EXPECT_EQ(report.size(), i > files ? 0 : (files - i) / shards + 1) << i << "/" << shards << " of " << files;
      EXPECT_EQ(result.err.find("contains no raw file") != std::string::npos, report.empty()) << result.err;
      made += report.size();
    }
    EXPECT_EQ(made, files);
    EXPECT_EQ(names_in(parts), names_in(whole));
    for (const std::string& name : names_in(whole)) {
      const std::string part = fmt::format("{}/{}", parts, name), one = fmt::format("{}/{}", whole, name);
      EXPECT_TRUE(test::read_file(file(part)) == test::read_file(file(one))) << name;
    }
  }
  for (const char* wrong :
       {"0/2", "3/2", "1", "/", "1/", "-1/2", "1/2/3", "a/b", "1.5/2", "", "1/18446744073709551615"}) {
    refused(lowlux({"develop", file("a.dng"), "-o", file("x/"), "--shard", wrong}), "1/4 is the first of four shards");
  }
  refused(lowlux({"develop", file("a.dng"), "-o", file("x.png"), "--merge", "--shard", "1/2"}), "--shard");
  EXPECT_FALSE(fs::exists(file("x")));
}

TEST_F(Batch, TwoInputsForOneOutputAreRefusedWithARemedy) {
  raw("a.dng");
  copies("a.dng", {"other/a.dng"});
  refused(lowlux({"develop", file("a.dng"), file("other/a.dng"), "-o", file("out/")}),
          "separate runs with separate folders");
  refused(lowlux({"develop", file("a.dng"), file("a.dng"), "-o", file("out/")}), "given twice");
  EXPECT_FALSE(fs::exists(file("out")));
}

TEST_F(Batch, InputsOfOneNameHaveOutputsNamedWithTheirExtensions) {
  raw("a.dng");
  copies("a.dng", {"in/a.dng", "in/a.nef", "in/b.dng", "other/a.dng"});
  const std::vector<std::string> names{"a_dng.jpg", "a_nef.jpg", "b.jpg"};
  const std::vector<std::string> words{"develop", file("in"), "-o", file("out/"), "--format", "jpg"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), words.begin(), words.end());
    return lowlux(more);
  };
  const auto result = with({});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(
      result.err.starts_with("lowlux: raw files of one name have outputs named with their extensions, such as " +
                             file("out/a_dng.jpg") + "\n"))
      << result.err;
  EXPECT_EQ(names_in("out"), names);
  fs::remove(file("out/a_nef.jpg"));
  const auto rest = with({"--skip-existing", "--quiet", "--json"});
  EXPECT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_EQ(rest.err, "");
  const Json report = Json::parse(rest.out);
  EXPECT_TRUE(report[0].contains("skipped") && !report[1].contains("skipped") && report[2].contains("skipped"))
      << report;
  EXPECT_EQ(names_in("out"), names);
  refused(with({file("other/a.dng")}), "out/a_dng.jpg would be written twice");
  EXPECT_EQ(lowlux({"denoise", file("in"), "-o", file("clean/"), "--quiet"}).err, "");
  EXPECT_EQ(names_in("clean"), (std::vector<std::string>{"a_dng.dng", "a_nef.dng", "b.dng"}));
}

TEST_F(Batch, OptionsTakeOneArgumentAndLeaveTheRest) {
  raw("a.dng");
  simulated("dark", "d.dng", {"--exposure", "0.1", "--no-truth", "--seed", "5"});
  copies("d.dng", {"darks/d.dng"});
  for (const std::vector<std::string>& darks : std::vector<std::vector<std::string>>{
           {"--dark-frame", file("d.dng")}, {"--dark-frame=" + file("d.dng")}, {"--dark-frame", file("darks")}}) {
    std::vector<std::string> args{"develop"};
    args.insert(args.end(), darks.begin(), darks.end());
    args.insert(args.end(), {file("a.dng"), "-o", file("x.png"), "--force", "--json"});
    const auto result = lowlux(args);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(Json::parse(result.out)[0]["dark_frame"]["frames"], 1);
  }
}

// A shell makes words of bias/*.dng; the first is the option's, and the others would be taken for flats.
TEST_F(Batch, DarksOfACalibrationAreNotTakenForFlats) {
  for (const char* folder : {"bias", "flats"}) fs::create_directories(file(folder));
  simulated("dark", "bias/b.dng", {"--frames", "2", "--exposure", "0.001", "--no-truth", "--size", "96x96"});
  for (int i = 0; i < 4; ++i) {
    for (const char* pair : {"a", "b"}) {
      simulated("flat", "flats/f" + std::to_string(i) + pair + ".dng",
                {"--luminance", std::to_string(0.1 * (1 << i)), "--exposure", "0.1", "--no-truth", "--size", "96x96",
                 "--seed", std::to_string(2 * i + (*pair == 'b'))});
    }
  }
  const std::string first = file("bias/b_0000.dng"), second = file("bias/b_0001.dng");
  const auto calibrated = [&](const std::vector<std::string>& darks) {
    std::vector<std::string> args{"calibrate", "noise"};
    args.insert(args.end(), darks.begin(), darks.end());
    for (const std::string& flat : names_in("flats")) args.push_back(file("flats/" + flat));
    args.insert(args.end(), {"-o", file("c.json"), "--force", "--json"});
    return lowlux(args);
  };
  refused(calibrated({"--darks", first, second}), "--darks " + file("bias/"));
  for (const std::vector<std::string>& darks :
       std::vector<std::vector<std::string>>{{"--darks", file("bias")},
                                             {"--darks", fmt::format("{},{}", first, second)},
                                             {"--darks", first, "--darks", second},
                                             {"--darks", file("bias/*.dng")}}) {
    const auto result = calibrated(darks);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(Json::parse(result.out)["warnings"].size(), 0U) << result.out;
  }
}

// Peaks of 2 and 14 files of 1.5 MP, each with a dark frame of 6 MB of its own: what is kept of a file when it is done
// is a few kilobytes. The margin is three planes of floats, for the heap's order of events.
TEST_F(Batch, MemoryDoesNotGrowWithTheNumberOfFiles) {
  raw("a.dng", {"--size", "1500x1000"});
  simulated("dark", "d.dng", {"--size", "1500x1000", "--exposure", "0.1", "--no-truth", "--seed", "3"});
  std::vector<std::string> few{"develop", "--dark-frame", file("d.dng"), "-o",    file("out/"), "--jobs",
                               "1",       "--force",      "--quiet",     "--json"};
  std::vector<std::string> many = few;
  for (int i = 0; i < 14; ++i) {
    const std::string name = "copy" + std::to_string(i) + ".dng";
    copies("a.dng", {name});
    if (i < 2) few.push_back(file(name));
    many.push_back(file(name));
  }
  const auto small = lowlux(few), large = lowlux(many);
  ASSERT_EQ(small.exit_code, 0) << small.err << small.out;
  ASSERT_EQ(large.exit_code, 0) << large.err;
  EXPECT_LT(large.peak_bytes - small.peak_bytes, 3 * sizeof(float) * 1500 * 1000)
      << 1e-6 * small.peak_bytes << " and " << 1e-6 * large.peak_bytes << " MB";
}

TEST_F(Batch, NamesCannotSteerATerminal) {
  raw("a.dng");
  const std::string name =
      "b\033]0;x\a\xc2\x9b"
      "1m.dng";
  copies("a.dng", {name});
  const auto result = lowlux({"develop", file(name), "-o", file("x.png"), "--explain", "--timings"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const auto info = lowlux({"info", file(name)});
  const auto missing = lowlux({"develop", file(name) + "x", "-o", file("y.png")});
  for (const std::string& text : {result.out, result.err, info.out, missing.err}) {
    EXPECT_EQ(text.find_first_of("\033\a"), std::string::npos) << text;
    EXPECT_EQ(text.find("\xc2\x9b"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace lowlux
