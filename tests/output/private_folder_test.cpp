#include "isp/output/private_folder.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/scratch_directory.h"

namespace lowlux::isp {
namespace {

namespace fs = std::filesystem;

/// Sets TMPDIR for the life of the object.
class TemporaryFiles {
 public:
  explicit TemporaryFiles(const std::string& folder) {
    if (const char* const set = std::getenv("TMPDIR")) before_ = set;
    setenv("TMPDIR", folder.c_str(), 1);
  }
  ~TemporaryFiles() { before_ ? setenv("TMPDIR", before_->c_str(), 1) : unsetenv("TMPDIR"); }
  TemporaryFiles(const TemporaryFiles&) = delete;
  TemporaryFiles& operator=(const TemporaryFiles&) = delete;

 private:
  std::optional<std::string> before_;
};

TEST(PrivateFolder, IsThatOfItsUserAndEndsWithAllItHolds) {
  const test::ScratchDirectory scratch;
  const TemporaryFiles below(scratch.path());
  std::optional<PrivateFolder> kept;
  {
    auto first = PrivateFolder::make();
    const auto second = PrivateFolder::make();
    ASSERT_TRUE(first && second);
    EXPECT_NE(first->path(), second->path());
    EXPECT_EQ(first->path().parent_path(), fs::path(scratch.path()));
    EXPECT_EQ(fs::status(first->path()).permissions(), fs::perms::owner_all);
    kept.emplace(*std::move(first));
  }
  EXPECT_EQ(scratch.names().size(), 1U);  // what was moved from removes nothing
  fs::create_directories(kept->path() / "deep" / "er");
  std::ofstream(kept->path() / "deep" / "er" / "file") << "text";
  kept.reset();
  EXPECT_TRUE(scratch.names().empty());
}

TEST(PrivateFolder, FoldersWithoutPermissionsAreRemoved) {  // root needs none
  const test::ScratchDirectory scratch;
  const TemporaryFiles below(scratch.path());
  {
    const auto folder = PrivateFolder::make();
    ASSERT_TRUE(folder);
    fs::create_directories(folder->path() / "closed" / "deep");
    std::ofstream(folder->path() / "closed" / "deep" / "file") << "text";
    fs::permissions(folder->path() / "closed" / "deep", fs::perms::none);
    fs::permissions(folder->path() / "closed", fs::perms::none);
  }
  EXPECT_TRUE(scratch.names().empty());
}

TEST(PrivateFolder, WithoutAFolderForTemporaryFilesIsAnError) {
  const test::ScratchDirectory scratch;
  const TemporaryFiles below(scratch.file("none"));
  const auto made = PrivateFolder::make();
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::unwritable);
  EXPECT_NE(made.error().message.find("TMPDIR"), std::string::npos) << made.error().message;
}

}  // namespace
}  // namespace lowlux::isp
