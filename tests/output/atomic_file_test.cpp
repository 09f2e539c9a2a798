#include "isp/output/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <thread>
#include <tuple>
#include <vector>

#include "tests/support/scratch_directory.h"
#include "tests/support/this_process.h"

namespace lowlux::isp {
namespace {

using test::ScratchDirectory;

Result<void> write_words(const std::string& path, const std::string& words, Overwrite overwrite) {
  return AtomicFile::create(path, overwrite).and_then([&](AtomicFile out) {
    std::fputs(words.c_str(), out.file());
    return out.commit();
  });
}

TEST(AtomicFile, AppearsOnlyOnCommitAndLeavesNothingElse) {
  const ScratchDirectory scratch;
  {
    auto out = AtomicFile::create(scratch.file("a.txt"), Overwrite::no);
    ASSERT_TRUE(out) << out.error().message;
    std::fputs("words", out->file());
    EXPECT_FALSE(scratch.holds("a.txt"));
    EXPECT_EQ(scratch.names().size(), 1U);  // the temporary
    ASSERT_TRUE(out->commit());
  }
  EXPECT_EQ(scratch.names(), std::vector<std::string>{"a.txt"});
  EXPECT_EQ(scratch.read("a.txt"), "words");
}

TEST(AtomicFile, WithoutCommitNothingIsLeft) {
  const ScratchDirectory scratch;
  {
    auto out = AtomicFile::create(scratch.file("a.txt"), Overwrite::no);
    ASSERT_TRUE(out);
    std::fputs("words", out->file());
  }
  EXPECT_TRUE(scratch.names().empty());
}

TEST(AtomicFile, AnExistingFileIsKeptUnlessOverwritingIsAskedFor) {
  const ScratchDirectory scratch;
  scratch.write("a.txt", "old");
  const auto refused = write_words(scratch.file("a.txt"), "new", Overwrite::no);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::exists);
  EXPECT_EQ(refused.error().message, scratch.file("a.txt") + " exists: use --force to overwrite it");
  EXPECT_EQ(scratch.read("a.txt"), "old");
  ASSERT_TRUE(write_words(scratch.file("a.txt"), "new", Overwrite::yes));
  EXPECT_EQ(scratch.read("a.txt"), "new");
  EXPECT_EQ(scratch.names().size(), 1U);
}

TEST(AtomicFile, AFileThatAppearsMeanwhileIsKept) {
  const ScratchDirectory scratch;
  auto out = AtomicFile::create(scratch.file("a.txt"), Overwrite::no);
  ASSERT_TRUE(out);
  scratch.write("a.txt", "someone else's");
  const auto committed = out->commit();
  ASSERT_FALSE(committed);
  EXPECT_EQ(committed.error().code, ErrorCode::exists);
  EXPECT_EQ(scratch.read("a.txt"), "someone else's");
}

// A process that is killed lets go of its lock, and the next one that writes there removes what it left. Files of
// processes that live, of other hosts and of other programs stay.
/// Returns files with words in them, not committed.
std::vector<AtomicFile> prepared(const ScratchDirectory& scratch, Overwrite overwrite) {
  std::vector<AtomicFile> out;
  for (const char* name : {"a.txt", "b.txt", "c.txt"}) {
    out.push_back(AtomicFile::create(scratch.file(name), overwrite).value());
    std::fputs(name, out.back().file());
  }
  return out;
}

TEST(AtomicFile, SeveralAppearTogetherOrNotAtAll) {
  for (const Overwrite overwrite : {Overwrite::no, Overwrite::yes}) {
    const ScratchDirectory scratch;
    auto files = prepared(scratch, overwrite);
    ASSERT_TRUE(AtomicFile::commit_all(files));
    EXPECT_EQ(scratch.names(), (std::vector<std::string>{"a.txt", "b.txt", "c.txt"}));
    EXPECT_EQ(scratch.read("c.txt"), "c.txt");
  }
  const ScratchDirectory scratch;
  {
    auto files = prepared(scratch, Overwrite::no);
    scratch.write("c.txt", "another's");
    const auto refused = AtomicFile::commit_all(files);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::exists);
    EXPECT_EQ(refused.error().where, scratch.file("c.txt"));
  }
  EXPECT_EQ(scratch.names(), std::vector<std::string>{"c.txt"});
  EXPECT_EQ(scratch.read("c.txt"), "another's");
}

