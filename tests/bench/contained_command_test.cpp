#include "isp/bench/methods/contained_command.h"

#include <gtest/gtest.h>
#include <sys/prctl.h>

#include <chrono>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/process.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::isp {
namespace {

constexpr CommandLimits limits{.max_wall_s = 60, .max_file_bytes = 4 << 20, .max_memory_bytes = 256 << 20};

std::string failure(const std::string& command, const CommandLimits& within = limits) {
  const test::ScratchDirectory scratch;
  const auto use = run_contained(command, scratch.path(), within);
  EXPECT_FALSE(use) << command;
  if (use) return {};
  EXPECT_EQ(use.error().message.find('\n'), std::string::npos) << use.error().message;
  return use.error().message;
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(ContainedCommand, WhatFailsIsReportedWithItsCauseAndItsLastLine) {
  EXPECT_EQ(failure("echo first; echo why >&2; exit 3"), "it ended with exit code 3: why");
  EXPECT_TRUE(has(failure("kill -SEGV $$"), "signal 11"));
  EXPECT_TRUE(has(failure("/bin/sh -c 'kill -ABRT $$'; exit $?"), "signal 6"));
  EXPECT_TRUE(has(failure("no_such_program_at_all"), "not found"));
  EXPECT_TRUE(has(failure("printf 'a\\033[31m\\001b\\n'; exit 1"), ": a [31m b"));
  EXPECT_TRUE(has(failure("head -c 100000 /dev/zero | tr '\\0' x; exit 1"), "xxx..."));
}

TEST(ContainedCommand, APipeInThePlaceOfItsOutputIsNotWaitedFor) {
  EXPECT_EQ(failure("cd \"$TMPDIR\"; rm -f *; mkfifo printed.txt; exit 3"), "it ended with exit code 3");
}

TEST(ContainedCommand, TimeFilesAndMemoryAreLimited) {
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(has(failure("trap '' TERM INT HUP; sleep 600", {.max_wall_s = 0.2}), "time limit of 0.2 s"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(60));
  EXPECT_TRUE(has(failure("exec yes"), "written 4 MB to one file"));
  EXPECT_TRUE(has(failure("exec yes > \"$TMPDIR/huge\""), "written 4 MB to one file"));
#if !defined(LOWLUX_SANITIZED)
  EXPECT_TRUE(has(failure("dd if=/dev/zero of=/dev/null bs=600M count=1"), "exit code 1"));
#endif
}

TEST(ContainedCommand, RunsOfSeveralThreadsLeaveTheProcessAsItWas) {
  const auto adopts_orphans = [] {
    int adopts = 0;
    prctl(PR_GET_CHILD_SUBREAPER, &adopts, 0, 0, 0);
    return adopts;
  };
  ASSERT_EQ(adopts_orphans(), 0);
  const auto run = [](double wait_s, double run_s) {
    return std::jthread([wait_s, run_s] {
      std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
      const test::ScratchDirectory scratch;
      EXPECT_TRUE(run_contained("sleep " + std::to_string(run_s), scratch.path(), limits));
    });
  };
  {
    const std::jthread first = run(0, 0.4), second = run(0.2, 0.4);  // the second ends last, and began meanwhile
  }
  EXPECT_EQ(adopts_orphans(), 0);
}

TEST(ContainedCommand, NothingOfItIsLeftWhenItEnds) {
  const test::ScratchDirectory scratch;
  for (const char* command :
       {"sleep 600 & echo $! > \"$TMPDIR/pid\"", "(sleep 600 & echo $! > \"$TMPDIR/pid\"); exit 1",
        "setsid sh -c 'echo $$ > \"$TMPDIR/new\"; mv \"$TMPDIR/new\" \"$TMPDIR/pid\"; exec sleep 600' & "
        "until [ -e \"$TMPDIR/pid\" ]; do sleep 0.01; done"}) {
    std::filesystem::remove(scratch.file("pid"));
    (void)run_contained(command, scratch.path(), limits);
    const std::string pid = scratch.read("pid");
    ASSERT_FALSE(pid.empty());
    EXPECT_FALSE(std::filesystem::exists("/proc/" + pid.substr(0, pid.find('\n')))) << command;
  }
}

TEST(ContainedCommand, ItHasNoInputAndItsOwnFolderForTemporaryFiles) {
  const test::ScratchDirectory scratch;
  ASSERT_TRUE(run_contained("cat; printf %s \"$TMPDIR\" > \"$TMPDIR/here\"", scratch.path(), limits));
  EXPECT_EQ(scratch.read("here"), scratch.path());
}

TEST(ContainedCommand, MemoryAndTimeAreThoseOfTheCommandAlone) {
  const test::ScratchDirectory scratch;
  std::vector<char> ours(300 << 20);  // resident in this process
  std::memset(ours.data(), 1, ours.size());
  const auto small = run_contained("sleep 0.2", scratch.path(), limits);
  ASSERT_TRUE(small) << small.error().message;
  EXPECT_LT(small->peak_bytes, 32 << 20);
  EXPECT_GE(small->wall_s, 0.2);
  EXPECT_LT(small->cpu_s, 0.2);
  const auto large = run_contained("dd if=/dev/zero of=/dev/null bs=64M count=1 2>&1", scratch.path(), limits);
  ASSERT_TRUE(large) << large.error().message;
  EXPECT_GE(large->peak_bytes, 64 << 20);
  EXPECT_LT(large->peak_bytes, 96 << 20);
}

TEST(ContainedCommand, WordsAreQuotedForTheShell) {
  const test::ScratchDirectory scratch;
  for (const std::string word : {"plain/path-1.dng", "", "with space", "it's", R"($HOME `id` "x" \ ; & | > *)"}) {
    ASSERT_TRUE(run_contained("printf %s " + shell_word(word) + " > \"$TMPDIR/word\"", scratch.path(), limits));
    EXPECT_EQ(scratch.read("word"), word);
  }
  EXPECT_EQ(shell_word("plain/path-1.dng"), "plain/path-1.dng");
}

}  // namespace
}  // namespace lowlux::isp
