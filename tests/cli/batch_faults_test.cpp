#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::ProcessResult;
using test::RunningProcess;
namespace fs = std::filesystem;

/// Names and contents of a folder, hidden files too; of folders in it the names.
using Folder = std::map<std::string, std::string>;

Folder contents_of(const std::string& path) {
  Folder found;
  if (!fs::exists(path)) return found;
  for (const auto& entry : fs::directory_iterator(path)) {
    found[entry.path().filename().string()] = entry.is_directory() ? "" : test::read_file(entry.path().string());
  }
  return found;
}

bool has_temporary(const std::string& path) {
  const Folder found = contents_of(path);
  return std::ranges::any_of(found, [](const auto& file) { return file.first.starts_with(".lowlux"); });
}

// What a batch does when something goes wrong on its way: twelve copies of one raw file, developed to out/.
class BatchFaults : public test::SimulateCommand {
 protected:
  static constexpr int files = 12;

  void SetUp() override {
    simulated("chart:macbeth", "one.dng", {"--size", "960x720", "--luminance", "0.05", "--seed", "1", "--no-truth"});
    fs::create_directories(raws_);
    for (int i = 0; i < files; ++i) fs::copy_file(file("one.dng"), raws_ + "/" + name_of(i) + ".dng");
  }

  static std::string name_of(int index) { return std::string("raw_") + static_cast<char>('a' + index); }

  std::vector<std::string> develop(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> args{test::tested_command(), "develop", raws_, "-o", out_ + "/", "--jobs", "2"};
    args.insert(args.end(), more.begin(), more.end());
    return args;
  }

  /// By a shell, with redirections.
  ProcessResult develop_by_shell(const std::string& redirections) const {
    std::string line = "exec";
    for (const std::string& word : develop({"--explain"})) line += " '" + word + "'";
    return test::run_process({"sh", "-c", line + " " + redirections});
  }

  /// What out/ holds when nothing goes wrong.
  Folder undisturbed(const std::vector<std::string>& more = {}) {
    const ProcessResult result = test::run_process(develop(more));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    Folder found = contents_of(out_);
    fs::remove_all(out_);
    return found;
  }

  std::string raws_ = file("raws");
  std::string out_ = file("out");
};

TEST_F(BatchFaults, KilledAtAnyMomentAndStartedAgainItEndsWithAllFilesAndNoOthers) {
  const Folder expected = undisturbed({"--maps"});
  ASSERT_EQ(expected.size(), 3U * files);
  std::mt19937 random(7);
  int left_unfinished = 0;
  for (int round = 0; round < 3; ++round) {
    for (int life = 0; life < 6; ++life) {
      RunningProcess run(develop({"--maps", "--skip-existing"}));
      std::this_thread::sleep_for(std::chrono::milliseconds(20 + random() % 400));
      run.send(SIGKILL);
      run.wait();
      left_unfinished += contents_of(out_).size() < expected.size() ? 1 : 0;
    }
    const ProcessResult last = test::run_process(develop({"--maps", "--skip-existing"}));
    EXPECT_EQ(last.exit_code, 0) << last.err;
    EXPECT_TRUE(contents_of(out_) == expected) << "round " << round;
    fs::remove_all(out_);
  }
  EXPECT_GT(left_unfinished, 0);
}

TEST_F(BatchFaults, SignalsCleanUpAndSayWhatIsDone) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    RunningProcess run(develop());
    for (int tries = 0; tries < 2000 && !has_temporary(out_); ++tries) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    run.send(signal);
    const ProcessResult result = run.wait();
    EXPECT_EQ(result.exit_code, 128 + signal);
    EXPECT_NE(result.err.find("lowlux: interrupted: "), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(" of 12 files done; run again with --skip-existing\n"), std::string::npos) << result.err;
    EXPECT_FALSE(has_temporary(out_)) << signal;
    fs::remove_all(out_);
  }
}