TEST(AtomicFile, RemnantsOfKilledProcessesAreRemoved) {
  const ScratchDirectory scratch;
  std::array<int, 2> ready{};
  ASSERT_EQ(pipe(ready.data()), 0);
  const pid_t child = fork();
  if (child == 0) {
    const auto first = AtomicFile::create(scratch.file("a.txt"), Overwrite::no);
    const auto second = AtomicFile::create(scratch.file("b.txt"), Overwrite::yes);
    if (first && second) std::ignore = write(ready[1], "", 1);
    for (;;) pause();
  }
  char byte = 1;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  ASSERT_EQ(scratch.names().size(), 2U);
  scratch.write(".lowlux-another.host-1-0.part", "");
  scratch.write("lowlux.part", "");
  const auto sweep = [&] {  // as a process that has written nothing here yet
    const pid_t other = fork();
    if (other == 0) _exit(write_words(scratch.file("c.txt"), "words", Overwrite::yes) ? 0 : 1);
    int status = -1;
    waitpid(other, &status, 0);
    return status;
  };
  EXPECT_EQ(sweep(), 0);
  EXPECT_EQ(scratch.names().size(), 5U);  // nothing of the living
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_EQ(sweep(), 0);
  EXPECT_EQ(scratch.names(), (std::vector<std::string>{".lowlux-another.host-1-0.part", "c.txt", "lowlux.part"}));
  for (const int end : ready) close(end);
}

TEST(AtomicFile, AbandonedFilesAreGone) {
  const ScratchDirectory scratch;
  const pid_t child = fork();
  if (child == 0) {
    const auto out = AtomicFile::create(scratch.file("a.txt"), Overwrite::no);
    if (!out || scratch.names().size() != 1) _exit(1);
    AtomicFile::abandon_all();
    _exit(0);
  }
  int status = -1;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(scratch.names().empty());
}

TEST(AtomicFile, SyncedFilesAreWhole) {
  const ScratchDirectory scratch;
  auto out = AtomicFile::create(scratch.file("a.txt"), Overwrite::no, Sync::yes);
  ASSERT_TRUE(out);
  std::fputs("words", out->file());
  ASSERT_TRUE(out->commit());
  EXPECT_EQ(scratch.read("a.txt"), "words");
  EXPECT_EQ(scratch.names().size(), 1U);
}

TEST(AtomicFile, OfManyWritersOfOneNameExactlyOneWins) {
  for (int round = 0; round < 50; ++round) {
    const ScratchDirectory scratch;
    std::atomic<int> winners{0}, ready{0};
    std::vector<std::thread> writers;
    writers.reserve(4);
    for (int i = 0; i < 4; ++i) {
      writers.emplace_back([&, i] {
        auto out = AtomicFile::create(scratch.file("a.txt"), Overwrite::no);
        if (out) std::fprintf(out->file(), "writer %d", i);
        ++ready;
        while (ready < 4) std::this_thread::yield();  // all have passed create() before one commits
        if (out && out->commit()) ++winners;
      });
    }
    for (std::thread& writer : writers) writer.join();
    EXPECT_EQ(winners, 1);
    EXPECT_EQ(scratch.names(), std::vector<std::string>{"a.txt"});
    EXPECT_EQ(scratch.read("a.txt").substr(0, 7), "writer ");
  }
}