TEST_F(BatchFaults, AnIgnoredSignalStaysIgnored) {
  std::string line = "trap '' HUP; exec";
  for (const std::string& word : develop()) line += " '" + word + "'";
  RunningProcess run({"sh", "-c", line});
  for (int tries = 0; tries < 2000 && !has_temporary(out_); ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  run.send(SIGHUP);
  const ProcessResult result = run.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(contents_of(out_).size(), 1U * files);
}

// The report is lost and said so; every picture is written.
TEST_F(BatchFaults, AStandardOutputThatTakesNothingIsReportedAtTheEnd) {
  const Folder expected = undisturbed();
  for (const std::string to : {"> /dev/full", ">&-", ">&- <&-"}) {
    const ProcessResult result = develop_by_shell(to);
    EXPECT_EQ(result.exit_code, 1) << to;
    EXPECT_TRUE(result.err.ends_with("lowlux: cannot write to standard output\n")) << to << result.err;
    EXPECT_TRUE(contents_of(out_) == expected) << to;
    fs::remove_all(out_);
  }
  const std::string code = file("code");
  std::string line = "(";
  for (const std::string& word : develop({"--explain"})) line += " '" + word + "'";
  const ProcessResult piped = test::run_process({"sh", "-c", line + "; echo $? > " + code + ") | true"});
  EXPECT_EQ(test::read_file(code), "1\n");
  EXPECT_TRUE(contents_of(out_) == expected) << piped.err;
}

// Messages are lost; the exit code is that of the work. Descriptor 2 is not given to a file that is written.
TEST_F(BatchFaults, AStandardErrorThatTakesNothingChangesNothing) {
  const Folder expected = undisturbed();
  for (const std::string to : {"2> /dev/full", "2>&-", "<&- 2>&-"}) {
    const ProcessResult result = develop_by_shell(to);
    EXPECT_EQ(result.exit_code, 0) << to;
    EXPECT_TRUE(contents_of(out_) == expected) << to;
    fs::remove_all(out_);
  }
}

TEST_F(BatchFaults, OneFileThatCannotBeWrittenLeavesTheOthers) {
  Folder expected = undisturbed();
  fs::create_directories(out_ + "/raw_c.png");
  expected["raw_c.png"] = "";
  const ProcessResult result = test::run_process(develop({"--force"}));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("raw_c.png is a directory"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("1 of 12 files failed"), std::string::npos) << result.err;
  EXPECT_TRUE(contents_of(out_) == expected);
}

// A file system of its own: full after some pictures, and then read-only. Root may write anywhere, so permissions would
// not do.
TEST_F(BatchFaults, AFullDiskAndAReadOnlyFolderFailFileByFile) {
  const Folder expected = undisturbed();
  fs::create_directories(out_);
  const std::string enough = std::to_string(3 * expected.begin()->second.size());
  // Some containers let root have a namespace of mounts, but none of users.
  std::vector<std::string> unshare{"unshare", "--user", "--map-root-user", "--mount", "sh", "-c"};
  const auto in_namespace = [&](const std::string& script) {
    std::vector<std::string> words = unshare;
    words.push_back(script);
    return test::run_process(words);
  };
  const std::string mount = "mount -t tmpfs -o size=" + enough + " none '" + out_ + "'";
  if (in_namespace(mount).exit_code != 0) unshare = {"unshare", "--mount", "sh", "-c"};
  if (in_namespace(mount).exit_code != 0) GTEST_SKIP() << "no mount namespaces here";
  std::string develop_all;
  for (const std::string& word : develop({"--skip-existing"})) develop_all += " '" + word + "'";
  fs::create_directories(file("kept"));
  const ProcessResult full =
      in_namespace(mount + " && (" + develop_all + "; echo code $?; cp -a '" + out_ + "/.' '" + file("kept") +
                   "'; mount -o remount,ro '" + out_ + "'; " + develop_all + "; echo code $?)");
  EXPECT_EQ(full.out, "code 1\ncode 1\n");
  EXPECT_NE(full.err.find(": the disk is full"), std::string::npos) << full.err;
  EXPECT_NE(full.err.find(": the file system is read-only"), std::string::npos) << full.err;
  EXPECT_NE(full.err.find(" of 12 files failed"), std::string::npos) << full.err;
  const Folder written = contents_of(file("kept"));
  EXPECT_GE(written.size(), 1U);
  for (const auto& [name, bytes] : written) EXPECT_TRUE(expected.at(name) == bytes) << name;
}

TEST_F(BatchFaults, TwoRunsOnOneFolderShareTheWork) {
  const Folder expected = undisturbed();
  for (const char* const how : {"--skip-existing", "--force", "--quiet"}) {
    RunningProcess first(develop({how})), second(develop({how}));
    const ProcessResult a = first.wait(), b = second.wait();
    if (std::string(how) == "--quiet") {  // each file is one run's; the other reports it
      EXPECT_EQ(std::max(a.exit_code, b.exit_code), 1);
      EXPECT_NE((a.err + b.err).find("exists: use --force to overwrite it"), std::string::npos) << a.err << b.err;
    } else {
      EXPECT_EQ(a.exit_code, 0) << a.err;
      EXPECT_EQ(b.exit_code, 0) << b.err;
    }
    EXPECT_TRUE(contents_of(out_) == expected) << how;
    fs::remove_all(out_);
  }
}

}  // namespace
}  // namespace lowlux