TEST(AtomicFile, PermissionsFollowTheUmask) {
  const ScratchDirectory scratch;
  const mode_t before = umask(027);
  ASSERT_TRUE(write_words(scratch.file("a.txt"), "words", Overwrite::no));
  umask(before);
  struct stat found {};
  ASSERT_EQ(stat(scratch.file("a.txt").c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777U, 0640U);
}

TEST(AtomicFile, ALinkStaysAndTheFileItLeadsToIsReplaced) {
  const ScratchDirectory scratch;
  ASSERT_EQ(mkdir(scratch.file("sub").c_str(), 0777), 0);
  scratch.write("sub/target.txt", "old");
  ASSERT_EQ(symlink("sub/target.txt", scratch.file("link.txt").c_str()), 0);
  EXPECT_FALSE(write_words(scratch.file("link.txt"), "new", Overwrite::no));
  ASSERT_TRUE(write_words(scratch.file("link.txt"), "new", Overwrite::yes));
  struct stat found {};
  ASSERT_EQ(lstat(scratch.file("link.txt").c_str(), &found), 0);
  EXPECT_TRUE(S_ISLNK(found.st_mode));
  EXPECT_EQ(scratch.read("sub/target.txt"), "new");
}

TEST(AtomicFile, ALinkThatLeadsNowhereIsInTheWayLikeAFile) {
  const ScratchDirectory scratch;
  ASSERT_EQ(symlink("nowhere", scratch.file("link.txt").c_str()), 0);
  EXPECT_FALSE(write_words(scratch.file("link.txt"), "new", Overwrite::no));
  ASSERT_TRUE(write_words(scratch.file("link.txt"), "new", Overwrite::yes));
  EXPECT_EQ(scratch.read("link.txt"), "new");
  EXPECT_FALSE(scratch.holds("nowhere"));
}

TEST(AtomicFile, ErrorsNameTheObstacle) {
  const ScratchDirectory scratch;
  const auto message = [](const std::string& path) {
    const auto out = AtomicFile::create(path, Overwrite::yes);
    return out ? std::string() : out.error().message;
  };
  EXPECT_EQ(message(scratch.path()), scratch.path() + " is a directory: name a file in it");
  EXPECT_NE(message(scratch.file("none/a.txt")).find("there is no directory " + scratch.file("none")),
            std::string::npos);
  EXPECT_NE(message("/dev/null").find("is not a regular file"), std::string::npos);
  EXPECT_NE(message("").find("without a name"), std::string::npos);
  EXPECT_NE(message(scratch.file(std::string(300, 'a'))), "");
  scratch.write("file.txt", "");
  EXPECT_NE(message(scratch.file("file.txt/a.txt")).find("there is no directory"), std::string::npos);
  EXPECT_EQ(scratch.names(), std::vector<std::string>{"file.txt"});
}

TEST(AtomicFile, ADirectoryThatMayNotBeWrittenIsAnError) {
  const ScratchDirectory scratch;
  ASSERT_EQ(chmod(scratch.path().c_str(), 0555), 0);
  const auto out = [&] {
    const test::WithoutRoot user;
    return AtomicFile::create(scratch.file("a.txt"), Overwrite::no);
  }();
  chmod(scratch.path().c_str(), 0777);
  ASSERT_FALSE(out);
  EXPECT_NE(out.error().message.find("no permission"), std::string::npos);
}

class EveryWay : public testing::TestWithParam<Publish> {};

TEST_P(EveryWay, MovesToAFreeNameAndKeepsATakenOne) {
  const ScratchDirectory scratch;
  scratch.write("from", "new");
  EXPECT_EQ(publish_new(scratch.file("from"), scratch.file("to"), GetParam()), 0);
  EXPECT_EQ(scratch.names(), std::vector<std::string>{"to"});
  scratch.write("from", "newer");
  EXPECT_EQ(publish_new(scratch.file("from"), scratch.file("to"), GetParam()), EEXIST);
  EXPECT_EQ(scratch.read("to"), "new");
  EXPECT_EQ(scratch.read("from"), "newer");
}

TEST_P(EveryWay, WithoutASourceTheNameStaysFree) {
  const ScratchDirectory scratch;
  EXPECT_EQ(publish_new(scratch.file("from"), scratch.file("to"), GetParam()), ENOENT);
  EXPECT_TRUE(scratch.names().empty());
}

INSTANTIATE_TEST_SUITE_P(Publish, EveryWay,
                         testing::Values(Publish::rename_noreplace, Publish::hard_link, Publish::claim));

}  // namespace
}  // namespace lowlux::isp
